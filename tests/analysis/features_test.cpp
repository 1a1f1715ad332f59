// Features against synthetic signals whose numbers are known in closed form.
#include "analysis/features.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "model/math.hpp"

namespace vcnc::features_test {
namespace {

/// A signal over a full turn in `n` steps, counter-clockwise or clockwise.
template <class F>
Curve turn(F&& f, int n = 3600, int direction = 1) {
  Curve c;
  for (int i = 0; i < n; ++i) {
    double phi = direction * 2 * kPi * i / n;
    if (phi < 0) phi += 2 * kPi;
    c.add(phi, f(phi));
  }
  return c;
}

TEST(Features, OfAWave) {
  const Curve c = turn([](double x) { return 3 + 2 * std::sin(x); });
  EXPECT_NEAR(mean(c), 3, 1e-12);
  EXPECT_NEAR(rms(c), std::sqrt(9 + 2), 1e-12);
  EXPECT_NEAR(scatter(c), std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(peak_to_peak(c), 4, 1e-5);  // 3600 points hit the crests to 4e-6
  EXPECT_NEAR(max_abs(c), 5, 1e-5);
  EXPECT_EQ(mean(Curve{}), 0);
  EXPECT_EQ(rms(Curve{}), 0);
  EXPECT_EQ(peak_to_peak(Curve{}), 0);
}

TEST(Features, TrendFarFromZeroKeepsItsDigits) {
  Curve c;
  for (int i = 0; i < 100; ++i) c.add(1e6 + i, 7 - 0.25 * (1e6 + i));
  EXPECT_NEAR(trend(c).slope, -0.25, 1e-12);
  EXPECT_NEAR(trend(c).offset, 7, 1e-5);
}

TEST(Features, WaveOfAPeriodInPosition) {
  Curve c;  // not a whole number of periods, unevenly spaced
  for (int i = 0; i < 997; ++i) {
    const double x = 1e-4 * i + 1e-9 * i * i;
    c.add(x, 1e-6 + 4e-6 * std::sin(2 * kPi * x / 0.012 + 0.7));
  }
  const Wave w = wave(c, 0.012);
  EXPECT_NEAR(w.amplitude(), 4e-6, 1e-15);
  EXPECT_NEAR(w.phase(), 0.7, 1e-9);
  EXPECT_NEAR(w.mean, 1e-6, 1e-15);
}

TEST(Features, HarmonicsDoNotLeakIntoEachOther) {
  const Curve c = turn([](double x) {
    return 1 + 5 * std::cos(x) - 2 * std::sin(x) + 0.5 * std::cos(2 * x) + 0.25 * std::sin(2 * x);
  });
  EXPECT_NEAR(harmonic(c, 1).amplitude(), std::hypot(5, 2), 1e-12);
  EXPECT_NEAR(harmonic(c, 2).cosine, 0.5, 1e-12);
  EXPECT_NEAR(harmonic(c, 2).sine, 0.25, 1e-12);
}

TEST(Features, StepAtAReversalBothWaysAround) {
  for (const int direction : {1, -1}) {
    // Between the steps a straight line, so that the extrapolation is exact.
    const Curve c = turn(
        [&](double phi) {
          const double gone = std::remainder(phi - kPi, 2 * kPi);
          return 3 * gone + (gone * direction > 0 ? 10.0 : 0.0);
        },
        3600, direction);
    ASSERT_TRUE(step_at(c, kPi));
    EXPECT_NEAR(*step_at(c, kPi), 10, 1e-9) << direction;
    EXPECT_NEAR(*step_at(c, kPi / 2), 0, 1e-9);
  }
  EXPECT_FALSE(step_at(turn([](double) { return 0; }, 20), 0)) << "too few points";
}

TEST(Features, StepAcrossTheEndOfTheTurn) {
  const Curve c = turn([](double phi) { return phi < kPi ? 4.0 : -4.0; });
  ASSERT_TRUE(step_at(c, 0));
  EXPECT_NEAR(*step_at(c, 0), 8, 1e-9);
}

TEST(Features, SpikeStandsOnAStraightLine) {
  const Curve c = turn([](double phi) {
    const double gone = std::remainder(phi, 2 * kPi);
    return 0.1 * gone - (std::abs(gone - 0.02) < 0.005 ? 7.0 : 0.0);
  });
  ASSERT_TRUE(spike_at(c, 0));
  EXPECT_NEAR(*spike_at(c, 0), -7, 1e-9);
  EXPECT_NEAR(*spike_at(c, kPi / 2), 0, 1e-9);
}

TEST(Features, DifferenceOfCurvesWithOtherPoints) {
  Curve a, b;
  for (int i = 0; i <= 10; ++i) a.add(i, 2.0 * i);                            // a line, forward
  for (int i = 0; i <= 24; ++i) b.add(12 - 0.5 * i, 5 + 2 * (12 - 0.5 * i));  // back, beyond
  const Curve d = difference(b, a);
  EXPECT_EQ(d.size(), 21u) << "the points beyond 10 are left out";
  for (const double y : d.y) EXPECT_NEAR(y, 5, 1e-12);
  EXPECT_NEAR(*mean_difference(a, b), 5, 1e-12);
  EXPECT_FALSE(mean_difference(a, Curve{}));
  EXPECT_EQ(max_abs(difference(a, a)), 0);
}

TEST(Features, GrowthWithTheSpeed) {
  const std::vector<double> v{10, 20, 40}, square{-3, -12, -48}, constant{5, 5, 5};
  EXPECT_NEAR(*growth_exponent(v, square), 2, 1e-12);
  EXPECT_NEAR(*growth_exponent(v, constant), 0, 1e-12);
  EXPECT_FALSE(growth_exponent(v, std::vector<double>{0, 0, 1}));
}

}  // namespace
}  // namespace vcnc::features_test
