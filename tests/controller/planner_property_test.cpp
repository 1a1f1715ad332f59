// Random programs and thousands of short ones under both dynamics: finite, within limits, where
// they should end, and fast never slower than smooth. VCNC_SEEDS=2000 for more of them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "configs/config.hpp"
#include "controller/limit_use.hpp"
#include "controller/planner.hpp"
#include "controller/player.hpp"
#include "tests/controller/planned_moves.hpp"
#include "tests/controller/program_file.hpp"
#include "tests/controller/random_program.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::planner_property_test {
namespace {

using Dynamics = NcParams::Dynamics;

unsigned seeds() {
  const char* more = std::getenv("VCNC_SEEDS");
  return more ? static_cast<unsigned>(std::atoi(more)) : kSanitized ? 2 : 25;
}

struct Played {
  Tick cycles = 0;
  AxisVector last{};
  std::array<double, 3> use{};
  bool finite = true;
};

Played play(const std::string& path, const Machine& machine) {
  Player player(path, machine);
  Played result;
  for (std::size_t i = 0; i < kAxisCount; ++i) result.last[i] = machine.axes[i].limits.start;
  LimitUse use(machine, result.last);
  for (PlayerStep step = player.step(); !step.done; step = player.step()) {
    for (std::size_t i = 0; i < kAxisCount; ++i)
      result.finite = result.finite && std::isfinite(step.position[i]) &&
                      std::isfinite(step.velocity[i]) && std::isfinite(step.feed);
    use.add(step.position);
    result.last = step.position;
    ++result.cycles;
  }
  for (int i = 0; i < 3; ++i) use.add(result.last);
  for (int order = 1; order <= 3; ++order)
    result.use[static_cast<std::size_t>(order - 1)] = use.largest(order);
  return result;
}

class RandomRuns : public testing::TestWithParam<const char*> {};

TEST_P(RandomRuns, AreSoundUnderBothDynamics) {
  Machine machine =
      load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/" + GetParam() + ".toml");
  machine.probe.in_spindle = false;
  for (unsigned seed = 1000; seed < 1000 + seeds(); ++seed) {
    const std::string text = RandomProgram(seed).text();
    SCOPED_TRACE("seed " + std::to_string(seed));
    const ProgramFile file(text);
    const std::vector<Move> moves = read_moves(text, machine);
    const FrameMap map(machine.kinematics, moves.back().frame);
    const Coordinates end = map.to_axes(moves.back().end);
    Tick smooth = 0;
    for (const Dynamics dynamics : {Dynamics::smooth, Dynamics::fast}) {
      machine.nc.dynamics = dynamics;
      const bool fast = dynamics == Dynamics::fast;
      const Played played = play(file.path(), machine);
      EXPECT_TRUE(played.finite);
      for (const double share : played.use) EXPECT_LE(share, 1.0006) << fast;
      for (std::size_t i = 0; i < kAxisCount; ++i)
        EXPECT_NEAR(played.last[i], end[static_cast<Eigen::Index>(i)], 1e-12) << fast;
      if (!fast) smooth = played.cycles;
      // A run may be a cycle longer where it cannot be any faster.
      if (fast) {
        EXPECT_LE(played.cycles, smooth + static_cast<Tick>(moves.size()));
      }
    }
    if (testing::Test::HasFailure()) FAIL() << text;
  }
}

/// A few short lines in space, or one line in many pieces.
class ShortMoves {
 public:
  explicit ShortMoves(unsigned seed) : random_(seed) {}

  std::vector<Move> corners() {
    std::vector<Move> moves;
    Coordinates last = Coordinates::Zero();
    const double feed = std::pow(10, uniform(-2.5, -0.5)), size = std::pow(10, uniform(-3.5, -2));
    const int count = 2 + static_cast<int>(uniform(0, 4));
    double heading = 0;
    for (int i = 0; i < count; ++i) {
      heading += uniform(-2.5, 2.5);
      const double way = size * uniform(0.2, 1);
      const Coordinates next = last + at(way * std::cos(heading), way * std::sin(heading),
                                         way * uniform(-0.5, 0.5), 0, way * uniform(-5, 5));
      moves.push_back(line(last, next, feed));
      last = next;
    }
    return moves;
  }

