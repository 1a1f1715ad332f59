// Every effect of the bus against a closed form, through the drive.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "model/drive/axis_drive.hpp"

namespace vcnc::bus_effects_test {
namespace {

constexpr double kCycle = 1e-3;

template <class E>
AxisDrive drive_with(const E& effect, std::uint64_t seed = 1) {
  Machine machine;
  machine.axes[kX].limits.start = 0;
  machine.effects.axis[kX].get<E>() = effect;
  return AxisDrive(machine, kX, seed);
}

TEST(BusLatency, WholeCyclesLate) {
  const auto target = [](int k) {
    const double t = kCycle * std::max(k, 0), w = 2 * kPi * 4;
    return AxisSetpoint{0.02 * (1 - std::cos(w * t)), 0.02 * w * std::sin(w * t)};
  };
  for (const int n : {1, 3, 8}) {
    AxisDrive plain = drive_with(BusLatency{}), late = drive_with(BusLatency{n});
    for (int k = 0; k < n; ++k) late.follow(target(k));
    for (int k = 0; k <= 500; ++k) {
      const AxisCycle a = plain.follow(target(k)), b = late.follow(target(k + n));
      ASSERT_EQ(a.truth, b.truth) << k;
    }
  }
}

TEST(BusLatency, RampFollowingErrorIs50umPerCycle) {
  AxisDrive drive = drive_with(BusLatency{2});
  const double v = 0.05;  // 3000 mm/min
  AxisCycle cycle;
  for (int k = 0; k <= 1500; ++k) cycle = drive.follow({v * kCycle * k, v});
  EXPECT_NEAR(v * 1.5 - cycle.truth.back(), 2 * 50e-6, 1e-12);
}

TEST(BusLatency, BeginsAnewAfterAStop) {
  AxisDrive drive = drive_with(BusLatency{5});
  for (int k = 0; k < 50; ++k) drive.follow({1e-4 * k, 0.1});
  while (!drive.standing()) drive.brake(5);
  const double stopped = drive.position();
  for (int k = 0; k < 10; ++k) {
    drive.follow({stopped, 0});
    EXPECT_EQ(drive.position(), stopped);  // no set-point from before the stop
  }
}

TEST(BusJitter, SetPointErrorIsWhiteWithVelocityTimesJitter) {
  const double jitter = 20e-6;
  AxisDrive drive = drive_with(BusJitter{jitter});
  const int cycles = 40000;
  const double v = 0.02;
  double square = 0, product = 0, mean = 0, before = 0, table = 0;
  for (int k = 0; k < cycles; ++k) {
    const double x = v * kCycle * k;
    const AxisCycle cycle = drive.follow({x, v});
    const double error = (drive.position() - x) / (v * jitter);
    square += error * error / cycles;
    product += error * before / cycles;
    mean += error / cycles;
    before = error;
    if (k >= 1000) table = std::max(table, std::abs(cycle.truth.back() - x));
  }
  // Standard errors: 1/sqrt(2 N) = 0.35 % of the rms, 1/sqrt(N) = 0.5 % of the others; 4 sigma.
  EXPECT_NEAR(std::sqrt(square), 1, 0.014);
  EXPECT_NEAR(mean, 0, 0.02);
  EXPECT_NEAR(product, 0, 0.02);
  EXPECT_GT(table, 0.1 * v * jitter);
  // Nothing at rest.
  AxisDrive resting = drive_with(BusJitter{jitter});
  for (int k = 0; k < 100; ++k) EXPECT_EQ(resting.follow({}).truth.back(), 0);
}

TEST(BusLoss, StaircasesAndTheirMeanLag) {
  const double p = 0.1, v = 0.2e-3;  // slow, so that no step meets the force limit
  Machine machine;
  machine.axes[kX].servo.velocity_ff = 0;
  machine.effects.axis[kX].get<BusLoss>().share = p;
  AxisDrive drive(machine, kX, 7);
  const int settle = 1000, cycles = 60000;
  double lost = 0, lag = 0, table_lag = 0, before = 0;
  for (int k = -settle; k < cycles; ++k) {
    const double x = v * kCycle * (k + settle);
    const AxisCycle cycle = drive.follow({x, v});
    const double received = drive.position();
    const bool held = k > -settle && received == before;
    before = received;
    if (k < 0) continue;
    EXPECT_TRUE(held || received == x);
    lost += held;
    lag += (x - received) / (v * kCycle);
    for (std::size_t i = 0; i < cycle.truth.size(); ++i) {
      const double since = (static_cast<double>(i) - 9) * kDriveLoopTime;
      table_lag += 0.1 * (x + v * since - cycle.truth[i]) / (v * kCycle);
    }
  }
  // Standard errors: sqrt(p (1-p)/N) = 0.0012 of the losses; the lag, geometric with variance
  // p/(1-p)^2 and correlation p from cycle to cycle, sqrt(p (1+p)/N)/(1-p)^1.5 = 0.0016; 3 sigma.
  EXPECT_NEAR(lost / cycles, p, 0.0037);
  EXPECT_NEAR(lag / cycles, p / (1 - p), 0.0048);
  // The loop passes the mean over all loop steps on; its own lag is 1/Kv, 25 cycles. What is left
  // is the difference between both ends of the run.
  EXPECT_NEAR(table_lag / cycles, 25 + lag / cycles, 1e-4);
}

TEST(BusLoss, AnotherSeedLosesOthers) {
  AxisDrive a = drive_with(BusLoss{0.5}, 1), b = drive_with(BusLoss{0.5}, 2),
            again = drive_with(BusLoss{0.5}, 1);
  int same = 0;
  for (int k = 0; k < 1000; ++k) {
    const AxisSetpoint target{1e-5 * k, 1e-2};
    a.follow(target), b.follow(target), again.follow(target);
    EXPECT_EQ(a.position(), again.position());
    same += (a.position() == target.position) == (b.position() == target.position);
  }
  EXPECT_NEAR(same, 500, 4 * 16);  // binomial, sigma 16
}

}  // namespace
}  // namespace vcnc::bus_effects_test
