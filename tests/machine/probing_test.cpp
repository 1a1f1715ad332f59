// Probing on the whole machine: where a probing move ends, what the program is told, and that it
// goes on from there. The surfaces are known in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/machine/harness.hpp"
#include "tests/machine/memory_slots.hpp"

namespace vcnc::probing_test {
namespace {

constexpr double kBall = 3e-3;       ///< radius of the ball of the machine files
constexpr double kReading = 0.5e-6;  ///< what encoders and probe of the ideal machine read apart

/// A wall or a ring at a place of its own, the axes near it.
struct Place {
  explicit Place(const PieceParams& params) : piece("probed.toml", to_toml(params)) {}
  Machine machine(std::vector<std::string> set = {}) const {
    set.insert(set.begin(),
               {"setup.piece=" + piece.path(), "axes.X.start_mm=60", "axes.Z.start_mm=250"});
    return load_machine(configs("machines/trunnion.toml"), set);
  }
  TemporaryFile piece;
};

PieceParams wall(const Vec3& normal, double distance) {
  PieceParams plane;
  plane.kind = PieceParams::Kind::plane;
  plane.centre = distance * normal.normalized();
  plane.direction = normal.normalized();
  return plane;
}

PieceParams bore(const Vec3& centre, double radius) {
  PieceParams ring;
  ring.kind = PieceParams::Kind::ring;
  ring.bore = true;
  ring.centre = centre;
  ring.direction = Vec3::UnitZ();
  ring.radius = radius;
  ring.height = 40e-3;
  return ring;
}

std::vector<int> codes(const Outcome& run) {
  std::vector<int> all;
  for (const Alarm& alarm : run.summary.alarms) all.push_back(alarm.code);
  return all;
}

/// Where the axes were told to stand at the end of a line.
AxisVector end_of(const Outcome& run, int line) {
  AxisVector q{};
  for (const TelemetryRow& row : run.rows)
    if (row.line == line) q = row.q_cmd;
  return q;
}

double largest_deflection(const Outcome& run) {
  double most = 0;
  for (const TelemetryRow& row : run.rows)
    most = std::max(most, Vec3(row.deflection.data()).norm());
  return most;
}

TEST(Probing, FindsAWallAtItsBallRadius) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Machine machine = place.machine();
  for (const double feed : {100., 600., 1500.}) {
    const Outcome run =
        play(machine, "G21 G90 G54 G61\nG0 X30\nF" + std::to_string(feed) +
                          "\nG38.2 X15\n#1=#5061\nG1 X[#1+1]\nG4 P0.01\nG1 X30\nM30\n");
    ASSERT_TRUE(run.nc.end.complete) << feed << run.nc.end.reason;
    EXPECT_NEAR(end_of(run, 6)[kX] - 1e-3, 20e-3 + kBall, kReading) << feed;
    // Braked behind the trigger: reaction of four cycles, and way of braking within the limits.
    const double v = feed / 60e3, beyond = 20e-3 + kBall - end_of(run, 4)[kX];
    const double brake = 0.5 * v * (10e-3 + 6 * std::sqrt(v / machine.axes[kX].limits.jerk));
    EXPECT_GT(beyond, TouchTrigger(machine.probe).on()) << feed;
    EXPECT_LT(beyond, TouchTrigger(machine.probe).on() + 10e-3 * v + brake) << feed;
  }
}

TEST(Probing, ASlantedWallIsFoundWhereItIsMet) {
  const double angle = 30 * kDegree;
  const Place place(wall({std::cos(angle), std::sin(angle), 0}, 20e-3));
  const Outcome run = play(
      place.machine(), "G61 G54 G0 X40\nG38.2 X15 F400\nG1 X[#5061+1]\nG4 P0.01\nG1 X50\nM30\n");
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  // n . p = d + r on the way y = 0
  EXPECT_NEAR(end_of(run, 3)[kX] - 1e-3, (20e-3 + kBall) / std::cos(angle), kReading);
}

TEST(Probing, ABoreIsCentredByFourTouches) {
  const Vec3 centre(0.7e-3, -0.4e-3, 0);
  const Place place(bore(centre, 30e-3));
  const std::string program =
      "G21 G90 G94 G17 G54 G43 H1 G0 Z100\n"
      "G0 X0 Y0\nG0 Z0\nF900\n"
      "G38.2 X40\n#1=#5061\nG0 X0\n"
      "G38.2 X-40\n#2=#5061\nG0 X[[#1+#2]/2]\n"
      "G38.2 Y40\n#3=#5062\nG0 Y0\n"
      "G38.2 Y-40\n#4=#5062\nG0 Y[[#3+#4]/2]\n"
      "G38.2 X40\n#5=#5061\nG0 X0\n"
      "G10 L2 P1 X[#5221+[#1+#2]/2] Y[#5222+[#3+#4]/2]\n"
      "G0 X0 Y0\nG4 P0.01\n"
      "G0 X[#5-[#1+#2]/2]\nG4 P0.01\nG0 X0\nM30\n";
  const Outcome run = play(place.machine(), program);
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  EXPECT_NEAR(end_of(run, 21)[kX], centre.x(), kReading);
  EXPECT_NEAR(end_of(run, 21)[kY], centre.y(), kReading);
  EXPECT_NEAR(end_of(run, 23)[kX] - end_of(run, 21)[kX], 30e-3 - kBall, kReading) << "the radius";
}

TEST(Probing, LetsGoWhereTheWallEnds) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Outcome run = play(place.machine(),
                           "G61 G54 G0 X30\nF300\nG38.2 X15\nG38.4 X30\n#1=#5061 #2=#5070\n"
                           "G1 X[#1+1] F600\nG1 Y[#2]\nM30\n");
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  EXPECT_NEAR(end_of(run, 6)[kX] - 1e-3, 20e-3 + kBall, kReading);
  EXPECT_LT(end_of(run, 4)[kX], 24e-3) << "not to its end";
  EXPECT_DOUBLE_EQ(end_of(run, 7)[kY], 1e-3);
}

