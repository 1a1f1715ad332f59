// Faults in simulated time while the probe is in contact: each ends in a safe state that names its
// cause, or is ridden through.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bus/run_node.hpp"
#include "servo_sim/spindle_node.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc::fault_test {
namespace {

PieceParams plane_piece() {
  PieceParams plane;
  plane.kind = PieceParams::Kind::plane;
  plane.centre = {0.1, 0, 0};
  plane.direction = Vec3::UnitX();
  return plane;
}

/// Keeps rows and alarms.
class Witness : public TelemetrySink {
 public:
  void begin(const RunBegin&) override {}
  void row(const TelemetryRow& row) override { rows.push_back(row); }
  void alarm(const Alarm& alarm) override { alarms.push_back(alarm); }
  void end(const RunEnd&) override {}
  bool has(int code, const std::string& text) const {
    return std::any_of(alarms.begin(), alarms.end(), [&](const Alarm& a) {
      return a.code == code && (a.source + ": " + a.text).find(text) != std::string::npos;
    });
  }
  std::string told() const {
    std::string all;
    for (const Alarm& a : alarms)
      all += a.source + ": " + std::to_string(a.code) + " " + a.text + "\n";
    return all;
  }
  std::vector<TelemetryRow> rows;
  std::vector<Alarm> alarms;
};

/// A run with faults, and the modules as it left them.
struct FaultedRun {
  Machine machine;
  PieceParams piece = plane_piece();
  std::unique_ptr<VirtualMachine> modules;
  Witness seen;
  NcRunResult result;

  FaultedRun(const std::string& program, const BusFaults& faults,
             const std::vector<std::string>& sets = {}) {
    const TemporaryFile piece_file("fault-plane.toml", to_toml(piece));
    std::vector<std::string> assignments{"setup.piece=" + piece_file.path(), "axes.X.start_mm=130",
                                         "axes.Z.start_mm=250"};
    assignments.insert(assignments.end(), sets.begin(), sets.end());
    machine = load_machine(configs("machines/trunnion.toml"), assignments);
    modules = std::make_unique<VirtualMachine>(machine, &piece, 1, faults);
    InprocTransport transport(modules->nodes());
    const TemporaryFile file("fault.ngc", program);
    NcRunOptions options;
    options.program = file.path();
    options.piece_toml = to_toml(piece);
    options.faults = faults;
    result = run_nc(machine, options, transport, seen);
  }

