#include "controller/player.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "bus/tick.hpp"
#include "configs/config.hpp"
#include "controller/path.hpp"
#include "tests/controller/program_file.hpp"
#include "tests/controller/random_program.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::player_test {
namespace {

Machine machine_of(const std::string& name) {
  return load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/" + name + ".toml");
}

std::vector<PlayerStep> play_file(const std::string& path, const Machine& machine) {
  Player player(path, machine);
  std::vector<PlayerStep> steps;
  do {
    steps.push_back(player.step());
  } while (!steps.back().done && steps.size() < 1'000'000);
  EXPECT_TRUE(steps.back().done);
  return steps;
}

std::vector<PlayerStep> play(const std::string& text, const Machine& machine) {
  const ProgramFile file(text);
  return play_file(file.path(), machine);
}

AxisVector start_of(const Machine& machine) {
  AxisVector q;
  for (std::size_t i = 0; i < kAxisCount; ++i) q[i] = machine.axes[i].limits.start;
  return q;
}

/// Largest shares of the limits in what the axes do, and of the velocity's possible error.
struct Worst {
  double velocity = 0, acceleration = 0, jerk = 0, derivative = 0;
};

Worst worst_of(const std::vector<PlayerStep>& steps, const Machine& machine) {
  std::vector<AxisVector> q(3, start_of(machine)), dq(3, AxisVector{});
  for (const PlayerStep& step : steps) {
    q.push_back(step.position);
    dq.push_back(step.velocity);
  }
  Worst worst;
  for (std::size_t k = 3; k < q.size(); ++k)
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const AxisLimits& limits = machine.axes[i].limits;
      EXPECT_TRUE(std::isfinite(q[k][i]) && std::isfinite(dq[k][i]));
      const double first = q[k][i] - q[k - 1][i], before = q[k - 1][i] - q[k - 2][i];
      const double third = first - 2 * before + (q[k - 2][i] - q[k - 3][i]);
      worst.velocity = std::max({worst.velocity, std::abs(first) / kCycle / limits.velocity,
                                 std::abs(dq[k][i]) / limits.velocity});
      worst.acceleration = std::max(
          worst.acceleration, std::abs(first - before) / (kCycle * kCycle) / limits.acceleration);
      worst.jerk = std::max(worst.jerk, std::abs(third) / (kCycle * kCycle * kCycle) / limits.jerk);
      // A central difference differs from the derivative by at most J dt^2 / 6.
      const double central = (q[k][i] - q[k - 2][i]) / (2 * kCycle);
      worst.derivative = std::max(
          worst.derivative, std::abs(central - dq[k - 1][i]) / (limits.jerk * kCycle * kCycle / 6));
    }
  return worst;
}

void expect_motion_is_sound(const std::vector<PlayerStep>& steps, const Machine& machine) {
  const Worst worst = worst_of(steps, machine);
  EXPECT_LE(worst.velocity, 1.001);
  EXPECT_LE(worst.acceleration, 1.001);
  EXPECT_LE(worst.jerk, 1.001);
  EXPECT_LE(worst.derivative, 3);  // within a cycle the jerk may be above its mean
  EXPECT_EQ(steps.back().velocity, AxisVector{});
}

/// Distance of a point from what a move programmes.
double distance(const Vec3& p, const Move& move) {
  const Vec3 a = move.start.head<3>(), d = move.end.head<3>() - a;
  if (move.kind != Move::Kind::arc) {
    const double length2 = d.squaredNorm();
    const double share = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0.0;
    return (p - a - share * d).norm();
  }
  const PathSegment segment = make_segment(move, 0);
  const auto off = [&](double s) {
    return (p - Vec3(programmed_point(segment, s).x.head<3>())).norm();
  };
  constexpr int kSamples = 24;
  int best = 0;
  for (int i = 1; i <= kSamples; ++i)
    if (off(segment.length * i / kSamples) < off(segment.length * best / kSamples)) best = i;
  double lo = segment.length * std::max(best - 1, 0) / kSamples;
  double hi = segment.length * std::min(best + 1, kSamples) / kSamples;
  for (int i = 0; i < 36; ++i) {
    const double m1 = lo + (hi - lo) / 3, m2 = hi - (hi - lo) / 3;
    (off(m1) < off(m2) ? hi : lo) = off(m1) < off(m2) ? m2 : m1;
  }
  return off(0.5 * (lo + hi));
}