TEST(Probing, WithoutContactItIsAnAlarmOrGoesOn) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Machine machine = place.machine();
  const Outcome must = play(machine, "G61 G54 G0 X30\nG38.2 X24 F300\nG1 X40\nM30\n");
  EXPECT_EQ(codes(must), std::vector<int>{5002});
  EXPECT_EQ(must.nc.exit_code(), 3);
  EXPECT_NEAR(must.rows.back().q_cmd[kX], 24e-3, 1e-12) << "stands there";
  EXPECT_NE(must.nc.end.reason.find("(program line 2)"), std::string::npos) << must.nc.end.reason;
  for (const char* word : {"G38.3", "G31"}) {
    const Outcome may = play(machine, std::string("G61 G54 G0 X30\n") + word +
                                          " X24 F300\n#1=#5061 #2=#5070\nG1 X[#1+1]\n"
                                          "G1 Y[#2+1]\nM30\n");
    ASSERT_TRUE(may.nc.end.complete) << may.nc.end.reason;
    EXPECT_NEAR(end_of(may, 4)[kX], 25e-3, 1e-9);
    EXPECT_NEAR(end_of(may, 5)[kY], 1e-3, 1e-9) << "#5070 is 0";
  }
}

/// The wall is met in the last cycles only, when the set-point has arrived already.
TEST(Probing, AReadingThatComesAfterTheEndCounts) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const double on = TouchTrigger(place.machine().probe).on();
  const double end = (20e-3 + kBall - on) * 1e3 - 0.002;
  const Outcome run = play(place.machine(), "G61 G54 G0 X30\nG38.2 X" + std::to_string(end) +
                                                " F300\nG1 X[#5061+1]\nM30\n");
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  EXPECT_NEAR(end_of(run, 3)[kX] - 1e-3, 20e-3 + kBall, kReading);
}

TEST(Probing, WhatItLooksForMustNotBeThereAlready) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Machine machine = place.machine();
  const Outcome touching =
      play(machine, "G61 G54 G0 X30\nG1 X22.5 F300\nG38.3 X22 F300\nG0 X30\nM30\n");
  EXPECT_EQ(codes(touching), std::vector<int>{5003});
  EXPECT_NEAR(end_of(touching, 3)[kX], 22.5e-3, 1.1e-3 + 0.5e-3) << "and is taken off";
  EXPECT_GT(touching.rows.back().q_cmd[kX], 23e-3);
  EXPECT_EQ(codes(play(machine, "G61 G54 G0 X30\nG38.5 X40 F300\nM30\n")), std::vector<int>{5003});
}

/// The protection acts as it did.
TEST(Probing, TooFastRunsIntoTheProtection) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Outcome run = play(place.machine(), "G61 G54 G0 X60\nG38.2 X15 F3000\nG0 X30\nM30\n");
  EXPECT_GT(largest_deflection(run), 2e-3);
  ASSERT_FALSE(codes(run).empty());
  EXPECT_TRUE(codes(run)[0] == 1003 || codes(run)[0] == 1004) << codes(run)[0];
}

