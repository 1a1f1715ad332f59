// vcnc-nc: the NC unit. Master of the bus, plays the program, publishes the samples over DDS.
#include <iostream>

#include "apps/control_pipe.hpp"
#include "apps/faults.hpp"
#include "apps/memory_folder.hpp"
#include "apps/nc_run.hpp"
#include "apps/node_options.hpp"
#include "apps/operations.hpp"
#include "apps/program_options.hpp"
#include "apps/stop_signal.hpp"
#include "bus/dds/dds_publisher.hpp"
#include "configs/config.hpp"

namespace {

constexpr int kSubscriberTimeoutMs = 15000;

int nc(int argc, char** argv) {
  using namespace vcnc;
  const NodeOptions options = parse_node_options(argc, argv, "The NC unit", "mpbsk");
  const Machine machine = load_machine(options.machine);
  catch_stop_signals();
  const auto transport = open_transport(options.bus, 0);
  DdsPublisherOptions telemetry;
  telemetry.paced = options.pace > 0;
  DdsPublisher publisher(telemetry);
  publisher.wait_for_subscriber(kSubscriberTimeoutMs);
  SlotFiles memory(options.memory, "nc"), data(options.memory, "data");
  const NcRunResult result = run_nc(
      machine,
      {.program = options.program,
       .pace = options.pace,
       .seed = options.seed,
       .piece_toml = machine.setup.piece.empty() ? "" : to_toml(load_piece(machine.setup.piece)),
       .stop = &stop_requested(),
       .faults = parse_faults(options.faults),
       .answer_timeout_ms = options.answer_timeout_ms,
       .memory = options.memory.empty() ? nullptr : &memory,
       .data = options.memory.empty() ? nullptr : &data,
       .on_power_return =
           options.on_power_return == "resume" ? OnPowerReturn::resume : OnPowerReturn::end,
       .resume = options.resume,
       .operations = read_operations(options.operations),
       .player = player_options(options)},
      *transport, publisher);
  for (const std::string& fault : result.struck) ControlPipe(options.control_fd).struck(fault);
  for (const std::string& text : result.never_operated)
    ControlPipe(options.control_fd)
        .note("--operate \"" + text + "\": there was no occasion for it");
  if (result.exit_code() == kExitFailure) std::cerr << result.end.reason;
  return result.exit_code();
}

}  // namespace

int main(int argc, char** argv) { return vcnc::guarded_main("vcnc-nc", nc, argc, argv); }