class RandomPrograms : public testing::TestWithParam<const char*> {};

TEST_P(RandomPrograms, KeepLimitsAndTolerance) {
  const std::string name = GetParam();
  Machine machine = machine_of(name);
  machine.probe.in_spindle = false;  // feeds of cutting
  for (unsigned seed = 1; seed <= (kSanitized ? 12 : 120); ++seed) {
    RandomProgram random(seed);
    const std::string text = random.text();
    SCOPED_TRACE(name + " seed " + std::to_string(seed));
    const ProgramFile file(text);
    std::vector<Move> moves;
    std::vector<PlayerStep> steps;
    try {
      moves = read_moves(text, machine);
      steps = play_file(file.path(), machine);
    } catch (const ProgramError& error) {
      ADD_FAILURE() << error.what() << "\n" << text;
      continue;
    }
    expect_motion_is_sound(steps, machine);

    const FrameMap map(machine.kinematics, moves.back().frame);
    const Coordinates end = map.to_axes(moves.back().end);
    for (std::size_t i = 0; i < kAxisCount; ++i)
      EXPECT_NEAR(steps.back().position[i], end[static_cast<Eigen::Index>(i)], 1e-12);

    double worst = 0;
    std::size_t near = 0;
    for (std::size_t k = 0; k < steps.size(); k += 11) {
      while (near + 1 < moves.size() && moves[near].line < steps[k].line) ++near;
      if (moves[near].line != steps[k].line) continue;
      const Coordinates q = Eigen::Map<const Coordinates>(steps[k].position.data());
      const Vec3 p = map.from_axes(q).head<3>();
      double nearest = 1e9;
      const std::size_t first = near > 3 ? near - 3 : 0;
      for (std::size_t i = first; i < std::min(near + 4, moves.size()); ++i)
        nearest = std::min(nearest, distance(p, moves[i]));
      worst = std::max(worst, nearest / (moves[near].exact ? 0.5e-6 : moves[near].tolerance));
    }
    EXPECT_LE(worst, 1.001);
    if (testing::Test::HasFailure()) FAIL() << text;
  }
}

// Held at any moment: on the path, at rest at last, no axis braked harder than half its limit
// besides what the program needed, no jump.
TEST_P(RandomPrograms, AHoldBringsTheAxesToRestOnThePath) {
  Machine machine = machine_of(GetParam());
  machine.probe.in_spindle = false;
  for (unsigned seed = 1; seed <= (kSanitized ? 6 : 40); ++seed) {
    RandomProgram random(seed);
    const std::string text = random.text();
    const ProgramFile file(text);
    const std::vector<PlayerStep> whole = play_file(file.path(), machine);
    const std::size_t at = 1 + (whole.size() - 2) * (seed % 7 + 1) / 8;
    Player player(file.path(), machine);
    std::vector<PlayerStep> steps;
    for (std::size_t k = 0; k < at; ++k) steps.push_back(player.step());
    player.hold();
    while (!player.held()) {
      steps.push_back(player.step());
      ASSERT_LT(steps.size(), at + 5000) << text;
    }
    steps.push_back(player.step());
    EXPECT_EQ(steps.back().velocity, AxisVector{});
    EXPECT_EQ(steps.back().feed, 0);
    for (std::size_t k = at; k < steps.size(); ++k)
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        const double change = steps[k].velocity[i] - steps[k - 1].velocity[i];
        EXPECT_LE(std::abs(change) / kCycle, 1.6 * machine.axes[i].limits.acceleration)
            << "seed " << seed << " axis " << kAxisNames[i];
        EXPECT_NEAR(steps[k].position[i] - steps[k - 1].position[i],
                    0.5 * kCycle * (steps[k].velocity[i] + steps[k - 1].velocity[i]), 2e-6);
      }
    // Where it came to rest, the program would have come through.
    double nearest = 1e9;
    for (const PlayerStep& step : whole) {
      double way = 0;
      for (std::size_t i = 0; i < kAxisCount; ++i)
        way = std::max(way, std::abs(step.position[i] - steps.back().position[i]) /
                                (machine.axes[i].limits.velocity * kCycle));
      nearest = std::min(nearest, way);
    }
    EXPECT_LE(nearest, 0.51) << "seed " << seed;  // between two cycles at full speed
  }
}

