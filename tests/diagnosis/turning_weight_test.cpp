#include "diagnosis/evidence/turning_weight.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/probe/noise.hpp"

namespace vcnc {
namespace {

constexpr double kPeriod = 1e-3, kSigma = 0.15e-6, kStep = 6e-6;
constexpr std::size_t kSamples = 12000, kTurns = 5000;

double noise(std::size_t k) { return kSigma * gaussian_noise(7, 0, k)[0]; }

/// A circle that is off its place, read with noise.
std::vector<double> circle() {
  std::vector<double> d(kSamples);
  for (std::size_t k = 0; k < d.size(); ++k)
    d[k] = 4e-6 * std::sin(0.5 * kPeriod * static_cast<double>(k)) + noise(k);
  return d;
}

TEST(TurningWeight, WhereNothingTurnsOverEverySampleCounts) {
  const std::vector<float> w = turning_weight(circle(), kSigma, kPeriod);
  EXPECT_GT(*std::min_element(w.begin(), w.end()), 0.99F);
}

TEST(TurningWeight, AStepCountsAsLittleAsItIsHighForTenMillisecondsEachWay) {
  std::vector<double> d = circle();
  for (std::size_t k = kTurns; k < d.size(); ++k) d[k] += kStep;
  const std::vector<float> w = turning_weight(d, kSigma, kPeriod);
  const float as_high = static_cast<float>(1 / std::hypot(1, kStep / kSigma));
  for (std::size_t k = kTurns - 8; k < kTurns + 8; ++k) EXPECT_NEAR(w[k], as_high, 0.15F * as_high);
  for (std::size_t k = 0; k < d.size(); ++k)
    if (k < kTurns - 13 || k > kTurns + 13) {
      EXPECT_GT(w[k], 0.99F) << k;
    }
}

TEST(TurningWeight, WhatIsNotKnownIsNoStep) {
  std::vector<double> d = circle();
  for (std::size_t k = 3000; k < 3500; ++k) d[k] = std::numeric_limits<double>::quiet_NaN();
  const std::vector<float> w = turning_weight(d, kSigma, kPeriod);
  EXPECT_GT(*std::min_element(w.begin(), w.end()), 0.99F);
  const std::vector<double> none(100, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(turning_weight(none, kSigma, kPeriod), std::vector<float>(100, 1.0F));
  EXPECT_TRUE(turning_weight({}, kSigma, kPeriod).empty());
}

}  // namespace
}  // namespace vcnc
