#include "controller/planner.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "bus/tick.hpp"
#include "planned_moves.hpp"

namespace vcnc::planner_test {
namespace {

constexpr double kAngleTolerance = 0.01 * kDegree;

/// Largest share of the limits in differences at the bus cycle, order 1 to 3.
std::array<double, 3> worst_shares(const Trajectory& trajectory, const Machine& machine) {
  std::vector<AxisVector> q(3, trajectory.at(0).q);
  const int cycles = static_cast<int>(std::ceil(trajectory.duration() / kCycle));
  for (int k = 1; k <= cycles + 3; ++k)
    q.push_back(trajectory.at(std::min(k * kCycle, trajectory.duration())).q);
  std::array<double, 3> worst{};
  for (std::size_t k = 3; k < q.size(); ++k)
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const AxisLimits& limits = machine.axes[i].limits;
      const double v = (q[k][i] - q[k - 1][i]) / kCycle;
      const double a = (q[k][i] - 2 * q[k - 1][i] + q[k - 2][i]) / (kCycle * kCycle);
      const double j =
          (q[k][i] - 3 * q[k - 1][i] + 3 * q[k - 2][i] - q[k - 3][i]) / (kCycle * kCycle * kCycle);
      worst[0] = std::max(worst[0], std::abs(v) / limits.velocity);
      worst[1] = std::max(worst[1], std::abs(a) / limits.acceleration);
      worst[2] = std::max(worst[2], std::abs(j) / limits.jerk);
    }
  return worst;
}

void expect_within_limits(const Trajectory& trajectory, const Machine& machine) {
  for (const double share : worst_shares(trajectory, machine)) EXPECT_LE(share, 1.001);
}

Trajectory plan(std::vector<Move> moves, const Machine& machine) {
  return Trajectory(Path(std::move(moves), kAngleTolerance), machine);
}

TEST(Planner, ALongLineRunsAtItsFeed) {
  const Machine machine = test_machine();
  const Trajectory run = plan({line(at(0, 0), at(0.3, 0), 0.1)}, machine);
  EXPECT_NEAR(run.at(run.duration() / 2).tip_speed, 0.1, 1e-12);
  // v/a + a/j each is the least for the change of speed; the planner may take up to half more.
  const double least = 0.3 / 0.1 + 2 * std::sqrt(0.1 / 50);
  EXPECT_GE(run.duration(), least - 1e-9);
  EXPECT_LE(run.duration(), least + 0.05);
  expect_within_limits(run, machine);
}

TEST(Planner, NoLineIsFasterThanTheOptimumAndNoneMuchSlower) {
  const Machine machine = test_machine();
  for (const double length : {1e-5, 1e-3, 1e-2, 0.1, 0.9}) {
    Move move = line(at(-length / 2, 0), at(length / 2, 0), 0);
    move.kind = Move::Kind::rapid;
    move.feed_mode = Move::Feed::none;
    const Trajectory run = plan({move}, machine);
    const double optimum = shortest_time(length);
    EXPECT_GE(run.duration(), optimum * 0.999) << length;
    EXPECT_LE(run.duration(), optimum * 1.35 + 0.004) << length;
    expect_within_limits(run, machine);
  }
}

TEST(Planner, BeginsAndEndsAtRest) {
  const Machine machine = test_machine();
  const Trajectory run =
      plan({line(at(0, 0), at(0.05, 0), 0.1), line(at(0.05, 0), at(0.05, 0.03), 0.1)}, machine);
  for (const double t : {0.0, run.duration()}) {
    for (const double v : run.at(t).dq) EXPECT_EQ(v, 0);
  }
  // Zero acceleration: the first and the last millisecond move at most j t^3 / 6.
  EXPECT_LE(run.at(1e-3).q[kX], 50 * 1e-9 / 6 * 1.01);
  EXPECT_LE(0.03 - run.at(run.duration() - 1e-3).q[kY], 50 * 1e-9 / 6 * 1.01);
  EXPECT_EQ(run.at(run.duration()).q[kY], 0.03);
}

TEST(Planner, InverseTimeAndRotaryFeed) {
  const Machine machine = test_machine();
  Move timed = line(at(0, 0), at(0.1, 0, 0, 0, 1), 4);
  timed.feed_mode = Move::Feed::time;
  const Trajectory a = plan({timed}, machine);
  EXPECT_NEAR(a.at(a.duration() / 2).dq[kC], 1.0 / 4, 1e-9);
  EXPECT_NEAR(a.at(a.duration() / 2).tip_speed, 0.1 / 4, 1e-10);

  Move turn = line(at(0, 0), at(0, 0, 0, 0.6, 0.8), 0.2);
  turn.feed_mode = Move::Feed::rotary;
  const Trajectory b = plan({turn}, machine);
  const AxisVector dq = b.at(b.duration() / 2).dq;
  EXPECT_NEAR(std::hypot(dq[kA], dq[kC]), 0.2, 1e-9);
}

TEST(Planner, RapidUsesItsShareOfTheLimits) {
  Machine machine = test_machine();
  machine.nc.rapid_limit = 0.5;
  Move move = line(at(-0.5, 0), at(0.5, 0), 0);
  move.kind = Move::Kind::rapid;
  move.feed_mode = Move::Feed::none;
  const Trajectory run = plan({move}, machine);
  const auto worst = worst_shares(run, machine);
  EXPECT_NEAR(worst[0], 0.5, 1e-6);
  EXPECT_LE(worst[1], 0.5005);
  EXPECT_LE(worst[2], 0.5005);
  EXPECT_GE(worst[2], 0.2);
}

TEST(Planner, ACircleIsLimitedByAcceleration) {
  // v^2 / R and v^3 / R^2 stay within the curve's share of the limits; far from the feed.
  const Machine machine = test_machine();
  const double radius = 0.02;
  Move move = line(at(radius, 0), at(radius, 0), 1.0);
  move.kind = Move::Kind::arc;
  move.arc = {Vec3::Zero(), kZ, 2 * kPi};
  const Trajectory run = plan({move, move, move}, machine);
  const double v = run.at(run.duration() / 2).tip_speed;
  EXPECT_LE(v, std::min(std::sqrt(5 * radius), std::cbrt(50 * radius * radius)) * 1.001);
  EXPECT_GE(v, 0.8 * std::min(std::sqrt(5 * radius), std::cbrt(50 * radius * radius)));
  expect_within_limits(run, machine);
}

TEST(Planner, ATurningAxisLimitsTheFeed) {
  const Machine machine = test_machine();  // C: 3.5 rad/s
  const Trajectory run = plan({line(at(0, 0), at(0.1, 0, 0, 0, 7), 0.5)}, machine);
  const MotionSample middle = run.at(run.duration() / 2);
  EXPECT_NEAR(middle.dq[kC], 3.5, 1e-9);
  expect_within_limits(run, machine);
}

TEST(Planner, FeedNeverExceedsTheProgrammedOne) {
  const Machine machine = test_machine();
  const Trajectory run =
      plan({line(at(0, 0), at(0.05, 0), 0.1), line(at(0.05, 0), at(0.1, 0), 0.01),
            line(at(0.1, 0), at(0.15, 0), 0.1)},
           machine);
  bool slow = false;
  for (double t = 0; t < run.duration(); t += 1e-3) {
    const MotionSample sample = run.at(t);
    const bool middle = sample.q[kX] > 0.05 && sample.q[kX] < 0.1;
    EXPECT_LE(sample.tip_speed, (middle ? 0.01 : 0.1) * 1.001);
    slow = slow || (middle && sample.tip_speed > 0.00999);
  }
  EXPECT_TRUE(slow);
  expect_within_limits(run, machine);
}

TEST(Planner, DensePointsRunWithoutRipple) {
  const Machine machine = test_machine();
  std::vector<Move> moves;
  const double radius = 0.044, step = 3e-4 / radius;
  const auto point = [&](int i) {
    return at(radius * std::cos(i * step), radius * std::sin(i * step));
  };
  for (int i = 0; i < 500; ++i) moves.push_back(line(point(i), point(i + 1), 0.05));
  const Trajectory run = plan(moves, machine);
  for (double t = 0.2; t < run.duration() - 0.2; t += 1e-3)
    EXPECT_NEAR(run.at(t).tip_speed, 0.05, 0.05 * 1e-3);
  EXPECT_EQ(run.repairs(), 0);
  expect_within_limits(run, machine);
}

TEST(Planner, TheVelocityIsTheDerivativeOfThePosition) {
  Machine machine = test_machine();
  for (const auto type : {KinematicsParams::Type::trunnion, KinematicsParams::Type::head}) {
    machine.kinematics.type = type;
    std::vector<Move> moves{line(at(0, 0, 0.02, 0.2, 0), at(0.05, 0.01, 0.02, 0.3, 0.5), 0.1),
                            line(at(0.05, 0.01, 0.02, 0.3, 0.5), at(0.06, 0.05, 0, -0.1, 1), 0.1),
                            line(at(0.06, 0.05, 0, -0.1, 1), at(0.06, 0.05, 0, 0.2, 0), 0.1)};
    moves.back().feed_mode = Move::Feed::rotary;
    for (Move& move : moves) move.frame = {true, Vec3(0.01, 0.02, 0.05), 0.15};
    const Trajectory run = plan(moves, machine);
    constexpr double kStep = 2e-6;
    for (double t = kStep; t < run.duration() - kStep; t += 0.37e-3) {
      const AxisVector before = run.at(t - kStep).q, after = run.at(t + kStep).q;
      const AxisVector dq = run.at(t).dq;
      for (std::size_t i = 0; i < kAxisCount; ++i)
        EXPECT_NEAR((after[i] - before[i]) / (2 * kStep), dq[i], 2e-9) << t << " " << i;
    }
    expect_within_limits(run, machine);
  }
}

TEST(Planner, SharpCornersArePassedSlowly) {
  const Machine machine = test_machine();
  std::vector<Move> moves;
  for (int i = 0; i < 20; ++i)
    moves.push_back(
        line(at(0.01 * i, i % 2 ? 0.01 : 0), at(0.01 * (i + 1), i % 2 ? 0 : 0.01), 0.2));
  const Trajectory run = plan(moves, machine);
  expect_within_limits(run, machine);
  double slowest = 1;
  for (double t = 0.1; t < run.duration() - 0.1; t += 1e-3)
    slowest = std::min(slowest, run.at(t).tip_speed);
  EXPECT_GT(slowest, 0);
}

TEST(Planner, ALapOfThreeThousandPointsIsPlannedInASecond) {
  Machine machine = test_machine();
  std::vector<Move> moves;
  const auto point = [](int i) {
    const double t = 2 * kPi * i / 3500.0;
    return at(0.11 * std::sin(t), 0.06 * std::sin(2 * t), 0.02, 0.12 + 0.05 * std::cos(t),
              2 * std::sin(t));
  };
  for (int i = 0; i < 3500; ++i) {
    Move move = line(point(i), point(i + 1), 0.0333);
    move.frame = {true, Vec3(0, 0, 0.05), 0.15};
    moves.push_back(move);
  }
  for (const auto type : {KinematicsParams::Type::trunnion, KinematicsParams::Type::head}) {
    machine.kinematics.type = type;
    const auto begin = std::chrono::steady_clock::now();
    const Trajectory run = plan(moves, machine);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
#if defined(__OPTIMIZE__) && !defined(VCNC_SANITIZED)
    EXPECT_LT(seconds.count(), 1.0);
#endif
    RecordProperty("planning_ms", static_cast<int>(seconds.count() * 1e3));
    expect_within_limits(run, machine);
  }
}

}  // namespace
}  // namespace vcnc::planner_test