  bool spindle_locked() const {
    return dynamic_cast<const SpindleNode&>(modules->module(kSpindleNode)).locked();
  }
  /// Names of the drives that move or still obey.
  std::string moving() const {
    std::string names;
    for (int id = 1; id <= kSpindleNode; ++id)
      if (!modules->module(id).at_rest()) names += std::string(modules->module(id).name()) + " ";
    return names;
  }
};

/// Pushes the stylus 0.5 mm into the plane, then drags it along by 40 mm at 2 m/min. The spindle
/// holds its orientation all the time.
std::string scan() {
  const double surface_mm = (0.1 + Machine{}.probe.ball_radius) * 1e3;
  return "G90 G21 G54\nM19\nG43 H1\nG0 X" + std::to_string(surface_mm + 2) + " Y0 Z100\nG1 X" +
         std::to_string(surface_mm - 0.5) + " F1000\nG1 Y40 F2000\nM30\n";
}

/// The moment at which it is dragged at full feed, and that this is so.
Tick in_contact() {
  static const Tick moment = [] {
    const FaultedRun run(scan(), {});
    EXPECT_TRUE(run.result.end.complete) << run.result.end.reason << run.seen.told();
    EXPECT_TRUE(run.seen.alarms.empty()) << run.seen.told();
    Tick found = -1;
    for (std::size_t i = 0; i < run.seen.rows.size() && found < 0; ++i)
      if (run.seen.rows[i].q_act[kY] > 5e-3 && run.seen.rows[i].deflection[0] > 0.4e-3)
        found = static_cast<Tick>(i);
    EXPECT_GT(found, 0);
    const double v = (run.seen.rows[static_cast<std::size_t>(found)].q_act[kY] -
                      run.seen.rows[static_cast<std::size_t>(found) - 1].q_act[kY]) /
                     kCycle;
    EXPECT_NEAR(v, 2.0 / 60, 1e-4);
    return found;
  }();
  return moment;
}

BusFaults from_contact_on(const std::string& text) {
  BusFaults faults{parse_fault(text)};
  faults[0].from = in_contact();
  return faults;
}

struct Stopping {
  const char* fault;
  int code;          ///< of an alarm that must come
  const char* text;  ///< in it or its source: the cause
};

class StoppingFault : public testing::TestWithParam<Stopping> {};

TEST_P(StoppingFault, LeavesTheMachineSafeAndNamesTheCause) {
  const auto& [fault, code, text] = GetParam();
  const FaultedRun run(scan(), from_contact_on(fault));
  EXPECT_FALSE(run.result.end.complete);
  EXPECT_TRUE(run.result.alarmed);
  EXPECT_EQ(run.result.exit_code(), 3) << run.result.end.reason;
  EXPECT_TRUE(run.seen.has(code, text)) << run.seen.told();
  EXPECT_EQ(run.moving(), "") << run.seen.told();
  EXPECT_TRUE(run.spindle_locked()) << run.seen.told();

  // Three cycles without a message, one for the alarm on the bus, one for the reaction; braking
  // from 33 mm/s with 5 m/s^2 takes 7 more. Corrupted frames may look right for some cycles.
  const auto stopped = static_cast<std::size_t>(in_contact() + 40);
  ASSERT_GT(run.seen.rows.size(), stopped + 1);
  const bool y_is_seen = std::string(fault).find("drive Y") == std::string::npos &&
                         std::string(fault).find("bus ") == std::string::npos &&
                         std::string(fault).find("NC unit") == std::string::npos;
  for (std::size_t i = stopped; y_is_seen && i < run.seen.rows.size(); ++i)
    ASSERT_NEAR(run.seen.rows[i].q_act[kY], run.seen.rows[stopped].q_act[kY], 10e-6) << i;
  // One alarm came soon.
  const auto first = run.seen.alarms.front().tick;
  EXPECT_GE(first, in_contact());
  EXPECT_LE(first, in_contact() + 20) << run.seen.told();
}

INSTANTIATE_TEST_SUITE_P(
    DuringContact, StoppingFault,
    testing::Values(
        Stopping{"drive Y mute", 3202, "drive Y"}, Stopping{"drive Y silent", 3202, "drive Y"},
        Stopping{"drive Y deaf", 2103, "drive Y"}, Stopping{"drive X lose_sync", 3202, "drive X"},
        Stopping{"drive C mute", 3202, "drive C"},
        Stopping{"drive spindle mute", 3202, "drive spindle"},
        Stopping{"drive spindle deaf", 2104, "drive spindle"},
        Stopping{"drive spindle drop id=0x188", 2104, "drive spindle"},
        Stopping{"drive spindle drop id=0x200", 2103, "drive spindle"},
        Stopping{"probe mute", 3202, "probe"}, Stopping{"probe silent", 3202, "probe"},
        Stopping{"probe drop id=0x187", 3202, "probe"}, Stopping{"probe lose_sync", 3202, "probe"},
        Stopping{"probe delay cycles=3", 3202, "probe"},
        Stopping{"overtravel mute", 3202, "overtravel"},
        Stopping{"overtravel mute", 2104, "drive X"},
        Stopping{"overtravel deaf", 1001, "fallen silent"},
        Stopping{"overtravel drop id=0x187", 1001, "fallen silent"},
        Stopping{"overtravel drop id=0x188", 3202, "overtravel"},
        Stopping{"overtravel delay cycles=5", 3202, "overtravel"},
        Stopping{"drive Z drop id=0x188", 2104, "drive Z"},
        Stopping{"drive Z drop id=0x200", 2103, "drive Z"},
        Stopping{"bus stuck", 3202, "the bus itself"},
        Stopping{"bus lose_sync", 3202, "the bus itself"},
        Stopping{"bus drop id=0x200", 2103, "drive X"},
        // the sign of X's velocity, which is 0: not a number any more
        Stopping{"bus corrupt id=0x200 bit=111", 2103, "drive Y"},
        Stopping{"NC unit mute", 3202, "the bus itself"},
        Stopping{"NC unit silent", 3202, "the bus itself"},
        Stopping{"NC unit deaf", 3202, "the bus itself"},
        Stopping{"bus corrupt id=0x187", 1002, "NC unit"},
        Stopping{"overtravel corrupt", 3202, "overtravel"},
        Stopping{"drive Y corrupt bit=16", 2001, "drive Y"},
        Stopping{"drive X babble", 3103, "identifier 07Fh"},
        Stopping{"drive X encoder_jump um=25000", 2101, "drive X"},
        Stopping{"drive C fault", 2105, "drive C"},
        Stopping{"probe wire_break", 1002, "signals are faulty"},
        Stopping{"probe wire_break channel=z", 1002, "signals are faulty"},
        Stopping{"probe saturated channel=y", 1002, "signals are faulty"},
        Stopping{"probe stuck_adc", 1002, "signals are faulty"},
        Stopping{"probe stuck_adc channel=y", 1002, "signals are faulty"},
        Stopping{"probe slip periods=6", 1002, "jumped too far"},
        Stopping{"probe slip channel=z periods=-50", 1002, "jumped too far"}),
    [](const auto& test) {
      std::string name = std::to_string(test.param.code) + "_" + test.param.fault;
      for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
      return name;
    });

class RiddenThrough : public testing::TestWithParam<const char*> {};

/// What a machine must bear: it plays to the end, and what was disturbed has been told.
TEST_P(RiddenThrough, DoesNotStopTheMachine) {
  const FaultedRun run(scan(), from_contact_on(GetParam()));
  EXPECT_TRUE(run.result.end.complete) << run.result.end.reason << run.seen.told();
  const auto is = [](const char* word) {
    return std::string(GetParam()).find(word) != std::string::npos;
  };
  const bool told = is("duplicate") || is("babble") || is("lose_sync") || is("mute");
  EXPECT_EQ(run.seen.has(3101, ""), told) << run.seen.told();
}

INSTANTIATE_TEST_SUITE_P(DuringContact, RiddenThrough,
                         testing::Values("probe mute for_s=0.002", "drive Y duplicate",
                                         "NC unit duplicate for_s=0.05",
                                         "drive X lose_sync for_s=0.002",
                                         "overtravel delay cycles=1", "drive Z babble frames=1",
                                         "probe deaf", "probe slip periods=4"));

/// What stopped the machine is what the drive has said, not that it left operation afterwards.
TEST(Faults, TheReasonIsTheCauseThatTheDriveHasSent) {
  for (const auto& [fault, reason] : {std::pair{"drive C fault", "alarm 2105: "},
                                      {"drive X encoder_jump um=25000", "alarm 2101: "}}) {
    const FaultedRun run(scan(), from_contact_on(fault));
    EXPECT_TRUE(run.result.end.reason.starts_with(reason)) << run.result.end.reason;
    EXPECT_NE(run.result.end.reason.find("(program line "), std::string::npos);
    EXPECT_TRUE(run.seen.has(2001, "")) << "and that it left operation is told, too";
  }
}

TEST(Faults, AMuteOfThreeCyclesIsOneTooMany) {
  const FaultedRun run(scan(), from_contact_on("probe mute for_s=0.003"));
  EXPECT_TRUE(run.seen.has(3202, "probe")) << run.seen.told();
  EXPECT_EQ(run.seen.alarms.front().tick, in_contact() + 2) << "in the third cycle without it";
}

/// Miscounted from the beginning on, nothing jumps: the trip comes where the reading leaves the
/// range.
TEST(Faults, AWrongCountFromTheBeginningShiftsTheTripByItself) {
  const std::string crash = "G90 G21 G54\nM19\nG43 H1\nG0 X120 Y0 Z100\nG1 X60 F1000\nM30\n";
  const auto deepest = [&](const BusFaults& faults) {
    const FaultedRun run(crash, faults);
    EXPECT_EQ(run.result.exit_code(), 3) << run.result.end.reason;
    EXPECT_TRUE(run.seen.has(1004, "")) << run.seen.told();
    EXPECT_TRUE(run.spindle_locked());
    double most = 0;
    for (const TelemetryRow& row : run.seen.rows)
      most = std::max(most, 0.1 + run.machine.probe.ball_radius - row.q_act[kX]);
    return most;
  };
  // 75 periods of 20 um; a cycle of 16.7 um more or less for the sample that shows it.
  EXPECT_NEAR(deepest({parse_fault("probe slip periods=-75")}) - deepest({}), 1.5e-3, 20e-6);
}

/// With thresholds that a wrong machine file has made far too wide and a reading that is 1.5 mm
/// short, the probe's own protection unit is left: a mechanical switch that feels the true force.
TEST(Faults, TheMechanicalSwitchNeedsNoReading) {
  const std::string crash = "G90 G21 G54\nM19\nG43 H1\nG0 X120 Y0 Z100\nG0 X60\nM30\n";
  const FaultedRun run(crash, {parse_fault("probe slip periods=-75")},
                       {"probe.range_mm=1.6", "probe.overtravel_lateral_mm=3",
                        "probe.overtravel_force_lateral_N=60", "axes.X.velocity_mm_s=15"});
  EXPECT_EQ(run.result.exit_code(), 3) << run.result.end.reason;
  EXPECT_TRUE(run.seen.has(1002, "protection unit has switched")) << run.seen.told();
  EXPECT_EQ(run.moving(), "");
  EXPECT_TRUE(run.spindle_locked());
  double deepest = 0;
  for (const TelemetryRow& row : run.seen.rows)
    deepest = std::max(deepest, 0.1 + run.machine.probe.ball_radius - row.q_act[kX]);
  const double limit =
      std::min(run.machine.probe.overtravel_lateral,
               run.machine.probe.overtravel_force_lateral / run.machine.probe.spring_rate);
  // Sample, judgement, quick stop and half a cycle each side: 4 cycles at 15 mm/s, and braking.
  EXPECT_GT(deepest, limit - 1e-5);
  EXPECT_LT(deepest, limit + 0.2e-3);
}

/// Faults of all kinds, nodes, moments and durations: the program ends as it should, or the machine
/// stands with the spindle locked and an alarm; drives that are still in operation after a soft
/// stop stand too.
TEST(Faults, AtRandomEndSafely) {
  std::mt19937_64 random(2024);
  const auto pick = [&](const auto& list) { return list[random() % std::size(list)]; };
  const std::string nodes[] = {"drive X", "drive Y",       "drive Z", "drive A",    "drive C",
                               "probe",   "drive spindle", "bus",     "overtravel", "NC unit"};
  const std::string kinds[] = {"mute",          "silent",           "deaf",
                               "corrupt",       "drop id=0x200",    "drop id=0x187",
                               "drop id=0x188", "delay cycles=2",   "delay id=0x200 cycles=4",
                               "duplicate",     "corrupt id=0x200", "corrupt id=0x188"};
  const Tick durations[] = {0, 1, 2, 3, 5, 20};
  int stopped = 0, ended = 0;
  for (int i = 0; i < 60; ++i) {
    BusFaults faults;
    std::string all;
    for (std::uint64_t n = 1 + random() % 2; n > 0; --n) {
      BusFault fault = parse_fault(pick(nodes) + " " + pick(kinds));
      fault.from = static_cast<Tick>(random() % static_cast<std::uint64_t>(in_contact() + 800));
      fault.cycles = pick(durations);
      all += fault.text + " from " + std::to_string(fault.from) + " for " +
             std::to_string(fault.cycles) + "; ";
      faults.push_back(fault);
    }
    FaultedRun run(scan(), faults);
    ++(run.result.end.complete ? ended : stopped);
    EXPECT_NE(run.result.end.complete, run.result.alarmed) << all << run.seen.told();
    if (!run.result.alarmed) continue;
    EXPECT_TRUE(run.spindle_locked()) << all << run.seen.told();
    const std::vector<Node*> modules = run.modules->nodes();
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      const RunDown alone = run_down(*modules[axis], static_cast<Tick>(run.seen.rows.size()));
      EXPECT_TRUE(alone.at_rest) << all;
      EXPECT_LE(alone.cycles, 50) << all << modules[axis]->name() << "\n" << run.seen.told();
    }
  }
  EXPECT_GT(stopped, 15);
  EXPECT_GT(ended, 5);
}

