#include "apps/nc_run.hpp"

#include <unistd.h>

#include <filesystem>

#include "apps/machine_roster.hpp"
#include "apps/node_options.hpp"
#include "bus/main_loop.hpp"
#include "configs/config.hpp"
#include "controller/nc_unit.hpp"

namespace vcnc {

int NcRunResult::exit_code() const {
  if (node_lost) return kExitFailure;
  if (alarmed) return kExitAlarm;
  if (end.complete) return kExitOk;
  return interrupted ? kExitInterrupted : kExitFailure;
}

NcRunResult run_nc(const Machine& machine, const NcRunOptions& options, Transport& transport,
                   TelemetrySink& sink) {
  NcUnit nc(as_nc_believes(machine), options.program, sink);
  sink.begin({.run_id = std::to_string(::getpid()),
              .program_name = std::filesystem::path(options.program).filename().string(),
              .declared_toml = to_toml(declared(machine)),
              .piece_toml = options.piece_toml,
              .seed = options.seed});
  Pacer pacer(options.pace);
  FaultedMaster faulted(nc, options.faults);
  Master& master = concerns(options.faults, kNcUnitName) ? static_cast<Master&>(faulted) : nc;
  const MainLoopResult loop =
      run_main_loop(master, transport, machine_roster(options.faults),
                    {.pacer = pacer,
                     .rates = {machine.bus.nominal_bit_rate, machine.bus.data_bit_rate},
                     .answer_timeout_ms = options.answer_timeout_ms,
                     .taps = options.taps,
                     .stop = options.stop});
  NcRunResult result;
  result.alarmed = nc.alarmed();
  result.node_lost = !loop.lost_nodes.empty();
  result.interrupted = !loop.complete && options.stop && *options.stop;
  result.end = {.complete = loop.complete && nc.complete(),
                .reason = result.interrupted     ? "stopped by the operator"
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