  std::vector<Move> pieces(const Coordinates& end, double feed) {
    std::vector<Move> moves;
    Coordinates last = Coordinates::Zero();
    for (double share = 0; share < 1;) {
      share = std::min(1.0, share + uniform(0.001, 0.4));
      moves.push_back(line(last, share * end, feed));
      last = share * end;
    }
    return moves;
  }

  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }

 private:
  std::mt19937_64 random_;
};

Trajectory planned(std::vector<Move> moves, const Machine& machine, Dynamics dynamics) {
  for (Move& move : moves) move.dynamics = dynamics;
  return Trajectory(Path(std::move(moves), 0.01 * kDegree), machine);
}

/// Finite, within limits, never at rest but at both ends, its velocity the derivative of its
/// position, and where it should end.
void expect_sound(const Trajectory& run, const Machine& machine, const Coordinates& end) {
  LimitUse use(machine, run.at(0).q);
  const auto cycles = static_cast<Tick>(std::ceil(run.duration() / kCycle));
  const double step = 1e-6;
  for (Tick k = 1; k <= cycles + 3; ++k) {
    const double t = std::min(seconds(k), run.duration());
    const MotionSample now = run.at(t);
    use.add(now.q);
    if (t < 5 * kCycle || t > run.duration() - 5 * kCycle) continue;
    EXPECT_GT(now.tip_speed, 0) << t;
    const AxisVector before = run.at(t - step).q, after = run.at(t + step).q;
    for (std::size_t i = 0; i < kAxisCount; ++i)
      EXPECT_NEAR((after[i] - before[i]) / (2 * step), now.dq[i], 1e-6) << t;
  }
  for (int order = 1; order <= 3; ++order) EXPECT_LE(use.largest(order), 1.0006) << order;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    EXPECT_NEAR(run.at(run.duration()).q[i], end[static_cast<Eigen::Index>(i)], 1e-12);
}

constexpr unsigned kShortRuns = kSanitized ? 40 : 2000;

TEST(ShortRuns, AreSoundUnderBothDynamics) {
  const Machine machine = test_machine();
  for (unsigned seed = 0; seed < kShortRuns && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const std::vector<Move> moves = ShortMoves(seed).corners();
    const Trajectory smooth = planned(moves, machine, Dynamics::smooth);
    expect_sound(smooth, machine, moves.back().end);
    if (seed % 4 > 0) continue;
    const Trajectory fast = planned(moves, machine, Dynamics::fast);
    expect_sound(fast, machine, moves.back().end);
    EXPECT_LE(fast.duration(), smooth.duration() + kCycle);
  }
}

TEST(ShortRuns, ALineInPiecesTakesAsLongAsInOne) {
  const Machine machine = test_machine();
  for (unsigned seed = 0; seed < kShortRuns / 4 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    ShortMoves random(seed);
    const Coordinates end =
        std::pow(10, random.uniform(-3, -1.5)) *
        at(random.uniform(0.1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const double feed = std::pow(10, random.uniform(-2, -0.5));
    const Trajectory one =
        planned({line(Coordinates::Zero(), end, feed)}, machine, Dynamics::smooth);
    const Trajectory many = planned(random.pieces(end, feed), machine, Dynamics::smooth);
    expect_sound(many, machine, end);
    EXPECT_NEAR(many.duration() / one.duration(), 1, 0.01);
  }
}

INSTANTIATE_TEST_SUITE_P(Planner, RandomRuns, testing::Values("trunnion", "head"));

}  // namespace
}  // namespace vcnc::planner_property_test
