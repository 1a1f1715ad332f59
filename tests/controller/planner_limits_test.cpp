#include "controller/planner_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::planner_limits_test {
namespace {

Coordinates at(double x, double y, double z = 0, double a = 0, double c = 0) {
  Coordinates result;
  result << x, y, z, a, c;
  return result;
}

Machine test_machine() {
  Machine machine;
  for (std::size_t i = 0; i < kAxisCount; ++i) machine.axes[i].limits = {-9, 9, 0, 0.5, 5, 50};
  return machine;
}

Move turn_about_c(double angle) {
  // The controlled point stands still in the workpiece while the table turns.
  Move move;
  move.start = at(0.1, 0, 0);
  move.end = at(0.1, 0, 0, 0, angle);
  move.frame = {true, Vec3::Zero(), 0.15};
  move.feed_mode = Move::Feed::rotary;
  move.feed = 100;
  move.tolerance = 1e-5;
  return move;
}

TEST(PlannerLimits, DerivativesOfATurnAreThoseOfACircle) {
  // Under RTCP the linear axes follow a circle of 0.1 m about C: |q^(n)| = 0.1 / w^n with ds = w
  // dC.
  const Machine machine = test_machine();
  const Path path({turn_about_c(1)}, 1e-4);
  const FrameMap map(machine.kinematics, path.frame());
  const MotionLimits limits(machine, 1);
  const double w = Path::kRotaryLength;
  for (const LimitNode& node : limit_nodes(path, map, limits)) {
    if (node.s < 1e-3 || node.s > path.length() - 1e-3) continue;
    EXPECT_NEAR(std::hypot(node.d1[kX], node.d1[kY]) * w / 0.1, 1, 0.1);
    EXPECT_NEAR(std::hypot(node.d2[kX], node.d2[kY]) * w * w / 0.1, 1, 0.1);
    EXPECT_NEAR(std::hypot(node.d3[kX], node.d3[kY]) * w * w * w / 0.1, 1, 0.2);
    EXPECT_NEAR(node.d1[kC], 1 / w, 1e-6);
    EXPECT_LE(node.v_max, 0.5 * w * 1.0001);  // velocity limit of C
  }
}

TEST(PlannerLimits, AxisPointIsExact) {
  const Machine machine = test_machine();
  const FrameMap map(machine.kinematics, {true, Vec3(0.01, 0.02, 0.03), 0.15});
  const PathPoint point{at(0.1, 0.05, 0.02, 0.3, 0.7), at(0.5, -0.3, 0.2, 20, -40)};
  const AxisPoint axes = axis_point(map, point);
  EXPECT_LE((map.from_axes(axes.q) - point.x).norm(), 1e-15);
  // Product rule for the trunnion with both axes through the origin.
  const double a = 0.3, c = 0.7;
  const Vec3 p = point.x.head<3>() + Vec3(0.01, 0.02, 0.03);
  const Mat3 R = rot_x(-a) * rot_z(-c);
  const Vec3 expected = R * point.dx.head<3>() - point.dx[kA] * Vec3::UnitX().cross(R * p) -
                        point.dx[kC] * (R * Vec3::UnitZ().cross(p));
  EXPECT_LE((axes.dq.head<3>() - expected).norm(), 1e-8);
  EXPECT_NEAR(axes.dq[kA], 20, 1e-9);
  EXPECT_NEAR(axes.dq[kC], -40, 1e-9);
}

TEST(PlannerLimits, AccelerationLeavesRoomForTheCurve) {
  const MotionLimits limits(test_machine(), 1);
  LimitNode node;
  node.d1 = Coordinates::Unit(kX);
  node.d2 = node.d3 = Coordinates::Zero();
  EXPECT_NEAR(node.acceleration(0.1, 1e3, limits), 5, 1e-12);             // by acceleration
  EXPECT_NEAR(node.acceleration(0.1, 0.1, limits), 50 * 0.1 / 2, 1e-12);  // by jerk over T
  node.d2 = 300 * Coordinates::Unit(kX);
  EXPECT_NEAR(node.acceleration(0.1, 1e3, limits), std::min(5 - 3.0, 50 / (3 * 30.0 + 2e-3)), 1e-3);
  EXPECT_EQ(node.acceleration(1.0, 1e3, limits), 0);  // nothing left
  node.a_scale = 0.5;
  EXPECT_NEAR(node.acceleration(0.0, 1e3, limits), 2.5, 1e-12);
}

TEST(PlannerLimits, FeedInAllItsMeanings) {
  Move move = turn_about_c(1);
  const Path turn({move}, 1e-4);
  EXPECT_NEAR(feed_limit(turn, 0, turn.eval(0.005).dx), 100 * Path::kRotaryLength, 1e-9);
  move.feed_mode = Move::Feed::time;
  move.feed = 4;
  EXPECT_NEAR(feed_limit(Path({move}, 1e-4), 0, turn.eval(0.005).dx), Path::kRotaryLength / 4,
              1e-12);
  move.feed_mode = Move::Feed::none;
  EXPECT_GE(feed_limit(Path({move}, 1e-4), 0, turn.eval(0.005).dx), 1e6);
}

}  // namespace
}  // namespace vcnc::planner_limits_test