// Held at any moment and let go again: from the end of the rise on every set-point is the
// uninterrupted program's to the bit, and on the way there no axis is driven harder than half its
// limit besides what the program needs.
TEST_P(RandomPrograms, GoesOnAfterAHoldAsIfNothingHadBeen) {
  Machine machine = machine_of(GetParam());
  machine.probe.in_spindle = false;
  for (unsigned seed = 1; seed <= (kSanitized ? 6 : 40); ++seed) {
    RandomProgram random(seed);
    const std::string text = random.text();
    SCOPED_TRACE("seed " + std::to_string(seed));
    const ProgramFile file(text);
    const std::vector<PlayerStep> whole = play_file(file.path(), machine);
    const std::size_t at = 1 + (whole.size() - 2) * (seed % 11 + 1) / 12;
    Player player(file.path(), machine);
    std::vector<PlayerStep> steps;
    for (std::size_t k = 0; k < at; ++k) steps.push_back(player.step());
    player.hold();
    const ProgramTime told = player.time();
    const AxisVector rest = player.rest();
    player.go_on();
    EXPECT_FALSE(player.at_full_rate()) << "not before it is at rest";
    while (!player.held()) steps.push_back(player.step());
    for (int k = 0; k < 3; ++k) steps.push_back(player.step());
    EXPECT_EQ(player.time().cycles, told.cycles) << "known from the beginning of the hold on";
    EXPECT_EQ(player.time().on_path, told.on_path);
    for (std::size_t i = 0; i < kAxisCount; ++i)
      EXPECT_NEAR(steps.back().position[i], rest[i], 1e-15);
    player.go_on();
    std::size_t full = steps.size();
    while (!steps.back().done && steps.size() < whole.size() + 20'000) {
      steps.push_back(player.step());
      if (!player.at_full_rate()) full = steps.size();
    }
    ASSERT_TRUE(steps.back().done);
    // The end of both, back to the end of the rise.
    std::size_t same = 0;
    while (same < steps.size() - full && same < whole.size() &&
           steps[steps.size() - 1 - same].position == whole[whole.size() - 1 - same].position &&
           steps[steps.size() - 1 - same].velocity == whole[whole.size() - 1 - same].velocity &&
           steps[steps.size() - 1 - same].line == whole[whole.size() - 1 - same].line)
      ++same;
    EXPECT_GE(same, steps.size() - full) << "of " << steps.size() << text;
    EXPECT_GT(steps.size(), whole.size());
    for (std::size_t k = at; k < steps.size(); ++k)
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        const double change = steps[k].velocity[i] - steps[k - 1].velocity[i];
        ASSERT_LE(std::abs(change) / kCycle, 1.6 * machine.axes[i].limits.acceleration)
            << k << " axis " << kAxisNames[i];
      }
  }
}

