// The machine as a whole against closed forms: program in, dynamic error out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "controller/program_writer.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc::whole_machine_test {
namespace {

constexpr double um = 1e-6;

Outcome s_piece(const std::string& machine_file, double feed_mm_min) {
  const Machine machine = load_machine(configs(machine_file));
  const auto piece = make_piece(*piece_params(machine));
  ProgramOptions options;
  options.feed_mm_min = feed_mm_min;
  return play(machine, s_piece_program(machine, *piece, options));
}

class IdealMachine : public testing::TestWithParam<const char*> {};

TEST_P(IdealMachine, MeasuresNothingButWhatThePlannerPlanned) {
  const Outcome run = s_piece(GetParam(), 2000);
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  const ErrorGroup& lap = run.summary.groups.at(0);
  EXPECT_LE(lap.e_servo.max, 0.5 * um);
  EXPECT_GE(lap.e_servo.min, -0.5 * um);
  EXPECT_LE(lap.e_rest.max, 0.5 * um);
  EXPECT_GE(lap.e_rest.min, -0.5 * um);
  double worst = 0;
  for (const ErrorSample& e : run.errors)
    if (e.near_piece && e.contact == Contact::ok && std::abs(e.e_plan) < 3 * um)
      worst = std::max(worst, std::abs(e.e_n - e.e_plan));
  EXPECT_LE(worst, 0.5 * um);
  EXPECT_LE(lap.e_plan.max, 2.5 * um);  // chord 0.2 um and blending 2 um
  EXPECT_EQ(run.summary.coverage_percent, 100);
  EXPECT_EQ(run.summary.verdict, Verdict::pass);
  EXPECT_EQ(run.summary.gaps(), 0u);
  EXPECT_LE(run.nc.end.bus_load_worst, 0.85);
}

INSTANTIATE_TEST_SUITE_P(BothKinematics, IdealMachine,
                         testing::Values("machines/trunnion.toml", "machines/head.toml"));

TEST(WholeMachine, TheIdealMachineScansTheTiltedConeCompletely) {
  const Machine machine = load_machine(configs("machines/trunnion.toml"),
                                       {"setup.piece=" + configs("pieces/cone.toml")});
  const auto piece = make_piece(*piece_params(machine));
  const Outcome run = play(machine, cone_program(machine, *piece, {}));
  EXPECT_EQ(run.summary.verdict, Verdict::pass) << run.summary.verdict_reason;
  EXPECT_EQ(run.summary.coverage_percent, 100);
  EXPECT_LE(run.summary.groups.at(0).e_rest.peak_to_peak(), 1 * um);
}

/// The steady full circle of a circular test: dR(phi) seen by the probe, one value per cycle.
struct Circle {
  std::vector<double> phi, dr;
  double mean() const {
    double sum = 0;
    for (double v : dr) sum += v;
    return sum / static_cast<double>(dr.size());
  }
  double peak_to_peak() const {
    return *std::max_element(dr.begin(), dr.end()) - *std::min_element(dr.begin(), dr.end());
  }
  /// Mean of dR over [from, to] degrees.
  double between(double from, double to) const {
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < phi.size(); ++i) {
      const double degrees = phi[i] / kDegree;
      if (degrees >= from && degrees <= to) sum += dr[i], ++n;
    }
    return sum / n;
  }
  double angle_of_max() const {
    return phi[static_cast<std::size_t>(std::max_element(dr.begin(), dr.end()) - dr.begin())] /
           kDegree;
  }
};

