#include "controller/speed_table.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::speed_table_test {
namespace {

/// s = T (u - sin(2 pi u) / 2 pi), at rest and without acceleration at both ends.
LawPoint cycloid(double t, double duration) {
  const double w = 2 * std::acos(-1.0) / duration;
  return {t - std::sin(w * t) / w, 1 - std::cos(w * t), w * std::sin(w * t)};
}

SpeedTable table(double duration, int cells) {
  std::vector<LawPoint> points;
  for (int k = 0; k <= cells; ++k) points.push_back(cycloid(duration * k / cells, duration));
  return {points, duration};
}

TEST(SpeedTable, IsAccurateToTheSixthOrder) {
  for (const int cells : {20, 40}) {
    const SpeedTable law = table(2, cells);
    double worst = 0;
    for (double t = 0; t < 2; t += 1.7e-3)
      worst = std::max(worst, std::abs(law.at(t).s - cycloid(t, 2).s));
    // Hermite remainder: h^6 max|s^(6)| / (64 * 720).
    const double h = 2.0 / cells, w = std::acos(-1.0);
    EXPECT_LE(worst, 1.01 * std::pow(h, 6) * std::pow(w, 5) / (64 * 720));
    EXPECT_GE(worst, 0.3 * std::pow(h, 6) * std::pow(w, 5) / (64 * 720));
  }
}

TEST(SpeedTable, SpeedAndAccelerationAreDerivatives) {
  const SpeedTable law = table(1, 30);
  const double e = 1e-6;
  for (double t = 1e-3; t < 0.999; t += 3.1e-3) {
    EXPECT_NEAR((law.at(t + e).s - law.at(t - e).s) / (2 * e), law.at(t).ds, 1e-8);
    EXPECT_NEAR((law.at(t + e).ds - law.at(t - e).ds) / (2 * e), law.at(t).dds, 1e-8);
  }
}

TEST(SpeedTable, EndsAreExact) {
  const SpeedTable law = table(1, 30);
  EXPECT_EQ(law.at(-1).s, 0);
  EXPECT_EQ(law.at(2).s, cycloid(1, 1).s);
  EXPECT_EQ(law.at(0).ds, 0);
}

}  // namespace
}  // namespace vcnc::speed_table_test