// A player that was never there is taken to the place of one that was held, even while its feed was
// rising after an earlier hold.
TEST_P(RandomPrograms, ASoughtPlayerGoesOnLikeTheHeldOne) {
  Machine machine = machine_of(GetParam());
  machine.probe.in_spindle = false;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    RandomProgram random(seed);
    SCOPED_TRACE("seed " + std::to_string(seed));
    const ProgramFile file(random.text());
    const std::size_t length = play_file(file.path(), machine).size();
    Player held(file.path(), machine);
    for (std::size_t k = 0; k < 1 + (length - 2) * (seed % 7) / 7; ++k) held.step();
    for (int again = 0; again < 3; ++again) {
      held.hold();
      while (!held.held()) held.step();
      if (again == 2) break;
      held.go_on();
      for (unsigned k = 0; k < 5 + seed % 9; ++k) held.step();
    }
    Player sought(file.path(), machine);
    sought.seek(held.time());
    EXPECT_TRUE(sought.held());
    EXPECT_EQ(sought.rest(), held.rest());
    EXPECT_EQ(sought.time().cycles, held.time().cycles);
    EXPECT_EQ(sought.time().on_path, held.time().on_path);
    PlayerStep a = held.step(), b = sought.step();
    held.go_on();
    sought.go_on();
    for (int k = 0; k < 100'000 && !(a.done && b.done); ++k) {
      a = held.step();
      b = sought.step();
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        ASSERT_NEAR(a.position[i], b.position[i], 1e-12) << k;
        ASSERT_NEAR(a.velocity[i], b.velocity[i], 1e-9) << k;
      }
      ASSERT_EQ(a.line, b.line);
      ASSERT_EQ(a.spindle, b.spindle);
    }
    EXPECT_TRUE(a.done && b.done);
  }
}

TEST(Player, CannotBeSoughtBeyondItsEnd) {
  const ProgramFile file("G90 G21\nG1 X1 F1000\nM30\n");
  Player player(file.path(), machine_of("trunnion"));
  EXPECT_THROW(player.seek({1'000'000, 0}), std::out_of_range);
}

INSTANTIATE_TEST_SUITE_P(Player, RandomPrograms, testing::Values("trunnion", "head"));

TEST(Player, AwkwardProgramsKeepTheLimits) {
  // Remnants of nanometres, reversals, huge and tiny tolerances, the pole, turns on the spot.
  const char* const kPrograms[] = {
      "G91\nG1 X0.00001 F100\nX0.00000001\nX0.00001\nY0.00001\nG4 P0\nX0.00000001\nG4 P0\n"
      "X0.000001 A0.000001\nG1 X100 F20000\nX-100\nX0\nX100\nX-100\nG64 P5\nX100\nY100\nX-100\n"
      "Y-100\nG64 P0.00001\nX10\nY10\nX-10\nX10\nG61\nG2 X10 Y0 R5\nG3 X10 Y0 R5\nG2 I10\n"
      "G1 A90 F10000\nC3000\nA-90\nC-3000\nG43.4 H1\nA10 C10\nX1 A10 C10\nA-20\nM30\n",
      "G43.4 H1\nG1 X50 Y0 Z50 F2000\nA0 C0\nA1\nA0\nC90\nA-1\nG1 X50 A0 C0\nX-50 Y0.001 A30 C180\n"
      "X50 A-30\nX0 Y0 Z20 A0 C0\nG2 X0 Y0 I10 A20 C360 F5000\nG18 G3 X20 Z20 I10 F1000\n"
      "X0 A-20 I-10\nG19 G2 Y20 Z20 J10 K5\nM30\n"};
  for (const std::string name : {"trunnion", "head"}) {
    Machine machine = machine_of(name);
    machine.probe.in_spindle = false;  // it would limit the feed
    for (const char* program : kPrograms) expect_motion_is_sound(play(program, machine), machine);
  }
}