Circle circle(const std::vector<std::string>& assignments, double feed_mm_min,
              ProgramOptions::Direction direction = ProgramOptions::Direction::counter_clockwise) {
  std::vector<std::string> all{"setup.piece=" + configs("pieces/ring.toml")};
  all.insert(all.end(), assignments.begin(), assignments.end());
  const Machine machine = load_machine(configs("machines/trunnion.toml"), all);
  const auto piece = make_piece(*piece_params(machine));
  ProgramOptions options;
  options.feed_mm_min = feed_mm_min;
  options.direction = direction;
  options.laps = 3;
  const Outcome run = play(machine, circle_program(machine, piece.get(), options));
  EXPECT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  // The middle one of the full circles: entered and left at full feed.
  Circle c;
  double travelled = 0, previous = 0;
  bool inside = false;
  const double full = 2 * kPi;
  for (std::size_t i = 0; i < run.rows.size(); ++i) {
    const TelemetryRow& row = run.rows[i];
    const double angle = std::atan2(row.q_cmd[kY], row.q_cmd[kX]);
    const double radius = std::hypot(row.q_cmd[kX], row.q_cmd[kY]);
    if (std::abs(radius - 0.1) > 2.5e-6) {
      inside = false;
      continue;
    }
    if (!inside) {
      inside = true;
      travelled = 0;
    } else {
      travelled += std::abs(std::remainder(angle - previous, full));
    }
    previous = angle;
    if (travelled < full || travelled >= 2 * full) continue;
    c.phi.push_back(angle);
    // Inside a bore "away from the part" is towards the centre; what blending planned is left out.
    c.dr.push_back(run.errors[i].e_plan - run.errors[i].e_n);
  }
  return c;
}

const std::vector<std::string> kNoFeedForward{"axes.X.velocity_ff=0", "axes.X.acceleration_ff=0",
                                              "axes.Y.velocity_ff=0", "axes.Y.acceleration_ff=0"};

TEST(CircularTest, RadiusErrorWithoutFeedForwardIsHalfTheSquareOfTheLagOverR) {
  for (const double feed : {1500.0, 3000.0}) {
    const double v = feed / 60e3, expected = -std::pow(v / 40, 2) / (2 * 0.1);
    const Circle c = circle(kNoFeedForward, feed);
    EXPECT_NEAR(c.mean(), expected, 0.02 * std::abs(expected)) << feed;
  }
}

TEST(CircularTest, MismatchOfGainsDrawsAnEllipseThatTurnsWithTheDirection) {
  std::vector<std::string> a = kNoFeedForward;
  a.push_back("axes.Y.kv_per_s=38");
  const double expected = 0.05 * (1 / 38.0 - 1 / 40.0);  // 65.79 um
  const Circle ccw = circle(a, 3000);
  EXPECT_NEAR(ccw.peak_to_peak(), expected, 0.02 * expected);
  EXPECT_NEAR(std::abs(std::remainder(ccw.angle_of_max() - 135, 180)), 0, 3);
  const Circle cw = circle(a, 3000, ProgramOptions::Direction::clockwise);
  EXPECT_NEAR(cw.peak_to_peak(), expected, 0.02 * expected);
  EXPECT_NEAR(std::abs(std::remainder(cw.angle_of_max() - 45, 180)), 0, 3);
}

TEST(CircularTest, BacklashStepsWhereItsAxisReverses) {
  // Without friction the load would lie at the side its inertia pushes it to, not the one it is
  // dragged to.
  const Circle c = circle(
      {"axes.X.feedback=motor", "effects.X.backlash.gap_um=10", "effects.X.coulomb.level_N=100"},
      2000);
  const auto step = [&](double at) {
    return c.between(at + 1, at + 4) - c.between(at - 4, at - 1);
  };
  // X turns round at 0 and 180 degrees: the table is left behind by the gap, inwards before and
  // outwards after the reversal.
  EXPECT_NEAR(c.between(1, 4) - c.between(-4, -1), 10 * um, 0.5 * um);
  EXPECT_NEAR(c.between(-179, -176) - c.between(176, 179), 10 * um, 0.5 * um);
  EXPECT_NEAR(step(90), 0, 0.5 * um);
  EXPECT_NEAR(step(-90), 0, 0.5 * um);
}

