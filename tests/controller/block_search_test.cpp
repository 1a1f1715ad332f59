// A program that begins in its middle does from there on what the whole program does.
#include "controller/gcode/block_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bus/tick.hpp"
#include "configs/config.hpp"
#include "controller/player.hpp"
#include "tests/controller/program_file.hpp"

namespace vcnc::block_search_test {
namespace {

Machine milling_machine(const std::string& name) {
  Machine machine =
      load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/" + name + ".toml");
  machine.probe.in_spindle = false;
  return machine;
}

std::vector<PlayerStep> play_from(const ProgramFile& file, const Machine& machine, int line) {
  Player player(file.path(), machine, {.from_line = line});
  std::vector<PlayerStep> steps;
  do {
    steps.push_back(player.step());
  } while (!steps.back().done && steps.size() < 300'000);
  EXPECT_TRUE(steps.back().done);
  return steps;
}

std::string refusal(const std::string& text, int line) {
  const ProgramFile file(text);
  try {
    Player(file.path(), milling_machine("trunnion"), {.from_line = line});
  } catch (const ProgramError& e) {
    return e.what();
  }
  return "accepted";
}

// 1 .. 12; the axes rest before line 7, so both plan the same from there on.
const std::string kProgram =
    "G90 G94 F2000\n#1=20\nS500 M3\nG1 X10 Y5\nG91 X[#1/2]\nG90 G43.4 H1 G4 P0.1\n"
    "G1 X30 Y10 Z40 A10 C20\nX35 A12\nG49 G4 P0.1\nG55 G0 X0 Y0\nM5\nM30\n";

TEST(BlockSearch, GoesOnAsTheWholeProgramDoes) {
  for (const char* name : {"trunnion", "head"}) {
    SCOPED_TRACE(name);
    const Machine machine = milling_machine(name);
    const ProgramFile file(kProgram);
    const auto whole = play_from(file, machine, 0);
    const auto rest = play_from(file, machine, 7);
    const auto begin =
        std::find_if(whole.begin(), whole.end(), [](const PlayerStep& s) { return s.line == 7; });
    const auto tail = static_cast<std::size_t>(whole.end() - begin);
    ASSERT_LT(tail, rest.size());
    for (std::size_t k = 1; k <= tail; ++k) {
      const PlayerStep &a = whole[whole.size() - k], &b = rest[rest.size() - k];
      ASSERT_EQ(a.position, b.position) << k;
      ASSERT_EQ(a.line, b.line) << k;
      ASSERT_EQ(a.spindle, b.spindle) << k;
    }
  }
}

// Up, the rotary axes, across, down, and the last of it along the tool at kApproachSpeed.
TEST(BlockSearch, ApproachesInThisOrder) {
  const Machine machine = milling_machine("trunnion");
  const ProgramFile file("G90 F1000\nG1 X50 Y20 Z-30 A20 C40\nX60\nM30\n");
  Player player(file.path(), machine, {.from_line = 3});
  ASSERT_TRUE(player.begins_at());
  EXPECT_EQ(player.begins_at()->line, 3);
  const double z0 = machine.axes[kZ].limits.start;
  std::vector<int> order;
  PlayerStep before;
  for (std::size_t i = 0; i < kAxisCount; ++i) before.position[i] = machine.axes[i].limits.start;
  double down = 0, slow = 0;
  for (PlayerStep step = player.step(); !step.done; step = player.step()) {
    const auto moved = [&](std::size_t axis) {
      return step.position[axis] != before.position[axis];
    };
    const int what = moved(kA) || moved(kC) ? 1 : moved(kX) || moved(kY) ? 2 : moved(kZ) ? 3 : 0;
    if (what > 0 && (order.empty() || order.back() != what)) order.push_back(what);
    if (what == 3) down = std::max(down, std::abs(step.velocity[kZ]));
    if (what == 3 && std::abs(step.position[kZ] - 20e-3) < 15e-3)
      slow = std::max(slow, std::abs(step.velocity[kZ]));
    before = step;
  }
  EXPECT_EQ(order, (std::vector<int>{1, 2, 3, 2}));
  EXPECT_NEAR(slow, Player::kApproachSpeed, 1e-9);
  EXPECT_GT(down, slow);
  EXPECT_GT(z0, 40e-3);
}

TEST(BlockSearch, RefusesWithTheReason) {
  EXPECT_NE(refusal("G0 X1\nM30\n", 9).find("never read"), std::string::npos);
  EXPECT_NE(refusal("G0 X1\nM30\nG0 X2\nM30\n", 3).find("never read"), std::string::npos);
  EXPECT_NE(refusal("F100\no1 repeat [3]\nG91 G1 X1\no1 endrepeat\nM30\n", 3).find("read 3 times"),
            std::string::npos);
  EXPECT_NE(refusal("o1 sub\nG0 X1\no1 endsub\no1 call\no1 call\nM30\n", 2).find("read 2 times"),
            std::string::npos);
  EXPECT_NE(refusal("F100\nG41.1 D2\nG1 X10\nX20 Y5\nG40 X30 Y20\nM30\n", 4).find("cutter"),
            std::string::npos);
  EXPECT_NE(refusal("F100\nG81 X1 Z-1 R2\nX2\nG80\nM30\n", 3).find("cycle G81"), std::string::npos);
  EXPECT_EQ(refusal("F100\nG81 X1 Z-1 R2\nX2\nG80\nG0 X3\nM30\n", 5), "accepted");
  EXPECT_EQ(refusal("F100\no1 repeat [1]\nG91 G1 X1\no1 endrepeat\nM30\n", 3), "accepted");
}

TEST(BlockSearch, FindsABlockByItsNumber) {
  const ProgramFile file("N10 G0 X1\n/N20 X2\nX3 (N30)\n N40 X4\nN10 X5\nM30\n");
  EXPECT_EQ(line_of_block(file.path(), 20), 2);
  EXPECT_EQ(line_of_block(file.path(), 40), 4);
  EXPECT_THROW(line_of_block(file.path(), 30), ProgramError);
  try {
    line_of_block(file.path(), 10);
    ADD_FAILURE();
  } catch (const ProgramError& e) {
    EXPECT_NE(std::string(e.what()).find("lines 1 and 5"), std::string::npos);
  }
}

TEST(BlockSearch, KnowsTheModesThere) {
  const Machine machine = milling_machine("trunnion");
  const ProgramFile file("G90 F600\nS1200 M4\nG59.2\nG43 H1\nG1 X10\nM30\n");
  GcodeInterpreter program(file.path(), machine);
  const BlockStart start = program.run_to(5);
  EXPECT_EQ(start.work_offset, 7u);
  EXPECT_EQ(start.length, 1);
  EXPECT_EQ(start.spindle.mode, SpindleWord::Mode::counter_clockwise);
  EXPECT_NEAR(start.feed, 0.01, 1e-15);
  EXPECT_NE(text_of(start).find("G59.2, T0 H1, F600, S1200"), std::string::npos);
}

}  // namespace
}  // namespace vcnc::block_search_test