TEST(Player, SmallGoldenProgram) {
  // X: 50 mm at 6 m/min with a 0.1 s dwell, then home: end, feed and order of lines.
  const Machine machine = machine_of("trunnion");
  const auto steps = play("G54 G90\nG1 X50 F6000\nG4 P0.1\nX0\nM30\n", machine);
  double fastest = 0;
  std::vector<int> lines;
  std::size_t dwell = 0;
  for (const PlayerStep& step : steps) {
    fastest = std::max(fastest, step.feed);
    if (lines.empty() || lines.back() != step.line) lines.push_back(step.line);
    dwell += step.dwell;
    if (step.dwell) {
      EXPECT_EQ(step.position[kX], 0.05);
      EXPECT_EQ(step.velocity, AxisVector{});
    }
    EXPECT_NEAR(step.position[kZ], 0.45, 1e-15);
  }
  EXPECT_NEAR(fastest, 0.1, 1e-9);
  EXPECT_EQ(lines, (std::vector<int>{2, 3, 4, 5}));
  EXPECT_EQ(dwell, 100u);
  EXPECT_EQ(steps.back().position[kX], 0);
  // 2 x (0.5 s at feed + time to change speed) + dwell.
  const double least = 2 * (0.5 + std::sqrt(0.1 / 50) * 2 - 0.0) - 2 * 0.1 + 0.1;
  EXPECT_GE(static_cast<double>(steps.size()) * kCycle, least);
  EXPECT_LE(static_cast<double>(steps.size()) * kCycle, least + 0.35);
}

TEST(Player, SpindleWordsAreWaitedFor) {
  Machine machine = machine_of("trunnion");
  machine.probe.in_spindle = false;
  const auto steps = play("S6000 M3\nG1 X1 F600\nM5\nM19\nM30\n", machine);
  const double speed = 6000 * 2 * kPi / 60;
  std::size_t waiting = 0;
  for (const PlayerStep& step : steps) {
    if (!step.dwell) continue;
    ++waiting;
    if (step.line == 1) {
      EXPECT_EQ(step.spindle, PlayerStep::Spindle::clockwise);
      EXPECT_NEAR(step.spindle_speed, speed, 1e-9);
    }
    if (step.line == 4) {
      EXPECT_EQ(step.spindle, PlayerStep::Spindle::orient);
    }
  }
  EXPECT_NEAR(static_cast<double>(waiting) * kCycle, 2 * speed / machine.spindle.acceleration + 0.2,
              0.004);
  EXPECT_EQ(steps.back().spindle, PlayerStep::Spindle::off);
}

TEST(Player, ProgramStopHoldsAndOptionalStopOnlyEndsTheRun) {
  const Machine machine = machine_of("trunnion");
  const auto plain = play("G1 X1 F600\nX2\nM30\n", machine);
  const auto optional = play("G1 X1 F600\nM1\nX2\nM30\n", machine);
  const auto stop = play("G1 X1 F600\nM0\nX2\nM30\n", machine);
  EXPECT_GT(optional.size(), plain.size());
  EXPECT_EQ(stop.size() - optional.size(), static_cast<std::size_t>(kProgramStopSeconds / kCycle));
}

TEST(Player, ExactStopRestsInTheCorner) {
  const Machine machine = machine_of("trunnion");
  bool rested = false;
  for (const PlayerStep& step : play("G61\nG1 X20 F3000\nY20\nM30\n", machine))
    rested = rested || (step.velocity == AxisVector{} && step.position[kX] == 0.02 &&
                        std::abs(step.position[kY]) < 1e-12);
  EXPECT_TRUE(rested);
  for (const PlayerStep& step : play("G64 P0.1\nG1 X20 F3000\nY20\nM30\n", machine)) {
    const bool in_corner = step.line == 3 && step.position[kY] < 0.005;
    if (in_corner) {
      EXPECT_GT(step.feed, 0);
    }
  }
}