TEST(Faults, NoProgramStartsWithoutAModule) {
  for (const char* fault : {"overtravel silent", "probe mute", "drive A silent"}) {
    const FaultedRun run(scan(), {parse_fault(fault)});
    EXPECT_EQ(run.result.exit_code(), 3) << fault;
    EXPECT_TRUE(run.seen.has(3202, std::string(fault).substr(0, std::string(fault).rfind(' '))))
        << run.seen.told();
    for (const TelemetryRow& row : run.seen.rows)
      ASSERT_NEAR(row.q_act[kX], 0.13, 1e-9) << "nothing may move";
  }
}

TEST(Faults, FaultsAreInTheHashAndRepeat) {
  const auto hash = [](const BusFaults& faults) {
    return FaultedRun(scan(), faults).result.end.trace_hash;
  };
  const BusFaults mute = from_contact_on("probe mute for_s=0.002");
  EXPECT_EQ(hash(mute), hash(mute));
  EXPECT_NE(hash(mute), hash({}));
  EXPECT_EQ(hash({parse_fault("bus stuck from_s=1000")}), hash({}));
}

/// A module whose program dies, in one process: it gives no answer from some cycle on.
class DeadModules : public Transport {
 public:
  DeadModules(Transport& bus, int node, Tick from) : bus_(bus), node_(node), from_(from) {}
  void send(std::span<const Frame> slot) override {
    for (const Frame& frame : slot)
      if (frame.id == kSyncId) ++cycle_;
    bus_.send(slot);
  }
  Received receive(Frames& into, int timeout_ms) override {
    const std::size_t known = into.size();
    const Received received = bus_.receive(into, timeout_ms);
    if (cycle_ >= from_)
      into.erase(std::remove_if(into.begin() + static_cast<std::ptrdiff_t>(known), into.end(),
                                [&](const Frame& f) { return f.id == kStatusBase + node_; }),
                 into.end());
    return into.size() > known            ? Received::frames
           : received == Received::closed ? received
                                          : Received::timeout;
  }

