// Loss of the mains on the whole machine: what is done in which order, what is kept, and that a
// program which goes on - in the same run or after switching on again - is the same program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "controller/program_writer.hpp"
#include "probe_sim/overtravel_node.hpp"
#include "servo_sim/spindle_node.hpp"
#include "tests/machine/harness.hpp"
#include "tests/machine/memory_slots.hpp"

namespace vcnc::power_test {
namespace {

/// What a machine keeps while it is off.
struct Memories {
  SlotsInMemory nc, spindle, overtravel;

  NcRecord record() {
    const auto record = decode_record(nc.load());
    if (!record) throw std::logic_error("the memory holds no record");
    return *record;
  }
  std::vector<RunStage> stages() const {
    std::vector<RunStage> stages;
    for (const auto& bytes : nc.saved) {
      const RunStage stage = decode_record(bytes).value().stage;
      if (stages.empty() || stages.back() != stage) stages.push_back(stage);
    }
    return stages;
  }
};

struct PowerOptions {
  std::vector<std::string> faults{};
  OnPowerReturn on_return = OnPowerReturn::end;
  bool resume = false;
  Memories* memories = nullptr;
};

Outcome run_on(const Machine& machine, const std::string& program, const PowerOptions& o) {
  const TemporaryFile file("power.ngc", program);
  const auto piece = piece_params(machine);
  BusFaults faults;
  for (const std::string& text : o.faults) faults.push_back(parse_fault(text));
  std::vector<double> at;
  if (o.resume) {
    const AxisVector q = position_at_switch_on(as_nc_believes(machine), o.memories->record());
    at.assign(q.begin(), q.end());
  }
  ModuleMemories memories;
  if (o.memories) memories = {&o.memories->spindle, &o.memories->overtravel};
  VirtualMachine modules(switched_on_at(machine, at), piece.get(), 1, faults, memories);
  InprocTransport transport(modules.nodes());
  Keeper keeper;
  NcRunOptions options;
  options.program = file.path();
  options.piece_toml = piece ? to_toml(*piece) : "";
  options.faults = faults;
  options.memory = o.memories ? &o.memories->nc : nullptr;
  options.on_power_return = o.on_return;
  options.resume = o.resume;
  keeper.outcome.nc = run_nc(machine, options, transport, keeper);
  return std::move(keeper.outcome);
}

std::vector<int> codes(const Outcome& run) {
  std::vector<int> all;
  for (const Alarm& alarm : run.summary.alarms) all.push_back(alarm.code);
  return all;
}

std::string told(const Outcome& run) {
  std::string all;
  for (const Alarm& a : run.summary.alarms)
    all += std::to_string(a.tick) + " " + std::to_string(a.code) + " " + a.text + "\n";
  return all + run.nc.end.reason + "\n";
}

std::string loss(double from_s, double for_s) {
  return "supply power_loss from_s=" + std::to_string(from_s) + " for_s=" + std::to_string(for_s);
}

/// The lap around the S piece, and the run that nothing interrupts.
struct Lap {
  Machine machine;
  std::string program;
  Outcome whole;

  explicit Lap(const std::string& name) : machine(load_machine(configs("machines/" + name))) {
    const auto piece = make_piece(*piece_params(machine));
    ProgramOptions options;
    options.feed_mm_min = 3000;
    program = s_piece_program(machine, *piece, options);
    whole = run_on(machine, program, {});
    EXPECT_TRUE(whole.nc.end.complete);
  }
};

const Lap& lap() {
  static const Lap lap("trunnion.toml");
  return lap;
}

/// How many rows before the end of a run command the same to the bit as the uninterrupted one.
std::size_t same_to_the_end(const Outcome& run, const Outcome& whole) {
  const auto& a = run.rows;
  const auto& b = whole.rows;
  std::size_t n = 0;
  while (n < std::min(a.size(), b.size()) &&
         a[a.size() - 1 - n].q_cmd == b[b.size() - 1 - n].q_cmd &&
         a[a.size() - 1 - n].line == b[b.size() - 1 - n].line)
    ++n;
  return n;
}

double seconds_into(const Outcome& run,
                    Tick k) {  // of the program, which begins when it is running
  std::size_t first = 0;
  while (run.rows[first].state != static_cast<double>(NcState::running)) ++first;
  return seconds(k - static_cast<Tick>(first));
}

// ------------------------------------------------------------------------------ in one run

/// A wall square to X at 100 mm, the axes before it.
struct WallAt100mm {
  TemporaryFile piece{"power-wall.toml", to_toml(plane())};
  Machine machine =
      load_machine(configs("machines/trunnion.toml"),
                   {"setup.piece=" + piece.path(), "axes.X.start_mm=130", "axes.Z.start_mm=250"});

