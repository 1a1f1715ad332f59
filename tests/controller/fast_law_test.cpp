// The fast dynamics of the planner, against closed forms and the smooth ones.
#include "controller/fast_law.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bus/tick.hpp"
#include "controller/limit_use.hpp"
#include "controller/planner.hpp"
#include "planned_moves.hpp"

namespace vcnc::fast_law_test {
namespace {

using Dynamics = NcParams::Dynamics;

Trajectory plan(std::vector<Move> moves, const Machine& machine,
                Dynamics dynamics = Dynamics::fast) {
  for (Move& move : moves) move.dynamics = dynamics;
  return Trajectory(Path(std::move(moves), 0.01 * kDegree), machine);
}

void expect_within_limits(const Trajectory& run, const Machine& machine) {
  LimitUse use(machine, run.at(0).q);
  const Tick cycles = static_cast<Tick>(std::ceil(run.duration() / kCycle));
  for (Tick k = 1; k <= cycles + 3; ++k) use.add(run.at(std::min(seconds(k), run.duration())).q);
  for (int order = 1; order <= 3; ++order) EXPECT_LE(use.largest(order), 1 + 1e-6) << order;
}

std::vector<Move> corners(int count) {
  std::mt19937_64 random(5);
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<Move> moves;
  Coordinates last = Coordinates::Zero();
  for (int i = 0; i < count; ++i) {
    const Coordinates next = at(uniform(-0.02, 0.02), uniform(-0.02, 0.02), uniform(-0.005, 0.005),
                                0, uniform(-0.2, 0.2));
    moves.push_back(line(last, next, 0.2));
    last = next;
  }
  return moves;
}

TEST(FastLaw, ALineIsCloseToTheClosedForm) {
  const Machine machine = test_machine();
  for (const double length : {1e-3, 1e-2, 0.1, 0.9}) {
    Move move = line(at(-length / 2, 0), at(length / 2, 0), 0);
    move.kind = Move::Kind::rapid;
    move.feed_mode = Move::Feed::none;
    const Trajectory run = plan({move}, machine);
    const double optimum = shortest_time(length);
    EXPECT_GE(run.duration(), optimum * 0.999) << length;
    EXPECT_LE(run.duration(), optimum * 1.04 + 0.003) << length;
    expect_within_limits(run, machine);
  }
}

TEST(FastLaw, TheFeedOfALineAndOfACircleIsHeld) {
  const Machine machine = test_machine();
  Move circle = line(at(0.05, 0), at(0.05, 0), 0.1);
  circle.kind = Move::Kind::arc;
  circle.arc = {Vec3::Zero(), kZ, 2 * kPi};
  for (const Move& move : {line(at(0, 0), at(0.3, 0), 0.1), circle}) {
    const Trajectory run = plan({move}, machine);
    for (double t = 0.3; t < run.duration() - 0.3; t += 1.7e-3)
      EXPECT_NEAR(run.at(t).tip_speed, 0.1, 0.1 * 5e-5) << t;
    expect_within_limits(run, machine);
  }
}

TEST(FastLaw, CornersKeepTheLimitsAndAreFasterThanSmooth) {
  const Machine machine = test_machine();
  const Trajectory fast = plan(corners(40), machine);
  const Trajectory smooth = plan(corners(40), machine, Dynamics::smooth);
  expect_within_limits(fast, machine);
  EXPECT_EQ(fast.given_up(), 0);
  EXPECT_LT(fast.duration(), 0.8 * smooth.duration());
}

TEST(FastLaw, AReversalIsPassedWithFullAcceleration) {
  // There and back: stops cost jerk-limited braking and starting again, and braking through the
  // turning point needs neither to end.
  const Machine machine = test_machine();
  std::vector<Move> moves;
  for (int i = 0; i < 6; ++i)
    moves.push_back(line(i % 2 ? at(0.08, 0.003 * i) : at(0, 0.003 * i),
                         i % 2 ? at(0, 0.003 * (i + 1)) : at(0.08, 0.003 * (i + 1)), 1 / 3.0));
  const Trajectory run = plan(moves, machine);
  expect_within_limits(run, machine);
  // From rest to rest with v = 1/3, a = 5, j = 50 the acceleration stays below its limit.
  const double length = (moves[0].end - moves[0].start).norm(), v = 1 / 3.0;
  const double stops = 6 * (length / v + 2 * std::sqrt(v / 50));
  EXPECT_LT(run.duration(), 0.95 * stops);
}

TEST(FastLaw, SpansMeetWithoutAStop) {
  // Some 30 s: several spans.
  const Machine machine = test_machine();
  const Trajectory run = plan(corners(160), machine);
  expect_within_limits(run, machine);
  ASSERT_GT(run.duration(), 25);
  double before = 0;
  for (double t = 0; t < run.duration(); t += 1e-3) {
    const MotionSample sample = run.at(t);
    if (t > 0.1 && t < run.duration() - 0.1) {
      EXPECT_GT(sample.tip_speed, 0) << t;
    }
    EXPECT_LT(std::abs(sample.tip_speed - before), 2 * 5e-3) << t;  // 5 m/s2 of two axes
    before = sample.tip_speed;
  }
  const Coordinates end = corners(160).back().end;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    EXPECT_EQ(run.at(run.duration()).q[i], end[static_cast<Eigen::Index>(i)]);
}

TEST(FastLaw, PointDensityDoesNotChangeTheTime) {
  const Machine machine = test_machine();
  const auto lap = [&](int points) {
    const auto point = [&](int i) {
      const double t = 2 * kPi * i / points;
      return at(0.05 * std::sin(t), 0.03 * std::sin(2 * t), 0, 0.3 * std::sin(t), std::cos(t));
    };
    std::vector<Move> moves;
    for (int i = 0; i < points; ++i) moves.push_back(line(point(i), point(i + 1), 0.04));
    return plan(moves, machine).duration();
  };
  EXPECT_NEAR(lap(250) / lap(2000), 1, 0.05);
}

TEST(FastLaw, WithTheProbeNothingIsFasterThanACrashAllows) {
  Machine machine = test_machine();
  machine.probe.in_spindle = true;
  Move move = line(at(-0.2, 0), at(0.2, 0.1), 0);
  move.kind = Move::Kind::rapid;
  move.feed_mode = Move::Feed::none;
  const Trajectory run = plan({move}, machine);
  const std::optional<ProbingLimit> probing = probing_limit(machine);
  double closest = 1e9;
  for (double t = 0.1; t < run.duration() - 0.1; t += 7e-3) {
    const MotionSample sample = run.at(t);
    closest = std::min(closest, probing->at(sample.q, sample.dq).factor);
  }
  EXPECT_GE(closest, 1);
  EXPECT_LE(closest, 1.1);
}

}  // namespace
}  // namespace vcnc::fast_law_test