TEST(Player, ACircleHasItsExactRadius) {
  for (const std::string name : {"trunnion", "head"}) {
    const Machine machine = machine_of(name);
    for (const std::string g : {"G2", "G3"}) {
      const auto steps = play(
          "G0 X0 Y0\nG1 X100 F3000\nG4 P0\n" + g + " I-100 F3000\n" + g + " I-100\nM30\n", machine);
      double worst = 0, angle = 0;
      for (std::size_t k = 1; k < steps.size(); ++k) {
        if (steps[k].line < 4 || steps[k].line > 5) continue;
        const AxisVector &p = steps[k].position, &q = steps[k - 1].position;
        worst = std::max(worst, std::abs(std::hypot(p[kX], p[kY]) - 0.1));
        angle += std::remainder(std::atan2(p[kY], p[kX]) - std::atan2(q[kY], q[kX]), 2 * kPi);
      }
      EXPECT_LE(worst, 0.12e-6);
      EXPECT_NEAR(angle, (g == "G3" ? 4 : -4) * kPi, 1e-6);
    }
  }
}

TEST(Player, TheSameProgramGivesTheSameBits) {
  Machine machine = machine_of("head");
  machine.probe.in_spindle = false;  // it would limit the feed
  const std::string text = RandomProgram(7).text();
  const auto a = play(text, machine), b = play(text, machine);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].position, b[k].position);
    EXPECT_EQ(a[k].velocity, b[k].velocity);
  }
}

TEST(Player, MemoryStaysFlatOverManyRuns) {
  Machine machine = machine_of("trunnion");
  machine.probe.in_spindle = false;  // it would limit the feed
  std::string text;
  for (int i = 0; i < 400; ++i) text += "G1 X5 F20000\nY5\nX0\nY0\nG4 P0.001\n";
  const ProgramFile file(text + "M30\n");
  Player player(file.path(), machine);
  std::size_t early = 0, most = 0;
  for (int k = 0;; ++k) {
    const PlayerStep step = player.step();
    if (step.done) break;
    if (k == 2000) early = mallinfo2().uordblks;
    if (k > 2000 && k % 500 == 0) most = std::max(most, mallinfo2().uordblks);
  }
  EXPECT_LE(most, early + 200'000);
}

TEST(Player, SaysDoneAgainAndAgain) {
  const ProgramFile file("G0 X1\nM30\n");
  const Machine machine = machine_of("trunnion");
  Player player(file.path(), machine);
  PlayerStep step;
  for (int k = 0; k < 5000; ++k) step = player.step();
  EXPECT_TRUE(step.done);
  EXPECT_EQ(step.position[kX], 1e-3);
  EXPECT_EQ(step.velocity, AxisVector{});
}

/// G96: the spindle follows the distance of X from its axis, and a feed per turn follows both, at
/// most by the way between two nodes of the plan (1 mm) late where it rises.
TEST(Player, TheSurfaceSpeedIsKeptWhileXMoves) {
  Machine machine = machine_of("trunnion");
  machine.probe.in_spindle = false;
  const auto steps =
      play("G54 G0 X100\nG96 S150 D1500 M3\nG95 F0.1 G1 X12 G61\nG97\nG0 X60\nM30\n", machine);
  constexpr double kPiece = 0.011, kNode = 1.1e-3;  // half a step of the pieces' speed; [m]
  const double v = 150.0 / 60, most = 1500 * 2 * kPi / 60, per_turn = 0.1e-3 / (2 * kPi);
  bool limited = false;
  for (const PlayerStep& step : steps) {
    if (step.line == 5 && !step.dwell) {
      EXPECT_NEAR(step.spindle_speed, most, 1e-9) << "G97 keeps it";
    }
    if (step.line != 3 || step.feed == 0) continue;
    const double x = step.tip.x(), n = std::min(v / x, most);
    ASSERT_NEAR(step.spindle_speed, n, 1e-9) << x;
    limited = limited || n == most;
    ASSERT_LT(step.feed, (1 + kPiece) * per_turn * n) << x;
    if (x > 97e-3 || x < 13.5e-3) continue;  // speeding up and braking
    const double late = std::min(v / (x + kNode), most);
    ASSERT_GT(step.feed, (1 - kPiece) * per_turn * late) << x;
  }
  EXPECT_TRUE(limited) << "within 15.9 mm of the axis";
  EXPECT_EQ(steps.back().spindle_speed, 0);
}

}  // namespace
}  // namespace vcnc::player_test
