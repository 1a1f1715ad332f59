// With the probe in the spindle no motion of a program is faster than a crash allows.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <regex>

#include "bus/tick.hpp"
#include "controller/planner_limits.hpp"
#include "controller/player.hpp"
#include "program_file.hpp"
#include "random_program.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::probing_feed_test {
namespace {

/// The feed that a refusal allows; 0: none.
double allowed(const std::string& message) {
  std::smatch found;
  if (!std::regex_search(message, found, std::regex("allowed .*is F([0-9.]+)"))) return 0;
  return std::stod(found[1]);
}

/// Smallest factor to the next bound on the way of a program; below 1: too fast.
double closest(const std::string& text, const Machine& machine) {
  const ProgramFile file(text);
  Player player(file.path(), machine);
  const ProbingLimit limit = *probing_limit(machine);
  double least = std::numeric_limits<double>::infinity();
  PlayerStep before = player.step();
  while (!before.done) {
    const PlayerStep now = player.step();
    AxisVector dq{};  // as the axes really go, not as the planner says
    for (std::size_t i = 0; i < kAxisCount; ++i)
      dq[i] = (now.position[i] - before.position[i]) / kCycle;
    least = std::min(least, limit.at(now.position, dq).factor);
    before = now;
  }
  return least;
}

TEST(ProbingFeed, TheAllowedFeedIsAllowedAndNoMore) {
  const Machine machine;
  struct Case {
    const char *before, *move, *reason;
    double feed;
  };
  for (const Case& c : {Case{"G43.4 H1\n", "X50", "could not be counted", 30000},
                        Case{"G43.4 H1\n", "Z50", "could not be counted", 30000},
                        Case{"", "A20", "A moves the ball at a lever of", 12000},
                        Case{"G0 X200\n", "C90", "C moves the ball at a lever of", 20000},
                        Case{"G93\n", "X50 Y20", "could not be counted", 600}}) {
    const auto program = [&](double feed) {
      return fmt::format("G90 G21\n{}G1 {} F{}\nM30\n", c.before, c.move, feed);
    };
    const std::string message = refusal(program(c.feed), machine);
    EXPECT_NE(message.find("is too fast for the probe"), std::string::npos) << c.move << message;
    EXPECT_NE(message.find(c.reason), std::string::npos) << message;
    EXPECT_NE(message.find(c.before[0] ? ":3:1: F" : ":2:1: F"), std::string::npos) << message;
    const double feed = allowed(message);
    ASSERT_GT(feed, 0) << message;
    EXPECT_EQ(refusal(program(feed), machine), "") << c.move;
    EXPECT_NE(refusal(program(1.01 * feed + 1), machine), "") << c.move;
  }
  // 100 mm/s are 20 um in every 200 us.
  EXPECT_EQ(allowed(refusal("G43.4 H1\nG1 X50 F30000\nM30\n", machine)), 6000);
}

TEST(ProbingFeed, WeakBrakesAllowLess) {
  Machine machine;
  for (const std::size_t i : {kX, kY, kZ}) machine.axes[i].limits.acceleration = 0.5;
  const std::string message = refusal("G43.4 H1\nG1 Z50 F6000\nM30\n", machine);
  EXPECT_NE(message.find("between its range and its axial limit"), std::string::npos) << message;
  const double v = allowed(message) / 60e3, reserve = probing_limit(machine)->axial_reserve();
  EXPECT_NEAR(v * 5e-3 + v * v / (2 * 0.5), reserve, 0.02 * reserve);
}

TEST(ProbingFeed, AProbeWithoutReserveIsRefusedAtAnySpeed) {
  Machine machine;
  machine.probe.overtravel_axial = machine.probe.range;
  for (const char* move : {"G0 X50", "G1 X50 F1"}) {
    const std::string message = refusal(fmt::format("{}\nM30\n", move), machine);
    EXPECT_NE(message.find(":1: in a crash the probe could not be stopped"), std::string::npos);
    EXPECT_NE(message.find("probe.overtravel_axial_mm"), std::string::npos) << message;
  }
  machine.probe.in_spindle = false;
  EXPECT_EQ(refusal("G0 X50\nM30\n", machine), "");
}

TEST(ProbingFeed, RapidsKeepToWhatACrashAllows) {
  Machine machine;
  const std::string program =
      "G90 G21\nG0 X200 Y-100 Z200\nG0 A30 C-120\nG43.4 H1\nG0 X50 Y20 Z150 A0 C60\n"
      "G49\nG28 Z0\nG28 X0 Y0 A0 C0\nM30\n";
  const double with = closest(program, machine);
  EXPECT_GE(with, 1);
  EXPECT_LT(with, 1.06) << "and not much slower: 0.95 of the bound";
  // Without the rule the same rapids go beyond it many times over.
  Machine without = machine;
  without.probe.in_spindle = false;
  const ProgramFile file(program);
  Player player(file.path(), without);
  const ProbingLimit limit = *probing_limit(machine);
  double least = 1;
  for (PlayerStep step = player.step(); !step.done; step = player.step())
    least = std::min(least, limit.at(step.position, step.velocity).factor);
  EXPECT_LT(least, 0.3);
}

TEST(ProbingFeed, TurningAxesSlowTheControlledPointDown) {
  // 2 mm of way while C turns by half a turn: at F2000 it would take 60 ms.
  Machine machine;
  for (const std::size_t i : {kA, kC}) machine.axes[i].limits.velocity = 20;
  const std::string program = "G43.4 H1\nG0 X150 Y0 Z50\nG1 X152 C180 F2000\nM30\n";
  const double least = closest(program, machine);
  EXPECT_GE(least, 0.999);
  EXPECT_LT(least, 1.2);
}

TEST(ProbingFeed, RandomProgramsKeepTheBound) {
  int played = 0;
  for (unsigned seed = 1; seed <= (kSanitized ? 10 : 60); ++seed) {
    Machine machine;
    const std::string text = RandomProgram(seed).text();
    if (!refusal(text, machine).empty()) continue;
    ++played;
    EXPECT_GE(closest(text, machine), 0.99) << seed;
  }
  EXPECT_GT(played, kSanitized ? 0 : 10);
}

}  // namespace
}  // namespace vcnc::probing_feed_test
