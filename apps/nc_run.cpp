#include "apps/nc_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "apps/interrupted_program.hpp"
#include "apps/machine_roster.hpp"
#include "apps/node_options.hpp"
#include "bus/main_loop.hpp"
#include "configs/config.hpp"
#include "controller/supplied_master.hpp"

namespace vcnc {

namespace {

/// What the NC unit begins with: its record as far as it concerns this program.
NcUnitOptions begin_with(const Machine& machine, const NcRunOptions& options) {
  NcUnitOptions nc{.on_power_return = options.on_power_return,
                   .memory = options.memory,
                   .operations = options.operations,
                   .player = options.player};
  if (options.memory == nullptr) return nc;
  nc.data = options.data;
  if (options.data) {
    nc.kept = load_nc_data(*options.data);
    nc.player.interpreter.data = options.resume ? nc.kept.begin : nc.kept.now;
    if (options.resume || nc.player.from_line > 0) nc.player.interpreter.touches = nc.kept.touches;
  }
  nc.record = identity_of(machine, options.piece_toml, options.program, options.player);
  const std::vector<std::uint8_t> bytes = options.memory->load();
  const std::optional<NcRecord> kept = decode_record(bytes);
  if (!kept && !bytes.empty()) refuse_state("NC unit");
  if (options.resume) {
    check_resume(kept, nc.record, "the memory");
    nc.record = *kept;
    nc.resume = true;
    nc.switched_on_at = position_at_switch_on(as_nc_believes(machine), *kept);
  } else if (kept) {
    check_fresh(kept, "the memory");
    nc.record.stage = kept->stage;
    nc.record.alarm = kept->alarm;
    nc.record.protection = kept->protection;
  }
  return nc;
}

}  // namespace

int NcRunResult::exit_code() const {
  if (node_lost) return kExitFailure;
  if (alarmed) return kExitAlarm;
  if (end.complete) return kExitOk;
  return interrupted ? kExitInterrupted : kExitFailure;
}

NcRunResult run_nc(const Machine& machine, const NcRunOptions& options, Transport& transport,
                   TelemetrySink& sink) {
  NcUnit nc(as_nc_believes(machine), options.program, sink, begin_with(machine, options));
  sink.begin({.run_id = std::to_string(::getpid()),
              .program_name = std::filesystem::path(options.program).filename().string(),
              .declared_toml = to_toml(declared(machine)),
              .piece_toml = options.piece_toml,
              .seed = options.seed});
  Pacer pacer(options.pace);
  FaultedMaster faulted(nc, options.faults);
  Master& unit = concerns(options.faults, kNcUnitName) ? static_cast<Master&>(faulted) : nc;
  const bool mains_fail = std::any_of(options.faults.begin(), options.faults.end(),
                                      [](const BusFault& f) { return f.of_supply(); });
  SuppliedMaster supplied(actual(machine), options.faults, unit, nc, sink,
                          options.memory != nullptr);
  Master& master = mains_fail ? supplied : unit;
  const MainLoopResult loop =
      run_main_loop(master, transport, machine_roster(options.faults),
                    {.pacer = pacer,
                     .rates = {machine.bus.nominal_bit_rate, machine.bus.data_bit_rate},
                     .answer_timeout_ms = options.answer_timeout_ms,
                     .taps = options.taps,
                     .stop = options.stop});
  NcRunResult result;
  result.alarmed = nc.alarmed() || supplied.dark();
  result.struck = faulted.struck();
  result.never_operated = nc.never_operated();
  for (const BusFault& fault : options.faults)
    if (fault.of_supply() && supplied.struck()) result.struck.push_back(fault.text);
  result.node_lost = !loop.lost_nodes.empty();
  result.interrupted = !loop.complete && options.stop && *options.stop;
  result.end = {.complete = loop.complete && nc.complete() && !supplied.dark(),
                .reason = result.interrupted     ? "stopped by the operator"
                          : supplied.dark()      ? supplied.reason()
                          : loop.failure.empty() ? nc.reason()
                                                 : loop.failure,
                .cycles = loop.cycles,
                .trace_hash = loop.trace_hash,
                .wall_seconds = pacer.elapsed(),
                .bus_load_worst = loop.bus_load_worst,
                .gaps = loop.lost};
  sink.end(result.end);
  return result;
}

}  // namespace vcnc