TEST(WholeMachine, TheMeasuredMachineShowsItsErrorsWithinReason) {
  const Outcome run = s_piece("machines/trunnion_measured.toml", 2000);
  const ErrorGroup& lap = run.summary.groups.at(0);
  EXPECT_GT(lap.e_n.peak_to_peak(), 10 * um);
  EXPECT_LT(lap.e_n.peak_to_peak(), 100 * um);
  EXPECT_EQ(run.summary.coverage_percent, 100);
  EXPECT_GT(run.summary.following[kX].max, 10 * um);
}

TEST(WholeMachine, SeedAndScenarioDecideTheTrace) {
  const Machine machine = load_machine(configs("machines/trunnion_measured.toml"));
  const std::string program = "G90 G21\nM19\nG43.4 H1\nG1 X10 Y5 A3 C4 F3000\nM30\n";
  const std::string hash = play(machine, program, 7).nc.end.trace_hash;
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(play(machine, program, 7).nc.end.trace_hash, hash);
  EXPECT_NE(play(machine, program, 8).nc.end.trace_hash, hash) << "noise must depend on the seed";
}

/// The library costs an ideal machine nothing: no bit of any frame changes when every effect is
/// simulated at its null value.
TEST(WholeMachine, EffectsAtTheirNullValueDoNotChangeABit) {
  for (const char* file : {"machines/trunnion.toml", "machines/head.toml"}) {
    Machine machine = load_machine(configs(file));
    const std::string program =
        "G90 G21\nM19\nG43.4 H1\nG64 P0.01\nG1 X10 Y5 A3 C4 F3000\nG2 X20 Y5 I5 J0\nM30\n";
    const std::string hash = play(machine, program).nc.end.trace_hash;
    machine.effects.simulate_null = true;
    EXPECT_EQ(play(machine, program).nc.end.trace_hash, hash) << file;
  }
}

// ------------------------------------------------------------------------------ overtravel

/// Drives the ball along -x far into a plane at x = 100 mm; feed 0: at rapid.
Outcome crash(double feed_mm_min) {
  PieceParams plane;
  plane.kind = PieceParams::Kind::plane;
  plane.centre = {0.1, 0, 0};
  plane.direction = Vec3::UnitX();
  const TemporaryFile piece("plane.toml", to_toml(plane));
  Machine machine = load_machine(configs("machines/trunnion.toml"),
                                 {"setup.piece=" + piece.path(), "axes.X.start_mm=200"});
  const std::string approach =
      feed_mm_min > 0 ? "G1 X90 F" + std::to_string(feed_mm_min) : std::string("G0 X90");
  return play(machine, "G90 G21 G54\nM19\nG43 H1\nG0 X130 Y0 Z100\n" + approach + "\nM30\n");
}

TEST(Overtravel, StopsSoftlyRetractsLocksTheSpindleAndSaysSo) {
  const Outcome run = crash(1000);
  EXPECT_FALSE(run.nc.end.complete);
  EXPECT_TRUE(run.nc.alarmed);
  EXPECT_EQ(run.nc.exit_code(), 3) << run.nc.end.reason;
  ASSERT_FALSE(run.summary.alarms.empty());
  EXPECT_TRUE(std::any_of(run.summary.alarms.begin(), run.summary.alarms.end(),
                          [](const Alarm& a) { return a.code == 1003 || a.code == 1004; }));
  EXPECT_FALSE(std::any_of(run.summary.alarms.begin(), run.summary.alarms.end(),
                           [](const Alarm& a) { return a.code == 1001 || a.code == 1002; }))
      << "a soft stop was enough";
  EXPECT_EQ(run.rows.back().state, static_cast<double>(NcState::alarm));

  // At rest, off the piece, well before the 18 mm of the mechanism.
  const TelemetryRow& last = run.rows.back();
  EXPECT_NEAR(last.q_act[kX], run.rows[run.rows.size() - 50].q_act[kX], 1e-8);
  double deepest = 0;
  for (const TelemetryRow& row : run.rows) deepest = std::max(deepest, row.deflection[0]);
  EXPECT_GT(deepest, 2.0e-3);
  EXPECT_LT(deepest, 2.3e-3);
  EXPECT_NEAR(last.deflection[0], 0, 1e-6) << "retracted";
}

