#include "model/safety/probing_speed.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "model/probe/contact.hpp"
#include "model/safety/protection.hpp"

namespace vcnc::probing_speed_test {
namespace {

using By = ProbingBound::By;

Machine machine_with(double linear, double rotary,
                     KinematicsParams::Type type = KinematicsParams::Type::trunnion) {
  Machine machine;
  machine.kinematics.type = type;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    machine.axes[i].limits.acceleration = is_rotary(i) ? rotary : linear;
  return machine;
}

/// The largest speed along `way` (machine frame, A = C = 0).
double largest_speed(const Machine& machine, double reaction, const Vec3& way) {
  return ProbingLimit(machine, reaction).at({}, {way.x(), way.y(), way.z(), 0, 0}).factor;
}

TEST(StoppingDistance, ReactionAndBraking) {
  // 50 mm/s, 4 ms, 1 m/s^2: 1.45 mm; 100 mm/s: 5.4 mm
  EXPECT_NEAR(stopping_distance(0.05, 4e-3, 1), 1.45e-3, 1e-12);
  EXPECT_NEAR(stopping_distance(0.1, 4e-3, 1), 5.4e-3, 1e-12);
}

TEST(ProbingLimit, ASingleAxisStopsBetweenTheHardStageAndTheLimit) {
  // Default probe, 1 m/s^2, 4 ms: axially 5 - 1.25 (2 + 10 g / 135 g/mm) mm remain.
  const Machine machine = machine_with(1, 10);
  const double axial = 5e-3 - 1.25 * (2e-3 + 0.010 * 9.80665 / 1324);
  EXPECT_NEAR(ProbingLimit(machine, 4e-3).axial_reserve(), axial, 1e-9);
  const auto way_at = [&](const Vec3& way) {
    return stopping_distance(largest_speed(machine, 4e-3, way), 4e-3, 1);
  };
  EXPECT_NEAR(way_at(Vec3::UnitZ()), axial, 1e-9);
  // Across, a surface at 45 deg turns half of the way into axial deflection.
  EXPECT_NEAR(way_at(Vec3::UnitX()), 2 * axial, 1e-9);
  EXPECT_EQ(ProbingLimit(machine, 4e-3).at({}, {0, 0, 1, 0, 0}).by, By::axial);
  EXPECT_EQ(ProbingLimit(machine, 4e-3).at({}, {0, 0, 1, 0, 0}).axis, kZ);
}

TEST(ProbingLimit, AxesTogetherBrakeEachOnItsOwnRamp) {
  // (0.6, 0, 0.8) f: t_r f along the way, then 0.36 f^2/2a and 0.64 f^2/2a.
  const Machine machine = machine_with(1, 10);
  const double f = largest_speed(machine, 4e-3, {0.6, 0, 0.8});
  const double reserve = ProbingLimit(machine, 4e-3).axial_reserve();
  const double braking = std::hypot(0.36, 0.64) * f * f / 2, reacting = 4e-3 * f;
  EXPECT_NEAR(0.5 * (1.8 * reacting + braking + 0.64 * f * f / 2), reserve, 1e-9);
  // One deceleration along the whole way would need more of it.
  EXPECT_LT(0.9 * stopping_distance(f, 4e-3, 1) - reserve, 1.1e-3);
  EXPECT_GE(0.9 * stopping_distance(f, 4e-3, 1), reserve);
}

TEST(ProbingLimit, KeepsThePeriodsCountable) {
  // 20 um every 200 us, however well the axes brake.
  const Machine machine = machine_with(100, 100);
  EXPECT_NEAR(largest_speed(machine, 4e-3, Vec3::UnitX()), 0.1, 1e-12);
  EXPECT_EQ(ProbingLimit(machine, 4e-3).at({}, {1, 0, 0, 0, 0}).by, By::counting);
}

TEST(ProbingLimit, ARotaryAxisCountsWithItsLever) {
  // Ball `lever` beside the C axis; w^2 / 2 alpha times the lever, in one direction across.
  const Machine machine = machine_with(5, 2);
  const double lever = 0.08;
  const Kinematics kinematics(machine.kinematics, machine.probe.length, Vec3::Zero());
  AxisVector q{};
  const Vec3 centre = machine.kinematics.p_MC;
  q[kX] = centre.x() + lever, q[kY] = centre.y(), q[kZ] = centre.z() + machine.probe.length;
  const ProbingBound bound = ProbingLimit(machine, 4e-3).at(q, {0, 0, 0, 0, 1});
  EXPECT_EQ(bound.axis, kC);
  EXPECT_NEAR(bound.lever, lever, 1e-12);
  EXPECT_NEAR(bound.speed, lever, 1e-12);
  const double w = bound.factor;
  if (bound.by == By::axial) {
    EXPECT_NEAR(0.5 * lever * (w * 4e-3 + w * w / 4), ProbingLimit(machine, 4e-3).axial_reserve(),
                1e-12);
  } else {
    EXPECT_NEAR(w * lever, 0.1, 1e-12);
  }
}

TEST(ProbingLimit, AxesThatHoldTheBallTogetherDoNotStopTogether) {
  // The C axis turns, X and Y follow so that the ball stands in the workpiece: no reaction way, but
  // the linear axes stop in their time and the table in another.
  Machine machine = machine_with(5, 0.5);
  const double lever = 0.1;
  AxisVector q{};
  const Vec3 centre = machine.kinematics.p_MC;
  q[kX] = centre.x() + lever, q[kY] = centre.y(), q[kZ] = centre.z() + machine.probe.length;
  const Kinematics kinematics(machine.kinematics, machine.probe.length, Vec3::Zero());
  const auto J = kinematics.jacobian(q);
  const Vec3 linear = -J.leftCols<3>().transpose() * J.col(kC);
  const AxisVector dq{linear.x(), linear.y(), linear.z(), 0, 1};
  const ProbingBound bound = ProbingLimit(machine, 4e-3).at(q, dq);
  EXPECT_NEAR(bound.speed, 0, 1e-12);
  ASSERT_EQ(bound.by, By::axial);
  const double f = bound.factor, on = lever * f * f / 2;  // way = lever w^2 (1/alpha - lever/a) / 2
  EXPECT_NEAR(0.5 * on * (1 / 0.5 - lever / 5), ProbingLimit(machine, 4e-3).axial_reserve(), 1e-9);
}

TEST(ProbingLimit, NothingThatMovesIsNoLimit) {
  EXPECT_TRUE(std::isinf(ProbingLimit(Machine{}, 4e-3).at({}, {}).factor));
}

/// At the bound, the machine braked axis by axis with the whole kinematics, second order included:
/// whatever the surface is like, the deflection stays below the limit.
TEST(ProbingLimit, HoldsForTheWholeKinematics) {
  std::mt19937 random(7);
  const auto unit = [&] { return static_cast<double>(random()) / 0x1p32; };
  const auto between = [&](double a, double b) { return a + (b - a) * unit(); };
  double closest = 0;
  for (int run = 0; run < 400; ++run) {
    Machine machine =
        machine_with(between(1, 8), between(5, 60),
                     run % 2 ? KinematicsParams::Type::head : KinematicsParams::Type::trunnion);
    const ProbingLimit limit(machine, 5e-3);
    const AxisVector q{between(-0.15, 0.15), between(-0.15, 0.15), between(0, 0.3),
                       between(-0.7, 0.7), between(-3, 3)};
    AxisVector dq{between(-1, 1), between(-1, 1), between(-1, 1), between(-3, 3), between(-3, 3)};
    const double f = limit.at(q, dq).factor;
    for (double& v : dq) v *= f;
    const Kinematics kinematics(machine.kinematics, machine.probe.length, Vec3::Zero());
    const ToolPose begin = kinematics.forward(q);
    for (double t = 0; t < 1; t += 1e-3) {
      AxisVector then = q;
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        const double a = machine.axes[i].limits.acceleration, stop = std::abs(dq[i]) / a;
        const double u = std::clamp(t - 5e-3, 0.0, stop);
        then[i] += dq[i] * (std::min(t, 5e-3) + u - (stop > 0 ? u * u / (2 * stop) : 0));
      }
      const Vec3 w = begin.R_WT.transpose() * (kinematics.forward(then).p_WT - begin.p_WT);
      const double lateral = 0.5 * (w.norm() + w.head<2>().norm()) / limit.lateral_reserve();
      const double axial = 0.5 * (w.norm() + std::abs(w.z())) / limit.axial_reserve();
      closest = std::max({closest, lateral, axial});
    }
  }
  EXPECT_GT(closest, 0.9) << "else the bound is of no use";
  EXPECT_LT(closest, 1.02);
}

}  // namespace
}  // namespace vcnc::probing_speed_test
