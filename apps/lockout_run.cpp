#include "apps/lockout_run.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>

#include "apps/lockout_fault.hpp"
#include "apps/nc_run.hpp"
#include "apps/virtual_machine.hpp"
#include "bus/canopen_device.hpp"
#include "bus/cia402.hpp"
#include "bus/inproc.hpp"
#include "bus/run_node.hpp"
#include "configs/config.hpp"
#include "controller/alarms.hpp"
#include "controller/player.hpp"
#include "model/input_error.hpp"
#include "probe_sim/overtravel_node.hpp"
#include "probe_sim/probe_node.hpp"

namespace vcnc {

namespace {

class CountingSink : public TelemetrySink {
 public:
  CountingSink(TripEnd& end, TelemetrySink* also) : end_(end), also_(also) {}
  void begin(const RunBegin& begin) override {
    if (also_) also_->begin(begin);
  }
  void row(const TelemetryRow& row) override {
    ++end_.rows;
    if (also_) also_->row(row);
  }
  void alarm(const Alarm& alarm) override {
    const auto is = [&](AlarmCode code) { return alarm.code == static_cast<int>(code); };
    if (is(AlarmCode::overtravel_soft) || is(AlarmCode::overtravel_soft_nc)) end_.soft_alarm = true;
    if (is(AlarmCode::overtravel_hard) || is(AlarmCode::overtravel_hard_nc)) end_.hard_alarm = true;
    end_.alarms.push_back(alarm);
    if (also_) also_->alarm(alarm);
  }
  void end(const RunEnd& end) override {
    if (also_) also_->end(end);
  }

 private:
  TripEnd& end_;
  TelemetrySink* also_;
};

/// A file that is gone when the run is over.
class ProgramOnDisk {
 public:
  ProgramOnDisk(std::string path, const std::string& text) : path_(std::move(path)) {
    std::ofstream out(path_, std::ios::binary);
    out << text;
    out.close();
    if (!out) throw InputError(path_ + ": cannot be written");
  }
  ~ProgramOnDisk() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Asks for M3 when all is over, with an overtravel module and an NC unit that say "normal" again.
bool spindle_stays_locked(Node& spindle, Tick from) {
  GroupCommand command;
  command.controlword = cia402::kEnable;
  command.spindle_mode = GroupCommand::SpindleMode::clockwise;
  command.spindle_speed = 100;
  Frames out;
  double before = 0;
  for (Tick k = from; k < from + 10; ++k) {
    out.clear();
    command.tick = low16(k - 1);
    spindle.step(k, Frames{encode(OvertravelState{}), encode(command)}, out);
    const auto status = decode_drive_status(out.at(0));
    if (!status) return false;
    const double speed = std::abs(status->second_encoder);
    if (k > from && speed > before) return false;
    before = speed;
  }
  return true;
}

/// Shows the module a probe that reads zero.
bool module_stays_latched(Node& module, Tick from) {
  const std::vector<Frame> inputs{encode(ProbeSample{})};
  Frames out;
  for (Tick k = from; k < from + 10; ++k) {
    out.clear();
    module.step(k, inputs, out);
    const auto state = decode_overtravel_state(out.at(0));
    if (!state || state->state < OvertravelState::State::soft_stop) return false;
  }
  return true;
}

class NoSink : public TelemetrySink {
 public:
  void begin(const RunBegin&) override {}
  void row(const TelemetryRow&) override {}
  void alarm(const Alarm&) override {}
  void end(const RunEnd&) override {}
};

/// Ends the run at the first touch.
class TouchTap : public FrameTap {
 public:
  explicit TouchTap(const ProbeNode& probe) : probe_(probe) {}
  void cycle(Tick k, std::span<const Frame>) override {
    constexpr double kTouch = 1e-6;  // [m]
    if (touch < 0 && probe_.true_deflections().back().norm() > kTouch) touch = k;
    if (touch >= 0) stop = true;
  }
  Tick touch = -1;
  std::atomic<bool> stop{false};