  static PieceParams plane() {
    PieceParams plane;
    plane.kind = PieceParams::Kind::plane;
    plane.centre = {0.1, 0, 0};
    plane.direction = Vec3::UnitX();
    return plane;
  }
};

TEST(Power, HoldsRetractsAndSavesInThisOrder) {
  Memories memories;
  const Outcome run =
      run_on(lap().machine, lap().program, {.faults = {loss(12, 1)}, .memories = &memories});
  EXPECT_EQ(codes(run), (std::vector<int>{4001, 4004, 4002})) << told(run);
  EXPECT_EQ(run.nc.exit_code(), 3);
  EXPECT_FALSE(run.nc.end.complete);
  EXPECT_EQ(run.summary.alarms[0].tick, 12004) << "5 ms after the loss";
  EXPECT_EQ(run.summary.alarms[2].tick, 13000);

  using enum RunStage;
  EXPECT_EQ(memories.stages(), (std::vector{running, holding, held, retracting, retracted}));
  EXPECT_EQ(decode_record(memories.nc.saved[1]).value().cycle, 12004) << "kept in the same cycle";

  // Every record of the outage leads to the same place.
  const NcRecord last = memories.record();
  for (std::size_t i = 1; i < memories.nc.saved.size(); ++i) {
    const NcRecord r = decode_record(memories.nc.saved[i]).value();
    EXPECT_EQ(r.held.cycles, last.held.cycles);
    EXPECT_NEAR(r.held.on_path, last.held.on_path, 1e-15);
    for (std::size_t a = 0; a < kAxisCount; ++a)
      EXPECT_NEAR(r.path_point[a], last.path_point[a], 1e-15);
  }
  // Held: at that place, at rest, still in contact; at the end free.
  std::size_t held_row = 12000;
  while (run.rows[held_row].state != static_cast<double>(NcState::hold)) ++held_row;
  for (std::size_t a = 0; a < kAxisCount; ++a)
    EXPECT_NEAR(run.rows[held_row].q_cmd[a], last.path_point[a], 1e-12);
  EXPECT_GT(Vec3(run.rows[held_row + 50].deflection.data()).norm(), 0.4e-3);
  EXPECT_LT(Vec3(run.rows.back().deflection.data()).norm(), lap().machine.probe.min_deflection);
  EXPECT_LT(static_cast<double>(held_row), 12004 + 100);
  // Nothing is latched: a loss of the mains is nobody's fault.
  EXPECT_TRUE(memories.spindle.saved.empty());
  EXPECT_TRUE(memories.overtravel.saved.empty());
}

TEST(Power, GoesOnInTheSameRunAndMeasuresTheWholePath) {
  const Outcome run = run_on(lap().machine, lap().program,
                             {.faults = {loss(12, 1)}, .on_return = OnPowerReturn::resume});
  EXPECT_EQ(codes(run), (std::vector<int>{4001, 4004, 4002, 4005})) << told(run);
  EXPECT_TRUE(run.nc.end.complete);
  EXPECT_EQ(run.nc.exit_code(), 0);
  EXPECT_EQ(run.summary.verdict, Verdict::pass) << run.summary.verdict_reason;
  const Outcome& whole = lap().whole;
  const double total = seconds_into(whole, static_cast<Tick>(whole.rows.size()));
  const double from = seconds_into(run, 12004);
  EXPECT_GE(seconds(static_cast<Tick>(same_to_the_end(run, whole))), total - from - 0.15);
  EXPECT_NEAR(run.summary.groups[0].e_n.max_abs(), whole.summary.groups[0].e_n.max_abs(), 1e-6);
}

TEST(Power, ADipShorterThanTheSignalsDelayIsRiddenThrough) {
  const Outcome run = run_on(lap().machine, lap().program, {.faults = {loss(12, 0.004)}});
  EXPECT_TRUE(codes(run).empty()) << told(run);
  EXPECT_EQ(run.nc.end.trace_hash, lap().whole.nc.end.trace_hash) << "nobody notices";
  const Outcome noticed = run_on(lap().machine, lap().program,
                                 {.faults = {loss(12, 0.005)}, .on_return = OnPowerReturn::resume});
  EXPECT_EQ(codes(noticed).front(), 4001);
  EXPECT_TRUE(noticed.nc.end.complete);
}

TEST(Power, WithoutALossTheMemoryChangesNoBit) {
  Memories memories;
  const Outcome run = run_on(lap().machine, lap().program, {.memories = &memories});
  EXPECT_EQ(run.nc.end.trace_hash, lap().whole.nc.end.trace_hash);
  EXPECT_EQ(memories.stages(), (std::vector{RunStage::running, RunStage::done}));
}

/// A second loss at every phase of what follows the first.
TEST(Power, ALossDuringTheReturnIsRiddenOutToo) {
  const std::string program =
      "G90 G21 G54\nM19\nG43 H1\nG0 X105 Y0 Z100\nG1 X102.5 F1000\nG1 Y40 F2000\nM30\n";
  const WallAt100mm wall;
  const Machine& machine = wall.machine;
  const Outcome whole = run_on(machine, program, {});
  ASSERT_TRUE(whole.nc.end.complete);
  std::size_t contact = 0;
  while (whole.rows[contact].q_act[kY] < 5e-3) ++contact;
  const double first = seconds(static_cast<Tick>(contact));
  const double total = seconds_into(whole, static_cast<Tick>(whole.rows.size()));
  int while_rising = 0, while_returning = 0;
  for (int i = 0; i < 40; ++i) {
    Memories memories;
    const double second = first + 0.03 + 0.029 * i;
    const Outcome run = run_on(machine, program,
                               {.faults = {loss(first, 0.02), loss(second, 0.02)},
                                .on_return = OnPowerReturn::resume,
                                .memories = &memories});
    ASSERT_TRUE(run.nc.end.complete) << i << told(run);
    const auto all = codes(run);
    EXPECT_EQ(std::count(all.begin(), all.end(), 4001), 2) << i << told(run);
    const double held = seconds(memories.record().held.cycles);
    EXPECT_GE(seconds(static_cast<Tick>(same_to_the_end(run, whole))), total - held - 0.15)
        << i << told(run);
    const auto stages = memories.stages();
    while_rising += std::count(stages.begin(), stages.end(), RunStage::holding) == 2 ? 1 : 0;
    while_returning += std::count(stages.begin(), stages.end(), RunStage::returning) == 2 ? 1 : 0;
    for (const TelemetryRow& row : run.rows) ASSERT_EQ(row.overtravel, 0) << i;
  }
  EXPECT_GT(while_rising, 0);
  EXPECT_GT(while_returning, 5);
}

// ------------------------------------------------------------------------------ exhaustion

// Standing axes of an ideal machine take no force: 50 J last 50 / (150 + 6 x 20) s.
TEST(Power, TheStoreLastsAsLongAsTheBalanceSays) {
  const Machine machine =
      load_machine(configs("machines/trunnion.toml"), {"supply.hold_up_energy_J=50"});
  Memories memories;
  const Outcome run = run_on(machine, "G90 G21\nG4 P9\nM30\n",
                             {.faults = {"supply power_loss from_s=2"}, .memories = &memories});
  const int steps = static_cast<int>(std::ceil(50.0 / (150 + 6 * 20) / kCycle));
  EXPECT_EQ(run.nc.end.cycles, 2000 + steps) << "the last of them dark";
  EXPECT_EQ(run.rows.size(), static_cast<std::size_t>(2000 + steps - 1));
  EXPECT_EQ(codes(run).back(), 4003) << told(run);
  EXPECT_EQ(run.nc.exit_code(), 3);
  EXPECT_NE(run.nc.end.reason.find("axes at rest"), std::string::npos) << run.nc.end.reason;
}

TEST(Power, WithoutAStoreNothingIsSavedAndNothingToResume) {
  const Machine machine =
      load_machine(configs("machines/trunnion.toml"), {"supply.hold_up_energy_J=0"});
  Memories memories;
  const std::string program = "G90 G21\nG1 X50 F3000\nG1 X0\nM30\n";
  const Outcome run =
      run_on(machine, program, {.faults = {"supply power_loss from_s=0.5"}, .memories = &memories});
  EXPECT_EQ(codes(run), (std::vector<int>{4003})) << told(run);
  EXPECT_EQ(run.nc.end.cycles, 501);
  EXPECT_EQ(memories.record().stage, RunStage::running);
  EXPECT_THROW(run_on(machine, program, {.resume = true, .memories = &memories}), InputError);
  EXPECT_TRUE(run_on(machine, program, {.memories = &memories}).nc.end.complete)
      << "from the start";
}

struct Bins {
  std::vector<Coverage::Bin> bins;
  explicit Bins(const Outcome& run) : bins(run.summary.bins) {}
  bool ok(std::size_t i) const { return i < bins.size() && bins[i] == Coverage::Bin::ok; }
};

/// Interrupted at seeded moments with three stores, switched on again, resumed: the rest of the
/// path is the program's to the bit, and both recordings together hold all of it.
void interrupt_and_resume(const Lap& lap, unsigned seed, int rounds) {
  std::mt19937_64 random(seed);
  const double total = seconds(static_cast<Tick>(lap.whole.rows.size()));
  for (int i = 0; i < rounds; ++i)
    for (const double joules : {5., 50., 1500.}) {
      Machine machine = lap.machine;
      machine.supply.hold_up_energy = joules;
      const double at = 0.05 + (total - 0.3) * static_cast<double>(random() % 1000) / 1000;
      SCOPED_TRACE(std::to_string(joules) + " J, lost at " + std::to_string(at) + " s");
      Memories memories;
      const Outcome first = run_on(
          machine, lap.program,
          {.faults = {"supply power_loss from_s=" + std::to_string(at)}, .memories = &memories});
      EXPECT_FALSE(first.nc.end.complete);
      EXPECT_EQ(codes(first).back(), 4003) << told(first);
      const NcRecord kept = memories.record();
      ASSERT_TRUE(resumable(kept.stage)) << told(first);
      EXPECT_THROW(run_on(machine, lap.program, {.memories = &memories}), InputError)
          << "not forgotten by starting anew";

      const Outcome second = run_on(machine, lap.program, {.resume = true, .memories = &memories});
      EXPECT_TRUE(second.nc.end.complete) << told(second);
      EXPECT_EQ(codes(second), (std::vector<int>{4005})) << told(second);
      EXPECT_EQ(memories.record().stage, RunStage::done);
      const double held = seconds(kept.held.cycles);
      const double all = seconds_into(lap.whole, static_cast<Tick>(lap.whole.rows.size()));
      EXPECT_GE(seconds(static_cast<Tick>(same_to_the_end(second, lap.whole))), all - held - 0.15);
      EXPECT_THROW(run_on(machine, lap.program, {.resume = true, .memories = &memories}),
                   InputError)
          << "only once";
      for (const TelemetryRow& row : second.rows) ASSERT_EQ(row.overtravel, 0);

      const Bins a(first), b(second), whole(lap.whole);
      std::size_t lost = 0;
      for (std::size_t n = 0; n < whole.bins.size(); ++n)
        if (whole.ok(n) && !a.ok(n) && !b.ok(n)) ++lost;
      EXPECT_LE(lost, 8u) << "bins of 1 mm: some to find the path again";
    }
}

TEST(Power, ExhaustedAtAnyMomentTheTrunnionGoesOn) {
  interrupt_and_resume(lap(), 1, kSanitized ? 1 : 3);
}
TEST(Power, ExhaustedAtAnyMomentTheHeadGoesOn) {
  interrupt_and_resume(Lap("head.toml"), 2, kSanitized ? 1 : 2);
}
TEST(Power, ExhaustedAtAnyMomentTheMeasuredMachineGoesOn) {
  interrupt_and_resume(Lap("trunnion_measured.toml"), 3, kSanitized ? 1 : 2);
}

/// Whenever it gets dark, the memory holds a state that leads back to one and the same place.
TEST(Power, EveryJouleOfTheStoreLeavesAValidState) {
  const double first = 12;
  std::optional<NcRecord> reference;
  for (double joules = 1; joules < 140; joules += kSanitized ? 30 : 6.7) {
    Machine machine = lap().machine;
    machine.supply.hold_up_energy = joules;
    Memories memories;
    const Outcome run = run_on(
        machine, lap().program,
        {.faults = {"supply power_loss from_s=" + std::to_string(first)}, .memories = &memories});
    EXPECT_EQ(codes(run).back(), 4003);
    const NcRecord kept = memories.record();
    if (!resumable(kept.stage)) {
      EXPECT_LT(joules, 0.005 * 400) << "spent before the signal came";
      continue;
    }
    if (!reference) reference = kept;
    EXPECT_EQ(kept.held.cycles, reference->held.cycles) << joules;
    EXPECT_NEAR(kept.held.on_path, reference->held.on_path, 1e-15) << joules;
  }
  ASSERT_TRUE(reference);
}

TEST(Power, AnotherProgramOrMachineIsRefused) {
  Memories memories;
  Machine machine = lap().machine;
  const PowerOptions again{.resume = true, .memories = &memories};
  run_on(machine, lap().program, {.faults = {loss(12, 1)}, .memories = &memories});
  const auto refusal = [&](const Machine& m, const std::string& program) -> std::string {
    try {
      run_on(m, program, again);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(refusal(machine, lap().program + "\n").find("not the program"), std::string::npos);
  Machine other = machine;
  other.axes[kC].servo.kv_per_s += 1e-9;
  EXPECT_NE(refusal(other, lap().program).find("--set"), std::string::npos);
  EXPECT_EQ(refusal(machine, lap().program), "");
}

// ------------------------------------------------------------------------------ latches

TEST(Power, ALockedSpindleRefusesEveryStart) {
  Machine machine = load_machine(configs("machines/trunnion.toml"));
  machine.probe.in_spindle = false;
  for (const char* start : {"M3 S1000", "M4 S1000", "M19"}) {
    const std::string program = std::string("G90 G21\nG1 X5 F3000\n") + start + "\nG4 P1\nM30\n";
    Memories open;
    const Outcome turning = run_on(machine, program, {.memories = &open});
    EXPECT_TRUE(turning.nc.end.complete) << told(turning);
    Memories locked;
    locked.spindle.save(encode_spindle_lock(true));
    const Outcome run = run_on(machine, program, {.memories = &locked});
    EXPECT_EQ(codes(run), (std::vector<int>{2201})) << start << told(run);
    EXPECT_EQ(run.nc.exit_code(), 3);
    for (const TelemetryRow& row : run.rows) ASSERT_EQ(row.spindle_speed, 0);
    EXPECT_EQ(decode_spindle_lock(locked.spindle.load()), true) << "still";
  }
  Memories locked;
  locked.spindle.save(encode_spindle_lock(true));
  EXPECT_TRUE(run_on(machine, "G90 G21\nG1 X5 F3000\nM30\n", {.memories = &locked}).nc.end.complete)
      << "axes may move";
}

TEST(Power, ATripSurvivesSwitchingOff) {
  const WallAt100mm wall;
  const Machine& machine = wall.machine;
  const std::string crash = "G90 G21 G54\nM19\nG43 H1\nG0 X120 Y0 Z100\nG1 X60 F1000\nM30\n";
  const std::string harmless = "G90 G21 G54\nG43 H1\nG0 X125 Y0 Z100\nM30\n";
  Memories memories;
  const Outcome tripped = run_on(machine, crash, {.memories = &memories});
  EXPECT_EQ(tripped.nc.exit_code(), 3);
  EXPECT_EQ(decode_spindle_lock(memories.spindle.load()), true);
  EXPECT_EQ(decode_protection_latch(memories.overtravel.load())->state, ProtectionState::soft_stop);
  EXPECT_EQ(memories.record().protection.state, ProtectionState::soft_stop);
  EXPECT_EQ(memories.record().stage, RunStage::alarm);

  const auto starts = [&](Memories& kept, int code) {
    const Outcome run = run_on(machine, harmless, {.memories = &kept});
    const auto all = codes(run);
    const bool stood = std::all_of(run.rows.begin(), run.rows.end(), [](const TelemetryRow& row) {
      return std::abs(row.q_act[kX] - 0.13) < 1e-9;
    });
    if (code == 0) return run.nc.end.complete && !stood;
    EXPECT_TRUE(stood) << "nothing may move";
    EXPECT_EQ(run.nc.exit_code(), 3);
    EXPECT_NE(std::find(all.begin(), all.end(), code), all.end()) << told(run);
    return run.nc.end.complete;
  };
  EXPECT_FALSE(starts(memories, 1003));
  EXPECT_FALSE(starts(memories, 1003)) << "again and again";
  // Each of the two alone is enough.
  Memories nc_alone = memories, module_alone = memories;
  nc_alone.overtravel.save({});
  EXPECT_FALSE(starts(nc_alone, 1004));
  module_alone.nc.save({});
  EXPECT_FALSE(starts(module_alone, 1003));
  module_alone.overtravel.save(
      encode_protection_latch({ProtectionState::hard, ProtectionCause::limit, 5e-3}));
  module_alone.nc.save({});
  EXPECT_FALSE(starts(module_alone, 1001));
  // The operator's reset.
  memories.nc.save({});
  memories.overtravel.save({});
  memories.spindle.save({});
  EXPECT_TRUE(starts(memories, 0));
}

// ------------------------------------------------------------------------------ together

/// Losses of the mains together with other faults: an alarm, an end or a program that goes on, and
/// always a memory that can be read.
TEST(Power, LossesWithOtherFaultsEndSafely) {
  std::mt19937_64 random(77);
  const std::string others[] = {"drive Y fault",          "probe wire_break",
                                "overtravel silent",      "drive C encoder_jump urad=400000",
                                "probe mute for_s=0.003", "bus stuck",
                                "drive X deaf",           "NC unit deaf"};
  for (int i = 0; i < (kSanitized ? 8 : 24); ++i) {
    const double at = 8 + 8 * static_cast<double>(random() % 100) / 100;
    const double other = at + 0.6 * static_cast<double>(random() % 100) / 100;
    Machine machine = lap().machine;
    machine.supply.hold_up_energy = random() % 2 ? 90 : 1500;
    Memories memories;
    const std::string fault =
        others[random() % std::size(others)] + " from_s=" + std::to_string(other);
    const Outcome run =
        run_on(machine, lap().program,
               {.faults = {loss(at, 0.5), fault},
                .on_return = random() % 2 ? OnPowerReturn::resume : OnPowerReturn::end,
                .memories = &memories});
    EXPECT_EQ(run.nc.exit_code(), 3) << fault << "\n" << told(run);
    EXPECT_EQ(codes(run).front(), 4001) << fault << "\n" << told(run);
    memories.record();
    const auto last = static_cast<Tick>(run.rows.size());
    EXPECT_LT(seconds(last), at + 10) << fault;
  }
}

}  // namespace
}  // namespace vcnc::power_test
