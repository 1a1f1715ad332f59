#include "apps/lockout_run.hpp"

#include <cstdio>
#include <fstream>

#include "apps/nc_run.hpp"
#include "apps/virtual_machine.hpp"
#include "bus/cia402.hpp"
#include "bus/inproc.hpp"
#include "configs/config.hpp"
#include "controller/alarms.hpp"
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
  const std::vector<Frame> inputs{encode(OvertravelState{}), encode(command)};
  Frames out;
  double before = 0;
  for (Tick k = from; k < from + 10; ++k) {
    out.clear();
    spindle.step(k, inputs, out);
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

void play(const LockoutCase& the_case, int seed, const LockoutRunOptions& options,
          const std::string& program, LockoutVerdict& verdict, TripLog& log) {
  const Machine& machine = the_case.machine;
  Machine nc = machine, module = machine;
  if (options.sabotage) options.sabotage(module, nc);
  const PieceParams* piece = the_case.piece ? &*the_case.piece : nullptr;
  VirtualMachine modules(machine, piece, static_cast<std::uint64_t>(seed));
  std::vector<Node*> nodes = modules.nodes();
  OvertravelNode sabotaged(module);
  if (options.sabotage) nodes.back() = &sabotaged;
  InprocTransport transport(nodes);
  TripTap tap(modules.probe(), log);
  CountingSink sink(verdict.end, options.also);
  const NcRunResult result = run_nc(nc,
                                    {.program = program,
                                     .seed = static_cast<std::uint64_t>(seed),
                                     .piece_toml = options.also && piece ? to_toml(*piece) : "",
                                     .taps = {&tap}},
                                    transport, sink);
  verdict.end.complete = result.end.complete;
  verdict.end.alarmed = result.alarmed;
  verdict.end.reason = result.end.reason;
  verdict.trace_hash = result.end.trace_hash;
  verdict.cycles = log.size();
  verdict.figures = measure(log, machine);
  if (!verdict.figures.tripped()) return;
  verdict.end.spindle_stays_locked =
      spindle_stays_locked(*nodes[kSpindleNode - 1], result.end.cycles);
  if (log.back().module >= OvertravelState::State::soft_stop)  // else that is found anyway
    verdict.end.module_stays_latched =
        module_stays_latched(*nodes[kOvertravelNode - 1], result.end.cycles);
}

}  // namespace

LockoutVerdict run_lockout(const std::string& id, const Scenario& scenario,
                           const LockoutRunOptions& options, TripLog& log) {
  LockoutVerdict verdict{
      .id = id, .name = scenario.name, .kind = scenario.kind, .expect = scenario.expect};
  log.clear();
  const LockoutCase the_case = make_case(scenario);
  verdict.within_limit = the_case.within_limit;
  const ProgramOnDisk program(options.work_folder + "/" + id + ".ngc", the_case.program);
  try {
    play(the_case, scenario.seed, options, program.path(), verdict, log);
  } catch (const InputError& e) {  // refused before anything moved
    verdict.end.refused = true;
    verdict.end.reason = e.what();
    if (verdict.end.reason.starts_with(program.path()))
      verdict.end.reason.replace(0, program.path().size(), "program");
  }
  verdict.failures =
      judge(scenario, the_case.within_limit, log, verdict.figures, verdict.end, the_case.machine);
  return verdict;
}

}  // namespace vcnc