 private:
  const ProbeNode& probe_;
};

const PieceParams* piece_of(const LockoutCase& the_case) {
  return the_case.piece ? &*the_case.piece : nullptr;
}

/// The cycle in which the ball touches when nothing is broken; -1: it never does.
Tick first_touch(const LockoutCase& the_case, std::uint64_t seed, const std::string& program) {
  const VirtualMachine modules(the_case.machine, piece_of(the_case), seed);
  const std::vector<Node*> nodes = modules.nodes();
  InprocTransport transport(nodes);
  TouchTap tap(modules.probe());
  NoSink sink;
  run_nc(the_case.machine,
         {.program = program, .seed = seed, .piece_toml = "", .stop = &tap.stop, .taps = {&tap}},
         transport, sink);
  return tap.touch;
}

/// Faults at contact get their moment.
BusFaults resolved(const LockoutCase& the_case, std::uint64_t seed, const std::string& program) {
  BusFaults faults = the_case.faults;
  if (std::none_of(faults.begin(), faults.end(), [](const BusFault& f) { return f.at_contact; }))
    return faults;
  const Tick touch = first_touch(the_case, seed, program);
  std::erase_if(faults, [&](const BusFault& f) { return f.at_contact && touch < 0; });
  for (BusFault& fault : faults) {
    if (!fault.at_contact) continue;
    fault.from = std::max<Tick>(0, touch + fault.from);
    fault.at_contact = false;
    fault.text = text_of(fault);
  }
  return faults;
}

void play(const LockoutCase& the_case, const BusFaults& faults, int seed,
          const LockoutRunOptions& options, const std::string& program, LockoutVerdict& verdict,
          TripLog& log) {
  const Machine& machine = the_case.machine;
  Machine nc = machine, module = machine;
  if (options.sabotage) options.sabotage(module, nc);
  const PieceParams* piece = piece_of(the_case);
  VirtualMachine modules(machine, piece, static_cast<std::uint64_t>(seed), faults);
  std::vector<Node*> nodes = modules.nodes();
  OvertravelNode sabotaged(module);
  CanopenDevice device(sabotaged);
  if (options.sabotage) nodes.back() = &device;
  InprocTransport transport(nodes);
  const OvertravelNode& overtravel =
      options.sabotage ? sabotaged
                       : dynamic_cast<const OvertravelNode&>(modules.module(kOvertravelNode));
  TripTap tap(modules, overtravel, log);
  CountingSink sink(verdict.end, options.also);
  const NcRunResult result = run_nc(nc,
                                    {.program = program,
                                     .seed = static_cast<std::uint64_t>(seed),
                                     .piece_toml = options.also && piece ? to_toml(*piece) : "",
                                     .faults = faults,
                                     .taps = {&tap}},
                                    transport, sink);
  verdict.end.complete = result.end.complete;
  verdict.end.alarmed = result.alarmed;
  verdict.end.reason = result.end.reason;
  verdict.trace_hash = result.end.trace_hash;
  verdict.cycles = log.size();
  verdict.figures = measure(log, machine);
  if (!verdict.figures.tripped() && !result.alarmed) return;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const RunDown alone = run_down(*nodes[axis], result.end.cycles);
    Tick& worst = verdict.end.run_down;
    if (worst >= 0) worst = alone.at_rest ? std::max(worst, alone.cycles) : -1;
  }
  // The modules themselves, without what stands between them and the bus.
  Node& module_in_use = options.sabotage ? sabotaged : modules.module(kOvertravelNode);
  verdict.end.spindle_stays_locked =
      spindle_stays_locked(modules.module(kSpindleNode), result.end.cycles);
  if (log.back().protection >= OvertravelState::State::soft_stop)  // else that is found anyway
    verdict.end.module_stays_latched = module_stays_latched(module_in_use, result.end.cycles);
}

}  // namespace

void check_runnable(const Scenario& scenario, const std::string& file,
                    const std::string& work_folder) {
  const LockoutCase the_case = [&] {
    try {
      return make_case(scenario);
    } catch (const InputError& e) {
      throw InputError(file + ": " + e.what());
    }
  }();
  if (scenario.kind != Scenario::Kind::program) return;
  const ProgramOnDisk program(work_folder + "/program.ngc", the_case.program);
  Machine machine = the_case.machine;
  machine.probe.in_spindle = false;
  try {
    Player(program.path(), machine);
  } catch (const InputError& e) {
    std::string reason = e.what();
    if (reason.starts_with(program.path()))
      reason.replace(0, program.path().size(),
                     scenario.program.empty() ? "gcode" : scenario.program);
    throw InputError(file + ": " + reason);
  }
}

LockoutVerdict run_lockout(const std::string& id, const Scenario& scenario,
                           const LockoutRunOptions& options, TripLog& log) {
  LockoutVerdict verdict{
      .id = id, .name = scenario.name, .kind = scenario.kind, .expect = scenario.expect};
  log.clear();
  const LockoutCase the_case = make_case(scenario);
  verdict.within_limit = the_case.within_limit;
  const ProgramOnDisk program(options.work_folder + "/" + id + ".ngc", the_case.program);
  BusFaults faults;
  try {
    faults = resolved(the_case, static_cast<std::uint64_t>(scenario.seed), program.path());
    for (const BusFault& fault : faults) verdict.faults.push_back(fault.text);
    play(the_case, faults, scenario.seed, options, program.path(), verdict, log);
  } catch (const InputError& e) {  // refused before anything moved
    verdict.end.refused = true;
    verdict.end.reason = e.what();
    if (verdict.end.reason.starts_with(program.path()))
      verdict.end.reason.replace(0, program.path().size(), "program");
  }
  verdict.failures =
      judge(scenario, the_case.within_limit, log, verdict.figures, verdict.end, the_case.machine);
  if (!scenario.faults.empty())
    for (std::string& sentence :
         judge_faulted(scenario, the_case, faults, log, verdict.figures, verdict.end))
      verdict.failures.push_back(std::move(sentence));
  return verdict;
}

}  // namespace vcnc
