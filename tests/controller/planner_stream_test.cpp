// A run that is planned in batches is the run that is planned at once.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bus/tick.hpp"
#include "controller/limit_use.hpp"
#include "controller/planner.hpp"
#include "planned_moves.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::planner_stream_test {
namespace {

using Dynamics = NcParams::Dynamics;
constexpr double kAngleTolerance = 0.01 * kDegree;

/// Rows over a waved surface with corners at their ends, a shorter and a longer move now and then.
std::vector<Move> surface(int count, Dynamics dynamics) {
  std::mt19937_64 random(11);
  std::vector<Move> moves;
  Coordinates at = Coordinates::Zero();
  double x = 0, row = 0, forward = 1;
  for (int i = 0; i < count; ++i) {
    x += forward * (0.2e-3 + 0.6e-3 * static_cast<double>(random() >> 11) * 0x1p-53);
    if (x > 0.08 || x < 0) {
      forward = -forward;
      row += 1e-3;
    }
    Move move;
    move.start = at;
    at << x, std::fmod(row, 0.3), 3e-3 * std::sin(x / 9e-3) * std::sin(row / 7e-3), 0,
        0.3 * std::sin(x / 0.05);
    move.end = at;
    move.feed_mode = Move::Feed::tip;
    move.feed = 0.08;
    move.tolerance = 10e-6;
    move.dynamics = dynamics;
    move.line = i + 1;
    moves.push_back(move);
  }
  return moves;
}

/// Gives the moves in batches, the first one already taken.
MoveSource in_batches(const std::vector<Move>& moves, std::size_t size) {
  return [&moves, size, next = size]() mutable {
    const std::size_t end = std::min(next + size, moves.size());
    MoveBatch batch{{moves.begin() + static_cast<std::ptrdiff_t>(next),
                     moves.begin() + static_cast<std::ptrdiff_t>(end)},
                    end < moves.size()};
    next = end;
    return batch;
  };
}

std::vector<Move> first_of(const std::vector<Move>& moves, std::size_t size) {
  return {moves.begin(), moves.begin() + static_cast<std::ptrdiff_t>(size)};
}

TEST(PathStream, TheSettledPathIsThatOfTheWhole) {
  const std::vector<Move> moves = surface(2000, Dynamics::smooth);
  const Path whole(moves, kAngleTolerance);
  Path path(first_of(moves, 300), kAngleTolerance, true);
  MoveSource more = in_batches(moves, 300);
  double s = 0;
  while (true) {
    EXPECT_GT(path.settled(), s);
    for (; s < path.settled(); s += 0.37e-3) {
      EXPECT_EQ(path.half_width(s), whole.half_width(s)) << s;
      EXPECT_EQ((path.eval(s).x - whole.eval(s).x).norm(), 0) << s;
    }
    if (!path.open()) break;
    MoveBatch batch = more();
    path.forget(s - 0.01);
    path.extend(std::move(batch.moves), batch.open);
  }
  EXPECT_EQ(path.length(), whole.length());
  EXPECT_EQ(path.settled(), path.length());
  EXPECT_LT(path.segments().size(), 700u);
}

class Streamed : public testing::TestWithParam<Dynamics> {};

TEST_P(Streamed, KeepsTheLimitsAndDoesNotStop) {
  if (kSanitized && GetParam() == Dynamics::fast) GTEST_SKIP() << "takes minutes under a sanitizer";
  const Machine machine = test_machine();
  const std::vector<Move> moves = surface(4000, GetParam());
  Trajectory whole(Path(moves, kAngleTolerance), machine);
  Trajectory run(Path(first_of(moves, 400), kAngleTolerance, true), machine,
                 in_batches(moves, 400));
  LimitUse use(machine, run.at(0).q);
  std::size_t most = 0;
  AxisVector last{};
  Tick k = 1;
  for (; !run.complete() || seconds(k) < run.duration(); ++k) {
    run.plan(seconds(k), seconds(k) + 0.5);
    most = std::max(most, run.path().segments().size());
    const MotionSample sample = run.at(seconds(k));
    use.add(sample.q);
    if (seconds(k) > 0.2 && (!run.complete() || seconds(k) < run.duration() - 0.2)) {
      ASSERT_GT(sample.tip_speed, 1e-5) << seconds(k);
    }
  }
  last = run.at(run.duration()).q;
  const double allowed = GetParam() == Dynamics::fast ? 1 + 1e-4 : 1.0006;
  for (int order = 1; order <= 3; ++order) EXPECT_LE(use.largest(order), allowed) << order;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    EXPECT_EQ(last[i], moves.back().end[static_cast<Eigen::Index>(i)]);
  // The law that a batch begins with was found for another part of the path.
  EXPECT_NEAR(run.duration() / whole.duration(), 1, 0.05);
  EXPECT_LT(most, 2500u);
  EXPECT_LE(run.given_up(), 1) << "spans in which the smooth law stands";
}

INSTANTIATE_TEST_SUITE_P(Both, Streamed, testing::Values(Dynamics::smooth, Dynamics::fast));

TEST(Stream, MovesWithoutAPathEndTheRun) {
  // After one move turns of 1e-7 rad: 1e-9 m each, so that no batch gets anywhere.
  const Machine machine = test_machine();
  Move move;
  move.feed_mode = Move::Feed::rotary;
  move.feed = 0.1;
  move.tolerance = 10e-6;
  constexpr double kFirst = 0.1;
  int batches = 0;
  const auto turns = [&] {
    MoveBatch batch{{}, true};
    ++batches;
    for (int i = 0; i < 100; ++i) {
      move.start = move.end;
      move.end[kC] += batches == 1 && i == 0 ? kFirst : 1e-7;
      batch.moves.push_back(move);
    }
    return batch;
  };
  Trajectory run(Path(turns().moves, kAngleTolerance, true), machine, turns);
  run.plan(0, 1);
  EXPECT_TRUE(run.complete());
  EXPECT_LT(batches, 40);
  EXPECT_NEAR(run.at(run.duration()).q[kC], kFirst + (batches * 100 - 1) * 1e-7, 1e-12);
}

}  // namespace
}  // namespace vcnc::planner_stream_test
