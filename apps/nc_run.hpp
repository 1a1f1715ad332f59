// One run of the NC unit over a given transport, told to a telemetry sink from begin to end.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "bus/fault.hpp"
#include "bus/main_loop.hpp"
#include "bus/telemetry.hpp"
#include "bus/transport.hpp"
#include "controller/nc_unit.hpp"
#include "model/machine.hpp"

namespace vcnc {

struct NcRunOptions {
  std::string program;  ///< path of the G-code
  double pace = 0;      ///< times real time, 0 = free-running
  std::uint64_t seed = 1;
  std::string piece_toml;                   ///< for the record
  const std::atomic<bool>* stop = nullptr;  ///< set: end the run in order (Ctrl-C)
  BusFaults faults{};                       ///< in simulated time; the modules have the same
  int answer_timeout_ms = 5000;             ///< of host time, for each module in each cycle
  std::vector<FrameTap*> taps{};            ///< see every frame
  NodeMemory* memory = nullptr;             ///< of the NC unit
  NodeMemory* data = nullptr;               ///< its offsets, parameters and tools
  OnPowerReturn on_power_return = OnPowerReturn::end;
  bool resume = false;                  ///< the program that the memory says was interrupted
  std::vector<Operation> operations{};  ///< what the operator does at the panel
  PlayerOptions player{};
};

struct NcRunResult {
  RunEnd end;
  bool alarmed = false;               ///< the machine stopped in an alarm
  bool interrupted = false;           ///< Ctrl-C
  bool node_lost = false;             ///< a module's program failed
  std::vector<std::string> struck{};  ///< faults of the NC unit that have had an effect
  std::vector<std::string> never_operated{};
  int exit_code() const;
};

/// Plays the program. Throws ProgramError and BusError before anything moves; what goes wrong later
/// is in the result.
NcRunResult run_nc(const Machine& machine, const NcRunOptions& options, Transport& transport,
                   TelemetrySink& sink);

}  // namespace vcnc
