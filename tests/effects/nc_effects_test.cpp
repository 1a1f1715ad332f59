// Every effect of the NC unit against a closed form, through the player and the NC unit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "bus/cia402.hpp"
#include "bus/messages.hpp"
#include "controller/nc_unit.hpp"
#include "tests/controller/program_file.hpp"

namespace vcnc::nc_effects_test {
namespace {

constexpr double kUm = 1e-6, kNm = 1e-9;

std::vector<PlayerStep> play(const std::string& text, const Machine& machine) {
  const ProgramFile file(text);
  Player player(file.path(), machine);
  std::vector<PlayerStep> steps;
  do {
    steps.push_back(player.step());
  } while (!steps.back().done && steps.size() < 100'000);
  EXPECT_TRUE(steps.back().done);
  return steps;
}

void expect_same(const std::vector<PlayerStep>& a, const std::vector<PlayerStep>& b,
                 double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    for (std::size_t i = 0; i < kAxisCount; ++i)
      ASSERT_NEAR(a[k].position[i], b[k].position[i], tolerance) << "step " << k;
}

// ----------------------------------------------------------------------------- corner cutting

const char* const kCorner = "\nG1 X50 F1200\nY50\nM30\n";

/// How near the tool comes to the corner at (50, 0) mm.
double miss(const std::vector<PlayerStep>& steps) {
  double least = 1;
  for (const PlayerStep& step : steps)
    least = std::min(least, std::hypot(step.position[kX] - 0.05, step.position[kY]));
  return least;
}

TEST(CornerCutting, CutsByTheToleranceAndTheExcess) {
  Machine machine;
  const std::string blended = std::string("G64 P0.02") + kCorner;
  const double exact_to = miss(play(blended, machine));
  machine.effects.get<CornerCutting>().excess = 30 * kUm;
  const std::vector<PlayerStep> steps = play(blended, machine);
  // The planner searches the half width of a blend to 5 %; set-points are 20 um apart.
  EXPECT_LE(exact_to, 20.1 * kUm);
  EXPECT_GE(exact_to, 18.9 * kUm);
  EXPECT_LE(miss(steps), 50.1 * kUm);
  EXPECT_GE(miss(steps), 47.4 * kUm);
  expect_same(steps, play(std::string("G64 P0.05") + kCorner, Machine()), 1e-12);
}

TEST(CornerCutting, LeavesExactStopsAlone) {
  Machine machine;
  machine.effects.get<CornerCutting>().excess = 30 * kUm;
  const std::string exact = std::string("G61") + kCorner;
  expect_same(play(exact, machine), play(exact, Machine()), 0);
  EXPECT_LT(miss(play(exact, machine)), 1e-12);
}

// -------------------------------------------------------------------------------- chord error

TEST(ChordError, ThePathIsThePolygonOfThisSagitta) {
  const double radius = 0.02;
  // As many chords from their own height until just before that of one chord less.
  const auto height = [&](int chords) { return radius * (1 - std::cos(kPi / chords)); };
  for (const auto& [chords, given] :
       {std::pair(12, height(12)), std::pair(12, 0.999 * height(11)), std::pair(50, height(50))}) {
    Machine machine;
    const double sagitta = height(chords);
    machine.effects.get<ChordError>().sagitta = given;
    const std::vector<PlayerStep> steps =
        play("G61\nG1 X20 F600\nG3 X20 Y0 I-20 J0\nM30\n", machine);
    double least = 1, most = 0, worst = 0;
    int dips = 0;
    bool low = false;
    for (const PlayerStep& step : steps) {
      if (step.line < 3 || step.done) continue;
      const double r = std::hypot(step.position[kX], step.position[kY]);
      least = std::min(least, r);
      most = std::max(most, r);
      if (!low && r < radius - 0.8 * sagitta) ++dips;
      low = r < radius - (low ? 0.2 : 0.8) * sagitta;
      // On a chord: r cos(angle to its middle) = R cos(half).
      const double angle = std::atan2(step.position[kY], step.position[kX]) + 2 * kPi;
      const double middle = std::fmod(angle, 2 * kPi / chords) - kPi / chords;
      worst = std::max(worst, std::abs(r * std::cos(middle) - (radius - sagitta)));
    }
    // Set-points are 10 um apart, so one lies within 5 um of a middle: (5 um)^2/2R = 0.6 nm.
    EXPECT_NEAR(least, radius - sagitta, kNm);
    EXPECT_LE(most, radius + 1e-12);
    EXPECT_GE(most, radius - 0.5 * kUm);
    EXPECT_LE(worst, 0.5 * kUm);  // where corners are rounded: tolerance of G61
    EXPECT_EQ(dips, chords);
  }
}

TEST(ChordError, NoHigherThanGivenAndEndsWhereTheArcEnds) {
  Machine machine;
  machine.effects.get<ChordError>().sagitta = 10 * kUm;
  const std::vector<PlayerStep> steps =
      play("G64 P0.001\nG1 X20 F2000\nG2 X0 Y-20 Z5 R20\nG1 X-30\nM30\n", machine);
  double least = 1;
  for (const PlayerStep& step : steps)
    if (step.line == 3) least = std::min(least, std::hypot(step.position[kX], step.position[kY]));
  // 90 deg in ceil(24.83) = 25 chords: R (1 - cos(90 deg / 50)) = 9.869 um.
  EXPECT_NEAR(0.02 - least, 9.869 * kUm, 0.02 * kUm);  // 33 um between set-points
  EXPECT_NEAR(steps.back().position[kX], -0.03, 1e-12);
  EXPECT_NEAR(steps.back().position[kZ], 0.005, 1e-12);
}

TEST(ChordError, NullLeavesArcs) {
  Machine machine;
  machine.effects.simulate_null = true;
  const std::string arc = "G64 P0.001\nG1 X20 F2000\nG2 X0 Y-20 Z5 R20\nM30\n";
  expect_same(play(arc, machine), play(arc, Machine()), 0);
}

// -------------------------------------------------------------------------------- path filter

struct Silent : TelemetrySink {
  void begin(const RunBegin&) override {}
  void row(const TelemetryRow&) override {}
  void alarm(const Alarm& alarm) override { ADD_FAILURE() << alarm.text; }
  void end(const RunEnd&) override {}
};

/// What the NC unit sends while every drive is ready; it is ready from cycle 10 on.
std::vector<GroupCommand> commands(Machine machine, const std::string& text) {
  machine.bus.heartbeat_time = 0;  // nobody is there to produce them
  const ProgramFile file(text);
  Silent sink;
  NcUnit nc(as_nc_believes(machine), file.path(), sink);
  std::vector<GroupCommand> sent;
  bool goes_on = true;
  for (Tick k = 0; goes_on && k < 100'000; ++k) {
    Frames answers, out;
    const auto state =
        k < 10 ? cia402::State::switch_on_disabled : cia402::State::operation_enabled;
    for (int node = 1; node <= 6; ++node)
      answers.push_back(encode(DriveStatus{
          .node = node, .tick = low16(k + 1), .statusword = cia402::statusword_of(state)}));
    answers.push_back(encode(ProbeSample{.tick = low16(k)}));
    answers.push_back(encode(OvertravelState{.tick = low16(k)}));
    goes_on = nc.step(k, answers, out);
    sent.push_back(*decode_group_command(out.front()));
  }
  EXPECT_TRUE(nc.complete());
  return sent;
}

const char* const kCircles =
    "G64 P0.001\nG1 X10 F6000\nG3 X10 Y0 I-10 J0\nG3 X10 Y0 I-10 J0\nG3 X10 Y0 I-10 J0\nM30\n";

/// Radius in the middle of a run.
double radius_of(const std::vector<GroupCommand>& sent) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = sent.size() * 4 / 10; k < sent.size() * 6 / 10; ++k, ++count)
    sum += std::hypot(sent[k].axes[kX].position, sent[k].axes[kY].position);
  return sum / count;
}

Machine filtering(double seconds) {
  Machine machine;
  machine.effects.get<PathFilter>().time_constant = seconds;
  return machine;
}

TEST(PathFilter, ACircleShrinksAsTheLowPassDoes) {
  const double plain = radius_of(commands(Machine(), kCircles)), w = 0.1 / plain;
  for (const double tau : {1e-3, 5e-3, 20e-3}) {
    const double filtered = radius_of(commands(filtering(tau), kCircles));
    const double expected = plain * (1 - 1 / std::sqrt(1 + w * w * tau * tau));
    EXPECT_NEAR(plain - filtered, expected, 0.2 * kNm) << tau;
    EXPECT_NEAR(plain - filtered, plain * w * w * tau * tau / 2, 0.04 * expected) << tau;
  }
}

TEST(PathFilter, BeginsAtRestAndSettles) {
  const Machine machine = filtering(5e-3);
  const std::vector<GroupCommand> plain = commands(Machine(), kCircles);
  const std::vector<GroupCommand> sent = commands(machine, kCircles);
  ASSERT_EQ(sent.size(), plain.size());
  double before[2] = {0, 0};
  for (std::size_t k = 0; k < sent.size(); ++k)
    for (const std::size_t i : {kX, kY}) {
      const double position = sent[k].axes[i].position;
      EXPECT_TRUE(k >= 10 || position == 0);
      // Limits: 0.1 m/s of feed, so no step above 0.1 mm; and never ahead of where it should be.
      EXPECT_LE(std::abs(position - before[i]), 0.1e-3 + kNm);
      before[i] = position;
    }
  EXPECT_LE(sent[20].axes[kX].position, plain[20].axes[kX].position);
  // 100 cycles to settle: exp(-20) of the last lag.
  EXPECT_NEAR(sent.back().axes[kX].position, 0.01, kNm);
  EXPECT_NEAR(sent.back().axes[kY].position, 0, kNm);
}

TEST(PathFilter, IsExactForACubic) {
  // x = j t^3/6 from rest: y = p + j tau^3 exp(-t/tau), p = j (t^3/6 - tau t^2/2 + tau^2 t - tau^3)
  for (const double tau : {0.01e-3, 1e-3, 50e-3}) {
    const Machine machine = filtering(tau);
    Chain<InterpolationPort> chain = machine_chain<InterpolationPort>(machine.effects, 0);
    const double jerk = 50;
    for (int k = 0; k <= 200; ++k) {
      const double t = 1e-3 * k, fading = std::exp(-t / tau);
      InterpolationPort::Signal<double> signal;
      signal.position[kZ] = jerk * t * t * t / 6;
      signal.velocity[kZ] = jerk * t * t / 2;
      chain.step(signal, {{t, 1e-3, k}});
      const double y = jerk * (t * t * t / 6 - tau * (t * t / 2 - tau * (t - tau * (1 - fading))));
      const double dy = jerk * (t * t / 2 - tau * (t - tau * (1 - fading)));
      ASSERT_NEAR(signal.position[kZ], y, 1e-14 + 1e-12 * y) << k;
      ASSERT_NEAR(signal.velocity[kZ], dy, 1e-12 + 1e-11 * dy) << k;
      ASSERT_EQ(signal.position[kX], 0);
    }
  }
}

TEST(PathFilter, NullChangesNothing) {
  Machine machine;
  machine.effects.simulate_null = true;
  const std::vector<GroupCommand> a = commands(machine, kCircles),
                                  b = commands(Machine(), kCircles);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      EXPECT_EQ(a[k].axes[i].position, b[k].axes[i].position);
      EXPECT_EQ(a[k].axes[i].velocity, b[k].axes[i].velocity);
    }
}

}  // namespace
}  // namespace vcnc::nc_effects_test