 private:
  Transport& bus_;
  int node_;
  Tick from_;
  Tick cycle_ = -1;
};

TEST(Faults, ALostModuleMeansAQuickStopOfTheOthersAndAFailedRun) {
  for (int node = 1; node <= kOvertravelNode; ++node) {
    const Machine machine = load_machine(configs("machines/trunnion.toml"),
                                         {"axes.X.start_mm=130", "axes.Z.start_mm=250"});
    const PieceParams piece = plane_piece();
    VirtualMachine modules(machine, &piece, 1);
    InprocTransport inner(modules.nodes());
    DeadModules transport(inner, node, in_contact());
    Witness seen;
    const TemporaryFile file("lost.ngc", scan());
    NcRunOptions options;
    options.program = file.path();
    const NcRunResult result = run_nc(machine, options, transport, seen);
    const std::string name(modules.module(node).name());
    EXPECT_EQ(result.exit_code(), 1) << name;
    EXPECT_FALSE(result.end.complete);
    EXPECT_TRUE(seen.has(3201, name)) << seen.told();
    EXPECT_EQ(result.end.reason, "no answer within 5000 ms in cycle " +
                                     std::to_string(in_contact()) + " from: " + name);
    for (int id = 1; id <= kSpindleNode; ++id)
      EXPECT_TRUE(modules.module(id).at_rest()) << name << id;
    EXPECT_TRUE(dynamic_cast<const SpindleNode&>(modules.module(kSpindleNode)).locked()) << name;
    EXPECT_LT(static_cast<Tick>(seen.rows.size()), in_contact() + 600);
  }
}

}  // namespace
}  // namespace vcnc::fault_test