TEST(Overtravel, AFeedThatCouldNotStopInTimeIsRefusedBeforeAnythingMoves) {
  try {
    crash(30000);
    FAIL() << "accepted";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("too fast for the probe"), std::string::npos) << e.what();
  }
}

TEST(Overtravel, TheTripReachesTheDrivesWithinTwoCycles) {
  const Outcome run = crash(2000);
  Tick out_of_range = -1, braking = -1;
  for (std::size_t i = 1; i < run.rows.size(); ++i) {
    if (out_of_range < 0 && run.rows[i].deflection[0] > 2.0e-3) out_of_range = static_cast<Tick>(i);
    const double v = (run.rows[i].q_act[kX] - run.rows[i - 1].q_act[kX]) / kCycle;
    if (out_of_range > 0 && braking < 0 && std::abs(v) < 0.98 * 2000 / 60e3)
      braking = static_cast<Tick>(i);
  }
  ASSERT_GT(out_of_range, 0);
  // The sample is told in cycle k, judged in k+1, acted upon in k+2.
  EXPECT_LE(braking - out_of_range, 4);
}

TEST(Overtravel, ARapidCrashTripsToo) {
  // At rapid the ball moves faster than its periods can be counted: the reading is worthless, but
  // the machine must stop all the same. Sideways into the plane, and from above onto one.
  const Outcome lateral = crash(0);
  EXPECT_EQ(lateral.nc.exit_code(), 3) << lateral.nc.end.reason;
  EXPECT_GT(lateral.rows.back().q_act[kX], 0.09 + 1e-3) << "it must not reach the programmed end";

  PieceParams floor;
  floor.kind = PieceParams::Kind::plane;
  floor.centre = {0, 0, 0.08};
  const TemporaryFile piece("floor.toml", to_toml(floor));
  const Machine machine =
      load_machine(configs("machines/trunnion.toml"), {"setup.piece=" + piece.path()});
  const Outcome axial = play(machine, "G90 G21 G54\nM19\nG43 H1\nG0 X0 Y0 Z120\nG0 Z70\nM30\n");
  EXPECT_EQ(axial.nc.exit_code(), 3) << axial.nc.end.reason;
  EXPECT_GT(axial.rows.back().q_act[kZ], 0.07 + 0.05 + 0.15 + 1e-3);
}

TEST(Overtravel, TheNcUnitsOwnCheckStopsItWhenTheModuleIsBlind) {
  // The overtravel module sleeps when it is told that the probe is not in the spindle; here it is
  // given such a machine while everybody else knows better.
  PieceParams plane;
  plane.kind = PieceParams::Kind::plane;
  plane.centre = {0.1, 0, 0};
  plane.direction = Vec3::UnitX();
  const TemporaryFile piece_file("plane2.toml", to_toml(plane));
  const Machine machine = load_machine(configs("machines/trunnion.toml"),
                                       {"setup.piece=" + piece_file.path(), "axes.X.start_mm=200"});
  Machine blind = machine;
  blind.probe.in_spindle = false;
  VirtualMachine modules(machine, &plane, 1), blind_modules(blind, &plane, 1);
  std::vector<Node*> nodes = modules.nodes();
  nodes.back() = blind_modules.nodes().back();
  ASSERT_EQ(nodes.back()->id(), kOvertravelNode);
  InprocTransport transport(nodes);
  Keeper keeper;
  const TemporaryFile program("crash.ngc",
                              "G90 G21\nM19\nG43 H1\nG0 X130 Y0 Z100\nG1 X90 F1000\nM30\n");
  NcRunOptions options;
  options.program = program.path();
  options.piece_toml = to_toml(plane);
  const NcRunResult result = run_nc(machine, options, transport, keeper);
  EXPECT_TRUE(result.alarmed);
  EXPECT_NE(result.end.reason.find("1004"), std::string::npos) << result.end.reason;
}

}  // namespace
}  // namespace vcnc::whole_machine_test