/// What has been found makes other moves than were checked: they are checked when they are read.
TEST(Probing, MovesThatFollowAreCheckedAgain) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Outcome run = play(place.machine(),
                           "G61 G54 G0 X30\nG38.2 X15 F300\nG1 Z[[#5061-15]*100+100] F3000\nM30\n");
  EXPECT_EQ(codes(run), std::vector<int>{5001});
  EXPECT_NE(run.nc.end.reason.find(":3:1: Z would reach"), std::string::npos) << run.nc.end.reason;
}

TEST(Probing, TheLimitsOfTheAxesAreKept) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Machine machine = place.machine();
  const Outcome run = play(machine, "G61 G54 G0 X30\nG38.2 X15 F1800\nG0 X30\nM30\n");
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  const AxisLimits& limits = machine.axes[kX].limits;
  double a = 0, j = 0;
  for (std::size_t k = 3; k < run.rows.size(); ++k) {
    const auto x = [&](std::size_t back) { return run.rows[k - back].q_cmd[kX]; };
    a = std::max(a, std::abs(x(0) - 2 * x(1) + x(2)) / (kCycle * kCycle));
    j = std::max(j, std::abs(x(0) - 3 * x(1) + 3 * x(2) - x(3)) / (kCycle * kCycle * kCycle));
  }
  EXPECT_LT(a, 1.001 * limits.acceleration);
  EXPECT_LT(j, 1.05 * limits.jerk);
  EXPECT_GT(j, 0.3 * limits.jerk) << "and used";
}

TEST(Probing, UnderRtcpAndInInches) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Outcome run = play(place.machine(),
                           "G61 G54 G0 X30\nG43.4 H1\nG38.2 X15 F300\nG20\n#1=#5061\nG21\n"
                           "G1 X[#1*25.4+1]\nG49\nM30\n");
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  EXPECT_NEAR(end_of(run, 7)[kX] - 1e-3, 20e-3 + kBall, kReading);
}

// ------------------------------------------------------------------------------ going on later

struct Memories {
  SlotsInMemory nc, data, spindle, overtravel;
};

struct HowToRun {
  std::vector<std::string> faults{};
  std::vector<std::string> operations{};
  bool resume = false;
  int from_line = 0;
  OnPowerReturn on_return = OnPowerReturn::end;
};

Outcome run_with(Memories& memories, const Machine& machine, const std::string& program,
                 const HowToRun& how) {
  const TemporaryFile file("kept.ngc", program);
  const auto piece = piece_params(machine);
  BusFaults faults;
  for (const std::string& text : how.faults) faults.push_back(parse_fault(text));
  std::vector<double> at;
  if (how.resume) {
    const AxisVector q =
        position_at_switch_on(as_nc_believes(machine), decode_record(memories.nc.load()).value());
    at.assign(q.begin(), q.end());
  }
  VirtualMachine modules(switched_on_at(machine, at), piece.get(), 1, faults,
                         {&memories.spindle, &memories.overtravel});
  InprocTransport transport(modules.nodes());
  Keeper keeper;
  NcRunOptions options;
  options.program = file.path();
  options.piece_toml = piece ? to_toml(*piece) : "";
  options.faults = faults;
  options.memory = &memories.nc;
  options.data = &memories.data;
  options.resume = how.resume;
  options.on_power_return = how.on_return;
  options.player.from_line = how.from_line;
  for (const std::string& text : how.operations)
    options.operations.push_back(parse_operation(text));
  keeper.outcome.nc = run_nc(machine, options, transport, keeper);
  return std::move(keeper.outcome);
}

const char* const kTwoTouches =
    "G61 G54 G0 X30\nG38.2 X15 F900\n#1=#5061\nG0 X30\nG0 Y20\nG38.2 X15 F600\n"
    "#2=#5061\nG1 X[#2+1]\nG4 P0.1\nG0 X[30+#1]\nG4 P0.05\nM30\n";

