#include "analysis/circular.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "model/math.hpp"

namespace vcnc::circular_test {
namespace {

std::vector<CircularPoint> circle(const std::function<double(double)>& dR, int n = 3600) {
  std::vector<CircularPoint> points;
  for (int i = 0; i < n; ++i) {
    const double phi = 2 * kPi * (i + 0.5) / n;
    points.push_back({phi, dR(phi)});
  }
  return points;
}

TEST(Circular, RadiusAndCentreAreSeparated) {
  const auto r = evaluate_circle(
      circle([](double p) { return -8e-6 + 3e-6 * std::cos(p) - 2e-6 * std::sin(p); }), 1);
  ASSERT_TRUE(r);
  EXPECT_NEAR(r->mean, -8e-6, 1e-12);
  EXPECT_NEAR(r->centre_x, 3e-6, 1e-12);
  EXPECT_NEAR(r->centre_y, -2e-6, 1e-12);
  EXPECT_NEAR(r->G, 0, 1e-12);
  EXPECT_NEAR(r->F_max, -8e-6, 1e-12);  // the radius deviation stays in F
  EXPECT_NEAR(r->F_min, -8e-6, 1e-12);
}

TEST(Circular, EllipseOfUnequalGainsIsTheSecondHarmonic) {
  const auto r = evaluate_circle(circle([](double p) { return 32.9e-6 * std::sin(2 * p); }), 1);
  ASSERT_TRUE(r);
  EXPECT_NEAR(r->sin2, 32.9e-6, 1e-12);
  EXPECT_NEAR(r->cos2, 0, 1e-12);
  EXPECT_NEAR(r->G, 65.8e-6, 1e-9);
  EXPECT_NEAR(r->mean, 0, 1e-12);
}

// Lost motion in X: dR jumps where X turns round, at 0 and 180 deg.
TEST(Circular, LostMotionIsAStepAtTheReversalsOfItsAxis) {
  constexpr double kGap = 10e-6;
  const auto dR = [](double p) {
    // Counter-clockwise X falls in the upper half and rises in the lower one.
    const double lag = p < kPi ? kGap / 2 : -kGap / 2;
    return lag * std::cos(p);
  };
  const auto r = evaluate_circle(circle(dR), 1);
  ASSERT_TRUE(r && r->step[0] && r->step[1] && r->step[2] && r->step[3]);
  // At 0 deg from -gap/2 to +gap/2; at 180 deg from -gap/2 to +gap/2 as well.
  EXPECT_NEAR(*r->step[0], kGap, 0.02 * kGap);
  EXPECT_NEAR(*r->step[2], kGap, 0.02 * kGap);
  EXPECT_NEAR(*r->step[1], 0, 0.02 * kGap);
  EXPECT_NEAR(*r->step[3], 0, 0.02 * kGap);
  // Seen in the other sense of travel the same profile steps the other way.
  EXPECT_NEAR(*evaluate_circle(circle(dR), -1)->step[0], -kGap, 0.02 * kGap);
}

TEST(Circular, PartOfACircleIsRefused) {
  auto points = circle([](double) { return 1e-6; });
  points.resize(points.size() * 9 / 10);
  EXPECT_FALSE(evaluate_circle(points, 1));
  EXPECT_FALSE(evaluate_circle({}, 1));
}

}  // namespace
}  // namespace vcnc::circular_test
