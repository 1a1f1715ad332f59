#include "controller/operation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bus/tick.hpp"
#include "configs/config.hpp"
#include "controller/player.hpp"
#include "tests/controller/program_file.hpp"
#include "tests/controller/random_program.hpp"

namespace vcnc::operation_test {
namespace {

Machine milling_machine(const std::string& name) {
  Machine machine =
      load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/" + name + ".toml");
  machine.probe.in_spindle = false;  // feeds of cutting
  return machine;
}

std::string refusal(const std::string& text) {
  try {
    parse_operation(text);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Operation, IsReadWithAndWithoutBlanks) {
  for (const char* text : {"at 3.2 s feed 50 %", "at 3.2s feed 50%", "  at 3.2 s  feed  50% "}) {
    const Operation o = parse_operation(text);
    EXPECT_EQ(o.kind, Operation::Kind::feed);
    EXPECT_EQ(o.at, 3200);
    EXPECT_EQ(o.line, 0);
    EXPECT_DOUBLE_EQ(o.value, 0.5);
    EXPECT_EQ(o.text, text);
  }
  const Operation single = parse_operation("at line 12 single on");
  EXPECT_EQ(single.kind, Operation::Kind::single_block);
  EXPECT_EQ(single.line, 12);
  EXPECT_EQ(single.value, 1);
  EXPECT_EQ(parse_operation("at 0 s block-delete off").value, 0);
}

TEST(Operation, IsRefusedWithWhatIsAllowed) {
  EXPECT_NE(refusal("feed 50 %").find("expected at SECONDS s WHAT"), std::string::npos);
  EXPECT_NE(refusal("at 1 s feed 151 %").find("0 .. 150"), std::string::npos);
  EXPECT_NE(refusal("at 1 s rapid 101 %").find("0 .. 100"), std::string::npos);
  EXPECT_NE(refusal("at -1 s hold").find("0 .. "), std::string::npos);
  EXPECT_NE(refusal("at 1 s feed 50").find("expected %"), std::string::npos);
  EXPECT_NE(refusal("at 1 s single maybe").find("expected on or off"), std::string::npos);
  EXPECT_NE(refusal("at 1 s hold it").find("too much"), std::string::npos);
  EXPECT_NE(refusal("at line 0 hold").find("1 .. "), std::string::npos);
  EXPECT_NE(refusal("at 1 s jog X").find("feed P %"), std::string::npos);
  EXPECT_NE(refusal("").find("expected at"), std::string::npos);
}

TEST(OperatorPanel, DoesEachOperationOnceAtItsTimeOrLine) {
  OperatorPanel panel({parse_operation("at 0.005 s feed 50 %"), parse_operation("at line 7 hold"),
                       parse_operation("at 0.010 s start")});
  EXPECT_TRUE(panel.due(4, 3).empty());
  EXPECT_EQ(panel.due(5, 3).size(), 1u);
  EXPECT_EQ(panel.switches().feed, 0.5);
  EXPECT_TRUE(panel.due(6, 3).empty());
  ASSERT_EQ(panel.due(7, 7).size(), 1u);
  EXPECT_TRUE(panel.start_to_come());
  EXPECT_EQ(panel.never(), std::vector<std::string>{"at 0.010 s start"});
  EXPECT_EQ(panel.due(20, 7).size(), 1u);
  EXPECT_FALSE(panel.start_to_come());
  EXPECT_TRUE(panel.due(21, 7).empty());
  EXPECT_TRUE(panel.empty());
}

/// Plays a program; `act` is called before every cycle.
template <class Act>
std::vector<PlayerStep> operated(const std::string& text, const Machine& machine, Act act) {
  const ProgramFile file(text);
  Player player(file.path(), machine);
  std::vector<PlayerStep> steps;
  do {
    act(player, static_cast<Tick>(steps.size()), steps);
    steps.push_back(player.step());
  } while (!steps.back().done && steps.size() < 400'000);
  EXPECT_TRUE(steps.back().done);
  return steps;
}

std::vector<PlayerStep> unoperated(const std::string& text, const Machine& machine) {
  return operated(text, machine, [](Player&, Tick, const auto&) {});
}

/// Largest share of the limits in differences of the positions: velocity, acceleration, jerk.
std::array<double, 3> shares(const std::vector<PlayerStep>& steps, const Machine& machine) {
  std::array<double, 3> worst{};
  std::vector<AxisVector> q;
  AxisVector start;
  for (std::size_t i = 0; i < kAxisCount; ++i) start[i] = machine.axes[i].limits.start;
  q.assign(3, start);
  for (const PlayerStep& step : steps) q.push_back(step.position);
  for (std::size_t k = 3; k < q.size(); ++k)
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const AxisLimits& limits = machine.axes[i].limits;
      const double v = (q[k][i] - q[k - 1][i]) / kCycle;
      const double a = (q[k][i] - 2 * q[k - 1][i] + q[k - 2][i]) / (kCycle * kCycle);
      const double j =
          (q[k][i] - 3 * q[k - 1][i] + 3 * q[k - 2][i] - q[k - 3][i]) / (kCycle * kCycle * kCycle);
      worst = {std::max(worst[0], std::abs(v) / limits.velocity),
               std::max(worst[1], std::abs(a) / limits.acceleration),
               std::max(worst[2], std::abs(j) / limits.jerk)};
    }
  return worst;
}

bool same(const PlayerStep& a, const PlayerStep& b) {
  return a.position == b.position && a.velocity == b.velocity && a.line == b.line &&
         a.feed == b.feed && a.spindle == b.spindle && a.done == b.done;
}

constexpr const char* kStraight = "G90 G94\nG1 X100 F3000\nX0\nM30\n";

// A plan that is run at the constant rate r takes exactly 1/r of its time.
TEST(FeedOverride, HalfTheFeedTakesTwiceTheTime) {
  const Machine machine = milling_machine("trunnion");
  const auto whole = unoperated("G90\nG1 X100 F3000\nM30\n", machine);
  const auto half =
      operated("G90\nG1 X100 F3000\nM30\n", machine, [](Player& p, Tick k, const auto&) {
        if (k == 0) p.operate({.feed = 0.5});
      });
  EXPECT_NEAR(static_cast<double>(half.size()), 2.0 * static_cast<double>(whole.size()), 3);
  for (std::size_t k = 1; 2 * k < half.size() && k < whole.size(); ++k) {
    ASSERT_NEAR(half[2 * k - 1].position[kX], whole[k - 1].position[kX], 1e-12) << k;
    ASSERT_NEAR(half[2 * k - 1].velocity[kX], 0.5 * whole[k - 1].velocity[kX], 1e-12) << k;
  }
  EXPECT_NEAR(half[half.size() / 2].feed, 0.5 * 3000 / 60e3, 1e-12);
}

TEST(FeedOverride, AboveTheProgrammedFeedWhereTheAxesHaveRoom) {
  const Machine machine = milling_machine("trunnion");
  for (const double override : {1.1, 1.25, 1.5}) {
    const auto steps = operated(kStraight, machine, [&](Player& p, Tick k, const auto&) {
      if (k == 0) p.operate({.feed = override});
    });
    double fastest = 0;
    for (const PlayerStep& step : steps) fastest = std::max(fastest, step.feed);
    EXPECT_NEAR(fastest, override * 3000 / 60e3, 1e-12);
    const auto worst = shares(steps, machine);
    EXPECT_LE(worst[0], 1.001);
    EXPECT_LE(worst[1], 1.001);
    EXPECT_LE(worst[2], 1.05);
    EXPECT_LT(steps.size(), unoperated(kStraight, machine).size());
  }
}

// Turned down and up again: from the end of the rise on, what comes is the untouched program's to
// the bit, however long the time in between was.
TEST(FeedOverride, BackAtFullRateEverySetPointIsTheProgramsOwn) {
  for (const char* name : {"trunnion", "head"}) {
    const Machine machine = milling_machine(name);
    for (unsigned seed = 1; seed <= 10; ++seed) {
      SCOPED_TRACE(std::string(name) + " seed " + std::to_string(seed));
      RandomProgram random(seed);
      const std::string text = random.text();
      const auto whole = unoperated(text, machine);
      const Tick at = static_cast<Tick>(whole.size()) * (seed % 5 + 1) / 9;
      const auto steps = operated(text, machine, [&](Player& p, Tick k, const auto&) {
        if (k == at) p.operate({.feed = 0.3 + 0.04 * seed});
        if (k == at + 700) p.operate({});
      });
      for (Tick k = 0; k < at; ++k)
        ASSERT_TRUE(same(steps[static_cast<std::size_t>(k)], whole[static_cast<std::size_t>(k)]));
      std::size_t equal = 0;
      while (equal < whole.size() &&
             same(steps[steps.size() - 1 - equal], whole[whole.size() - 1 - equal]))
        ++equal;
      EXPECT_GT(equal, whole.size() / 4);
      const auto worst = shares(steps, machine);
      EXPECT_LE(worst[0], 1.001);
      EXPECT_LE(worst[1], 1.002);
      EXPECT_LE(worst[2], 1.06);
    }
  }
}

TEST(FeedOverride, RandomTurningNeverBreaksALimit) {
  for (const char* name : {"trunnion", "head"}) {
    const Machine machine = milling_machine(name);
    for (unsigned seed = 1; seed <= 8; ++seed) {
      SCOPED_TRACE(std::string(name) + " seed " + std::to_string(seed));
      RandomProgram random(seed);
      const std::string text = random.text();
      const auto whole = unoperated(text, machine);
      unsigned state = seed * 2654435761u;
      const auto draw = [&](unsigned n) {
        state = state * 1664525u + 1013904223u;
        return (state >> 8) % n;
      };
      PanelSwitches switches;
      const auto steps = operated(text, machine, [&](Player& p, Tick k, const auto&) {
        if (k % 150 != 7) return;
        switches.feed = k > 20'000 ? 1 : 0.01 * (10 + draw(141));
        switches.rapid = k > 20'000 ? 1 : 0.01 * (10 + draw(91));
        p.operate(switches);
        if (draw(4) == 0) p.feed_hold();
        if (draw(3) == 0) p.cycle_start();
      });
      const auto worst = shares(steps, machine);
      EXPECT_LE(worst[0], 1.001);
      EXPECT_LE(worst[1], 1.002);
      EXPECT_LE(worst[2], 1.06);
      for (std::size_t i = 0; i < kAxisCount; ++i)
        EXPECT_NEAR(steps.back().position[i], whole.back().position[i], 1e-12);
    }
  }
}

TEST(FeedOverride, RapidsHaveTheirOwnAndStandAtZero) {
  const Machine machine = milling_machine("trunnion");
  const std::string text = "G90\nG0 X100\nG1 X0 F3000\nM30\n";
  const auto whole = unoperated(text, machine);
  const auto steps = operated(text, machine, [](Player& p, Tick k, const auto& before) {
    if (k == 0) p.operate({.rapid = 0});
    if (k > 10 && k < 500) {
      EXPECT_TRUE(p.stands_at_zero());
      EXPECT_EQ(before.back().position[kX], before.front().position[kX]);
    }
    if (k == 500) p.operate({.rapid = 0.25});
  });
  double rapid = 0, feed = 0;
  for (const PlayerStep& step : steps)
    (step.line == 2 ? rapid : feed) = std::max(step.line == 2 ? rapid : feed, step.feed);
  double untouched = 0;
  for (const PlayerStep& step : whole)
    if (step.line == 2) untouched = std::max(untouched, step.feed);
  EXPECT_NEAR(rapid, 0.25 * untouched, 1e-3 * untouched);
  EXPECT_NEAR(feed, 3000 / 60e3, 1e-12);
}

TEST(FeedOverride, IsWithoutEffectWhereTheProgramForbidsIt) {
  const Machine machine = milling_machine("trunnion");
  const std::string text = "G90 G61\nM49\nG1 X50 F3000\nM48\nG1 X100\nM30\n";
  const auto steps = operated(text, machine, [](Player& p, Tick k, const auto&) {
    if (k == 0) p.operate({.feed = 0.5});
  });
  std::array<double, 8> fastest{};
  for (const PlayerStep& step : steps)
    fastest[static_cast<std::size_t>(step.line)] =
        std::max(fastest[static_cast<std::size_t>(step.line)], step.feed);
  EXPECT_NEAR(fastest[3], 0.05, 1e-9);
  EXPECT_LE(fastest[5], 0.05 + 1e-9);
  EXPECT_NEAR(steps[steps.size() - 400].feed, 0.025, 1e-9);
}

TEST(FeedHold, HoldsWithinTheLimitsUntilCycleStart) {
  const Machine machine = milling_machine("trunnion");
  Tick rest = 0;
  const auto steps = operated(kStraight, machine, [&](Player& p, Tick k, const auto& before) {
    p.attended(k < 3000);
    if (k == 600) p.feed_hold();
    if (rest == 0 && k > 600 && p.waiting()) rest = k;
    if (rest > 0 && k > rest && k < 3000) {
      EXPECT_EQ(before.back().velocity, AxisVector{});
      EXPECT_EQ(before.back().position, before[static_cast<std::size_t>(rest)].position);
    }
    if (k == 3000) p.cycle_start();
  });
  EXPECT_GT(rest, 600);
  EXPECT_LT(rest, 1000);
  const auto worst = shares(steps, machine);
  EXPECT_LE(worst[1], 1.001);
  EXPECT_LE(worst[2], 1.05);
}

TEST(FeedHold, NobodyThereMeansOneSecond) {
  const Machine machine = milling_machine("trunnion");
  int waited = 0;
  operated(kStraight, machine, [&](Player& p, Tick k, const auto&) {
    if (k == 600) p.feed_hold();
    waited += p.waiting();
  });
  EXPECT_EQ(waited, static_cast<int>(kProgramStopSeconds / kCycle));
}

// Every block of the program ends with the axes at rest on the path, rounded corners and blocks of
// a few micrometres included, and the path stays what it was.
TEST(SingleBlock, StopsWhereTheBlocksMeet) {
  const Machine machine = milling_machine("trunnion");
  const std::string text =
      "G90 G64\nG1 X20 F3000\nY20\nX20.005\nG2 X0 Y0 R15\nG1 X40 Y1\nZ-3\nG4 P0.01\nX0\nM30\n";
  const auto whole = unoperated(text, machine);
  std::vector<int> stops;
  const auto steps = operated(text, machine, [&](Player& p, Tick k, const auto& before) {
    if (k == 0) p.operate({.single_block = true});
    p.attended(true);
    if (!p.waiting()) return;
    EXPECT_EQ(before.back().velocity, AxisVector{});
    stops.push_back(before.back().line);
    p.cycle_start();
  });
  // At a corner the axes stand where the next block begins.
  EXPECT_EQ(stops, (std::vector<int>{3, 4, 5, 6, 7, 7, 8, 9}));
  const auto worst = shares(steps, machine);
  EXPECT_LE(worst[1], 1.001);
  EXPECT_LE(worst[2], 1.06);
  for (std::size_t k = 0; k < steps.size(); k += 7) {
    double nearest = 1;
    for (const PlayerStep& step : whole) {
      double way = 0;
      for (std::size_t i = 0; i < kAxisCount; ++i)
        way = std::max(way, std::abs(step.position[i] - steps[k].position[i]));
      nearest = std::min(nearest, way);
    }
    EXPECT_LE(nearest, 0.6 * 0.05 * kCycle);  // between two cycles at 3000 mm/min
  }
}

TEST(ProgramStop, WaitsForCycleStartWhereSomebodyIsThere) {
  const Machine machine = milling_machine("trunnion");
  const std::string text = "G1 X1 F600\nM0\nX2\nM1\nX3\nM30\n";
  const auto plain = unoperated(text, machine);
  const auto attended = operated(text, machine, [](Player& p, Tick, const auto& before) {
    p.attended(true);
    if (p.waiting() && before.size() > 5000) p.cycle_start();
  });
  EXPECT_GT(attended.size(), 5000u);
  EXPECT_EQ(attended.back().position, plain.back().position);
  const auto optional = operated(text, machine, [](Player& p, Tick k, const auto&) {
    if (k == 0) p.operate({.optional_stop = true});
  });
  EXPECT_EQ(optional.size() - plain.size(), static_cast<std::size_t>(kProgramStopSeconds / kCycle));
}

TEST(BlockDelete, ActsOnWhatHasNotBeenRead) {
  const Machine machine = milling_machine("trunnion");
  const std::string text = "G90\nG1 X1 F600\nG4 P0.1\n/X50\nG4 P0.1\n/X1\nX2\nM30\n";
  double furthest = 0;
  operated(text, machine, [&](Player& p, Tick k, const auto& before) {
    if (k == 0) p.operate({.block_delete = true});
    if (!before.empty()) furthest = std::max(furthest, before.back().position[kX]);
  });
  EXPECT_NEAR(furthest, 2e-3, 1e-12);
  // What it makes of the program is checked when it comes.
  const ProgramFile file("G90\nG1 X1 F600\nG4 P0.1\n/G91\nX400\nM30\n");
  Machine small = machine;
  small.axes[kX].limits.max = 0.4005;
  PlayerOptions deleting;
  deleting.interpreter.block_delete = true;
  Player player(file.path(), small, deleting);
  player.operate({});
  const auto play_on = [&] {
    while (!player.step().done) {
    }
  };
  EXPECT_THROW(play_on(), ProgramError) << "under G91 it would leave the travel";
}

// The time of a program passes at full rate only; so a place on its path is found again whatever
// the operator did before.
TEST(FeedOverride, APlaceIsFoundAgainByAPlayerWithoutOperator) {
  const Machine machine = milling_machine("trunnion");
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomProgram random(seed);
    const ProgramFile file(random.text());
    Player held(file.path(), machine);
    held.operate({.feed = 0.4 + 0.1 * (seed % 9), .rapid = 0.5});
    for (unsigned k = 0; k < 500 * seed; ++k) held.step();
    held.hold();
    while (!held.held()) held.step();
    if (held.step().done) continue;
    Player sought(file.path(), machine);
    sought.seek(held.time());
    for (std::size_t i = 0; i < kAxisCount; ++i)
      EXPECT_NEAR(sought.rest()[i], held.rest()[i], 1e-12);
  }
}

}  // namespace
}  // namespace vcnc::operation_test
