// vcnc-nc: the NC unit. Master of the bus, plays the program, publishes the samples over DDS.
#include <iostream>

#include "apps/faults.hpp"
#include "apps/nc_run.hpp"
#include "apps/node_options.hpp"
#include "apps/stop_signal.hpp"
#include "bus/dds/dds_publisher.hpp"
#include "configs/config.hpp"

namespace {

constexpr int kSubscriberTimeoutMs = 15000;

int nc(int argc, char** argv) {
  using namespace vcnc;
  const NodeOptions options = parse_node_options(argc, argv, "The NC unit", "mpbs");
  const Machine machine = load_machine(options.machine);
  catch_stop_signals();
  const auto transport = open_transport(options.bus, 0);
  DdsPublisherOptions telemetry;
  telemetry.paced = options.pace > 0;
  DdsPublisher publisher(telemetry);
  publisher.wait_for_subscriber(kSubscriberTimeoutMs);
  const NcRunResult result = run_nc(
      machine,
      {.program = options.program,
       .pace = options.pace,
       .seed = options.seed,
       .piece_toml = machine.setup.piece.empty() ? "" : to_toml(load_piece(machine.setup.piece)),
       .stop = &stop_requested(),
       .faults = parse_faults(options.faults),
       .answer_timeout_ms = options.answer_timeout_ms},
      *transport, publisher);
  if (result.exit_code() == kExitFailure) std::cerr << result.end.reason;
  return result.exit_code();
}

}  // namespace

int main(int argc, char** argv) { return vcnc::guarded_main("vcnc-nc", nc, argc, argv); }
