#include "model/drive/spindle.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::spindle_test {
namespace {

constexpr double kCycle = 1e-3;

SpindleParams params() {
  SpindleParams p;
  p.max_speed = 1000;
  p.acceleration = 400;
  p.orient_angle = 1.0;
  return p;
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * kPi)); }

TEST(Spindle, RampsWithItsAcceleration) {
  SpindleDrive spindle(params());
  for (int k = 1; k <= 100; ++k) {
    const SpindleCycle c = spindle.step(SpindleMode::clockwise, 100);
    EXPECT_NEAR(c.speed, std::min(100.0, 400 * kCycle * k), 1e-9);
  }
  EXPECT_FALSE(spindle.step(SpindleMode::clockwise, 100).at_speed);
  SpindleCycle c;
  for (int k = 0; k < 200; ++k) c = spindle.step(SpindleMode::clockwise, 100);
  EXPECT_EQ(c.speed, 100);
  EXPECT_TRUE(c.at_speed);
  for (int k = 0; k < 500; ++k) c = spindle.step(SpindleMode::counter_clockwise, 100);
  EXPECT_EQ(c.speed, -100);
  for (int k = 0; k < 250; ++k) c = spindle.step(SpindleMode::off, 100);
  EXPECT_EQ(c.speed, 0);
  EXPECT_TRUE(spindle.standing());
}

TEST(Spindle, AngleIsTheIntegralOfTheSpeed) {
  SpindleDrive spindle(params());
  double turned = 0, before = 0;
  for (int k = 0; k < 1000; ++k) {
    const SpindleCycle c = spindle.step(SpindleMode::clockwise, 250);
    turned += 0.5 * (before + c.speed) * kCycle;
    before = c.speed;
    EXPECT_LT(angle_between(c.angle, turned), 1e-3);
    EXPECT_GE(c.angle, 0);
    EXPECT_LT(c.angle, 2 * kPi);
  }
}

TEST(Spindle, ClampsTheSpeedAndSaysSo) {
  SpindleDrive spindle(params());
  SpindleCycle c;
  for (int k = 0; k < 3000; ++k) c = spindle.step(SpindleMode::clockwise, 5000);
  EXPECT_EQ(c.speed, 1000);
  EXPECT_TRUE(c.limited);
  EXPECT_FALSE(spindle.step(SpindleMode::clockwise, 1000).limited);
}

TEST(Spindle, OrientsFromAnySpeedWithoutTurningBack) {
  for (const double start : {0.0, 0.5, 5.0, 50.0, 300.0, 1000.0}) {
    for (const SpindleMode mode : {SpindleMode::clockwise, SpindleMode::counter_clockwise}) {
      SpindleDrive spindle(params());
      for (int k = 0; k < 3000 + static_cast<int>(start); ++k) spindle.step(mode, start);
      SpindleCycle c;
      int k = 0;
      double before = spindle.step(SpindleMode::orient, 0).speed;
      for (; k < 10000 && !c.oriented; ++k) {
        c = spindle.step(SpindleMode::orient, 0);
        ASSERT_LE(std::abs(c.speed - before), 400 * kCycle * 1.0001) << start;
        if (std::abs(before) > 50) {
          ASSERT_GT(c.speed * before, 0) << start;
        }
        before = c.speed;
      }
      ASSERT_TRUE(c.oriented) << start;
      EXPECT_TRUE(c.at_speed);
      EXPECT_EQ(c.speed, 0);
      EXPECT_EQ(c.angle, 1.0);
      // Braking with 80 % of the acceleration, at most a few turns of approach.
      EXPECT_LT(k * kCycle, start / 320 + 1.5);
      for (k = 0; k < 100; ++k) c = spindle.step(SpindleMode::orient, 0);
      EXPECT_TRUE(c.oriented);
      EXPECT_EQ(c.angle, 1.0);
    }
  }
}

}  // namespace
}  // namespace vcnc::spindle_test
