// The dual numbers that check the effects' derivatives, checked themselves.
#include "tests/effects/dual.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "model/effects/ports.hpp"

namespace vcnc::dual_test {
namespace {

/// Every function at some points against a central difference of its double version.
template <class F>
void expect_derivative(const char* name, F&& f) {
  for (const double x : {-0.7, -0.2, 0.3, 0.6}) {
    const double h = 1e-6, difference = (f(x + h) - f(x - h)) / (2 * h);
    const Dual y = f(Dual(x, 1));
    EXPECT_EQ(y.v, f(x)) << name << " at " << x;
    EXPECT_NEAR(y.d, difference, 1e-9 * (1 + std::abs(difference))) << name << " at " << x;
  }
}

#define EXPECT_DERIVATIVE(expression)         \
  expect_derivative(#expression, [](auto x) { \
    using T = decltype(x);                    \
    using namespace std; /* as effects do */  \
    return T(expression);                     \
  })

TEST(DualNumbers, DeriveEveryFunction) {
  EXPECT_DERIVATIVE(x * x + 2 * x - 3 / (x + 2) - x / 4.0);
  EXPECT_DERIVATIVE(sin(x));
  EXPECT_DERIVATIVE(cos(x));
  EXPECT_DERIVATIVE(tan(x));
  EXPECT_DERIVATIVE(asin(x));
  EXPECT_DERIVATIVE(acos(x));
  EXPECT_DERIVATIVE(atan(x));
  EXPECT_DERIVATIVE(atan2(x, 2 - x));
  EXPECT_DERIVATIVE(tanh(x));
  EXPECT_DERIVATIVE(exp(-x * x));
  EXPECT_DERIVATIVE(expm1(x));
  EXPECT_DERIVATIVE(log(x + 2));
  EXPECT_DERIVATIVE(log1p(x));
  EXPECT_DERIVATIVE(sqrt(1 + x));
  EXPECT_DERIVATIVE(hypot(x, x + 1));
  EXPECT_DERIVATIVE(pow(x + 2, 1.7));
  EXPECT_DERIVATIVE(abs(x));
  EXPECT_DERIVATIVE(copysign(x, T(-1)));
  EXPECT_DERIVATIVE(floor(x));
  EXPECT_DERIVATIVE(round(x));
  EXPECT_DERIVATIVE(fmod(x + 5, T(0.37)));
  EXPECT_DERIVATIVE(x > 0 ? x : T(0));
  EXPECT_DERIVATIVE(max(x, T(0.1)));
}

TEST(DualNumbers, StartAtZero) {
  const Dual zero{};
  EXPECT_EQ(zero.v, 0);
  EXPECT_EQ(zero.d, 0);
}

TEST(DualNumbers, LiveInVectors) {
  const Vec3Of<Dual> a(Dual(1, 1), Dual(2, 0), Dual(-2, 0));
  const Vec3 b(0.5, 1, 2);
  EXPECT_NEAR(a.norm().d, 1.0 / 3, 1e-15);
  EXPECT_NEAR((a * 2.0 + 3.0 * a).x().d, 5, 1e-15);
  EXPECT_NEAR(a.dot(b.cast<Dual>()).d, 0.5, 1e-15);
  EXPECT_NEAR(a.cross(b.cast<Dual>().eval()).y().d, -2, 1e-15);
  EXPECT_NEAR(a.cwiseProduct(b).x().d, 0.5, 1e-15);
  EXPECT_NEAR((a * Dual(2, 1)).y().d, 2, 1e-15);
  EXPECT_NEAR(a.normalized().x().d, 1.0 / 3 - 1.0 / 27, 1e-15);
}

}  // namespace
}  // namespace vcnc::dual_test
