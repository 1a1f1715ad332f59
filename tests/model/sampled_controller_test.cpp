#include "model/drive/sampled_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "model/drive/axis_drive.hpp"

namespace vcnc::sampled_controller_test {
namespace {

constexpr double kT = 1e-3;

AxisParams sampled_axis(double dead_time) {
  AxisParams p;
  p.servo.controller = ServoParams::Controller::sampled;
  p.servo.kv_per_s = 160;
  p.servo.velocity_gain = 8557;
  p.servo.dead_time = dead_time;
  p.servo.velocity_ff = 0;
  p.servo.acceleration_ff = 0;
  p.mechanics.load = 95;
  p.mechanics.motor_inertia = 0;
  p.mechanics.force_limit = 350;
  return p;
}

TEST(SampledController, DemandIsTheDifferenceEquation) {
  const ServoPort::Signal<double> gains{
      .kv = 160, .velocity_ff = 0.7, .acceleration_ff = 0.3, .force_limit = 40};
  const double kp = 50, inertia = 4;
  SampledController controller(kp, inertia, 0, 0.1);
  std::mt19937 random(1);
  std::vector<double> measured{0.1, 0.1}, commanded{0};
  int limited = 0;
  for (int k = 0; k < 200; ++k) {
    const auto draw = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
    const double x = 0.1 + 0.002 * draw(), x_c = 0.1 + 0.01 * draw(), v_c = 0.02 * draw();
    measured.push_back(x);
    commanded.push_back(v_c);
    controller.sample(gains, x_c, v_c, x);
    const std::size_t n = measured.size();
    const double x_f = 0.5 * (measured[n - 1] + measured[n - 2]),
                 before = 0.5 * (measured[n - 2] + measured[n - 3]);
    const double a_c = (v_c - commanded[commanded.size() - 2]) / kT;
    const double u = kp * (160 * (x_c - x) + 0.7 * v_c - (x_f - before) / kT) + 0.3 * 4 * a_c;
    if (std::abs(u) > 40) {
      EXPECT_EQ(std::abs(controller.demand()), 40);
      ++limited;
    } else {
      EXPECT_NEAR(controller.demand(), u, 1e-9);
    }
  }
  EXPECT_GT(limited, 0);
  EXPECT_LT(limited, 150);
}

// A demand that changes from 0 to F at a sample: after d the force is F, in the step in which d
// falls by its share.
TEST(SampledController, DeadTimeTakesAnyValue) {
  const ServoPort::Signal<double> gains{.kv = 1, .force_limit = 1e3};
  for (const double dead : {0.0, 0.3e-3, 0.325e-3, 1e-3, 2.71e-3, 20e-3}) {
    SampledController controller(10, 1, dead, 0);
    double impulse = 0, later = 0;
    const int cycles = 25;
    for (int k = 0; k < cycles; ++k) {
      controller.sample(gains, 1, 0, 0);
      for (int i = 0; i < 20; ++i) {
        const double force = controller.force(i * 50e-6, 50e-6);
        impulse += force * 50e-6;
        if (k * kT + i * 50e-6 > dead) later = std::max(later, std::abs(force - 10));
      }
    }
    EXPECT_NEAR(impulse, 10 * (cycles * kT - dead), 1e-12) << dead;
    EXPECT_LT(later, 1e-9) << dead;
  }
}

/// The same loop written as a recurrence: exact motion of a mass under two constant forces a cycle.
std::vector<double> recurrence(double dead, const std::vector<double>& command) {
  const double m = 95, kp = 8557, kv = 160;
  const int whole = static_cast<int>(dead / kT);
  const double rest = dead - whole * kT;
  double x = 0, v = 0;
  std::vector<double> out{0}, u(static_cast<std::size_t>(whole + 2), 0.0), all{0, 0, 0};
  for (const double x_c : command) {
    const double older = u[u.size() - 2 - static_cast<std::size_t>(whole)],
                 newer = u[u.size() - 1 - static_cast<std::size_t>(whole)];
    for (const auto& [f, t] : {std::pair{older, rest}, std::pair{newer, kT - rest}}) {
      x += v * t + 0.5 * f / m * t * t;
      v += f / m * t;
    }
    all.push_back(x);
    const double speed = (x - all[all.size() - 3]) / (2 * kT);
    u.push_back(std::clamp(kp * (kv * (x_c - x) - speed), -350.0, 350.0));
    out.push_back(x);
  }
  return out;
}

TEST(SampledController, ClosedLoopIsTheRecurrence) {
  for (const double dead : {0.0, 1e-3, 0.4e-3, 1.15e-3}) {
    std::vector<double> command;
    for (int k = 1; k <= 800; ++k) command.push_back(0.01 * (1 - std::cos(0.03 * k)));
    const std::vector<double> expected = recurrence(dead, command);
    AxisDrive drive(sampled_axis(dead));
    for (std::size_t k = 0; k < command.size(); ++k) {
      const AxisCycle cycle = drive.follow({command[k], 0});
      ASSERT_NEAR(cycle.measured, expected[k + 1], 1e-12) << dead << " cycle " << k;
    }
  }
}

// Without an integrator a constant load F leaves F / (Kp Kv), and a ramp without feed-forward v /
// Kv.
TEST(SampledController, StandsBackByLoadAndSpeed) {
  AxisEffects effects;
  effects.get<WeightImbalance>().force = 30;
  AxisDrive loaded(sampled_axis(0.3e-3), effects);
  AxisCycle cycle;
  for (int k = 0; k < 2000; ++k) cycle = loaded.hold();
  EXPECT_NEAR(cycle.measured, 30 / (8557.0 * 160), 1e-12);
  EXPECT_NEAR(cycle.force * 350, -30, 1e-6);

  for (const double ff : {0.0, 0.5, 1.0}) {
    AxisParams params = sampled_axis(1e-3);
    params.servo.velocity_ff = ff;
    AxisDrive drive(params);
    const double v = 0.1;
    for (int k = 1; k <= 2000; ++k) cycle = drive.follow({v * kT * k, v});
    EXPECT_NEAR(v * kT * 2000 - cycle.measured, (1 - ff) * v / 160, 1e-10) << ff;
  }
}

// At rest: what acts on the load from outside is held by the demand, what is added to the demand is
// taken back by the loops.
TEST(SampledController, StandsBackByKnownForces) {
  for (const bool outside : {true, false}) {
    AxisDrive drive(sampled_axis(0.3e-3));
    AxisCycle cycle;
    for (int k = 0; k < 2000; ++k) {
      drive.tell_force(outside ? KnownForce{.applied = 30} : KnownForce{.added = 30});
      cycle = drive.hold();
    }
    EXPECT_NEAR(cycle.measured, 30 / (8557.0 * 160), 1e-12);
    EXPECT_NEAR(cycle.force * 350, outside ? -30 : 0, 1e-6);
  }
}

// What is added at a sample acts after the dead time, as the demand does.
TEST(SampledController, WhatIsAddedComesLateByTheDeadTime) {
  AxisParams params = sampled_axis(5e-3);
  AxisDrive drive(params);
  std::vector<double> moved;
  for (int k = 0; k < 10; ++k) {
    drive.tell_force({.added = k == 2 ? 100.0 : 0});
    moved.push_back(drive.hold().measured);
  }
  EXPECT_EQ(moved[7], 0);                                         // sample 2, 5 ms later
  EXPECT_NEAR(moved[8], 0.5 * 100 / 95.0 * kT * kT, 1e-12);       // a cycle of it
  EXPECT_NEAR(moved[9] - moved[8], 100 / 95.0 * kT * kT, 1e-12);  // and away
}

TEST(SampledController, ForceStaysWithinItsLimit) {
  AxisDrive drive(sampled_axis(1e-3));
  double most = 0;
  for (int k = 0; k < 500; ++k) most = std::max(most, std::abs(drive.follow({0.05, 0}).force));
  EXPECT_EQ(most, 1);
}

// An explicit velocity gain is the one the crossover frequency stands for, also in a cascade.
TEST(SampledController, ExplicitVelocityGainOfACascade) {
  AxisParams by_frequency, by_gain;
  by_gain.servo.velocity_gain =
      2 * kPi * by_frequency.servo.velocity_bandwidth * by_frequency.mechanics.total_inertia();
  AxisParams other = by_gain;
  other.servo.velocity_gain *= 0.5;
  AxisDrive a(by_frequency), b(by_gain), c(other);
  double apart = 0;
  for (int k = 1; k <= 300; ++k) {
    const AxisSetpoint s{1e-3 * std::sin(0.05 * k), 0.05 * std::cos(0.05 * k)};
    const double x = a.follow(s).measured;
    EXPECT_EQ(x, b.follow(s).measured);
    apart = std::max(apart, std::abs(x - c.follow(s).measured));
  }
  EXPECT_GT(apart, 1e-9);
}

}  // namespace
}  // namespace vcnc::sampled_controller_test