/// Wherever the mains fail - before, in, at the end of a probing move, or later - the program ends
/// where it would have.
TEST(Probing, AProgramThatIsResumedKnowsWhatItHasFound) {
  const Place place(wall({1, 0.05, 0}, 20e-3));
  const Machine machine = place.machine();
  Memories unused;
  const Outcome whole = run_with(unused, machine, kTwoTouches, {});
  ASSERT_TRUE(whole.nc.end.complete) << whole.nc.end.reason;
  const double last = end_of(whole, 10)[kX], after = end_of(whole, 8)[kX];
  const double total = seconds(static_cast<Tick>(whole.rows.size()));
  for (int i = 1; i < 12; ++i) {
    const double at = total * i / 12;
    Memories memories;
    const Outcome first =
        run_with(memories, machine, kTwoTouches,
                 {.faults = {"supply power_loss from_s=" + std::to_string(at) + " for_s=0.5"}});
    ASSERT_EQ(first.nc.exit_code(), 3) << i << first.nc.end.reason;
    const Outcome rest = run_with(memories, machine, kTwoTouches, {.resume = true});
    ASSERT_TRUE(rest.nc.end.complete) << i << ": " << rest.nc.end.reason;
    EXPECT_NEAR(end_of(rest, 10)[kX], last, kReading) << i;
    if (end_of(rest, 8)[kX] != 0) {
      EXPECT_NEAR(end_of(rest, 8)[kX], after, kReading) << i;
    }
  }
}

TEST(Probing, AProgramBegunBehindItsTouchesKnowsThem) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Machine machine = place.machine();
  Memories memories;
  try {
    run_with(memories, machine, kTwoTouches, {.from_line = 8});
    FAIL() << "nothing is known of the touches";
  } catch (const ProgramError& error) {
    EXPECT_NE(std::string(error.what()).find("line 2 probes, and what it has found is not known"),
              std::string::npos)
        << error.what();
  }
  const Outcome whole = run_with(memories, machine, kTwoTouches, {});
  ASSERT_TRUE(whole.nc.end.complete);
  const Outcome rest = run_with(memories, machine, kTwoTouches, {.from_line = 8});
  ASSERT_TRUE(rest.nc.end.complete) << rest.nc.end.reason;
  EXPECT_EQ(end_of(rest, 9)[kX], end_of(whole, 9)[kX]) << "to the bit";
  EXPECT_EQ(end_of(rest, 11)[kX], end_of(whole, 11)[kX]);
  // The first touch is known, the second one is made anew.
  const Outcome second = run_with(memories, machine, kTwoTouches, {.from_line = 4});
  ASSERT_TRUE(second.nc.end.complete) << second.nc.end.reason;
  EXPECT_NEAR(end_of(second, 9)[kX], end_of(whole, 9)[kX], kReading);
  EXPECT_EQ(end_of(second, 11)[kX], end_of(whole, 11)[kX]);
}

/// A feed hold before and while the ball touches, single block: the same contact.
TEST(Probing, TheOperatorMayHoldIt) {
  const Place place(wall(Vec3::UnitX(), 20e-3));
  const Machine machine = place.machine();
  for (const double at : {0.9, 1.05, 1.08, 1.1, 1.12, 1.15, 1.3}) {
    Memories memories;
    const Outcome run = run_with(
        memories, machine, kTwoTouches,
        {.operations = {"at " + std::to_string(at) + " s hold", "at 3 s start", "at 5 s start"}});
    ASSERT_TRUE(run.nc.end.complete) << at << run.nc.end.reason;
    EXPECT_NEAR(end_of(run, 9)[kX] - 1e-3, 20e-3 + kBall, kReading) << at;
  }
  Memories memories;
  const Outcome single =
      run_with(memories, machine, kTwoTouches, {.operations = {"at 0.3 s single on"}});
  ASSERT_TRUE(single.nc.end.complete) << single.nc.end.reason;
  EXPECT_NEAR(end_of(single, 9)[kX] - 1e-3, 20e-3 + kBall, kReading);
}

/// The example: a ring gauge that stands beside the origin.
TEST(Probing, TheExampleFindsTheBore) {
  const Vec3 centre(0.6e-3, 0.35e-3, 0);
  const Place place(bore(centre, 102.5e-3));
  std::ifstream in(configs("programs/probe_bore.ngc"));
  const std::string program(std::istreambuf_iterator<char>(in), {});
  Memories memories;
  const Machine machine =
      load_machine(configs("machines/trunnion.toml"), {"setup.piece=" + place.piece.path()});
  const Outcome run = run_with(memories, machine, program, {});
  ASSERT_TRUE(run.nc.end.complete) << run.nc.end.reason;
  const auto kept = decode_nc_data(memories.data.load());
  ASSERT_TRUE(kept);
  EXPECT_NEAR(kept->now.parameters.at(5221), centre.x(), kReading);
  EXPECT_NEAR(kept->now.parameters.at(5222), centre.y(), kReading);
  EXPECT_NEAR(kept->now.parameters.at(100) * 1e-3, 102.5e-3, kReading);
  EXPECT_EQ(kept->touches.size(), 4u);
}

}  // namespace
}  // namespace vcnc::probing_test
