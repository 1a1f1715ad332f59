// One run of the NC unit over a given transport, told to a telemetry sink from begin to end.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "bus/telemetry.hpp"
#include "bus/transport.hpp"
#include "model/machine.hpp"

namespace vcnc {

struct NcRunOptions {
  std::string program;  ///< path of the G-code
  double pace = 0;      ///< times real time, 0 = free-running
  std::uint64_t seed = 1;
  std::string piece_toml;                   ///< for the record
  const std::atomic<bool>* stop = nullptr;  ///< set: end the run in order (Ctrl-C)
};

struct NcRunResult {
  RunEnd end;
  bool alarmed = false;      ///< the machine stopped in an alarm
  bool interrupted = false;  ///< Ctrl-C
  int exit_code() const;
};

/// Plays the program. Throws ProgramError and BusError before anything moves; what goes wrong later
/// is in the result.
NcRunResult run_nc(const Machine& machine, const NcRunOptions& options, Transport& transport,
                   TelemetrySink& sink);

}  // namespace vcnc
