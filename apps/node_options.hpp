// Command line of the module programs (vcnc-nc, vcnc-drive, ...), which `vcnc run` starts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vcnc {

struct NodeOptions {
  std::string machine;  ///< resolved machine file
  std::string program;  ///< G-code (NC unit)
  std::string bus;      ///< transport URI
  std::string truth;    ///< path of the ground-truth channel (simulators)
  std::string axis;     ///< X Y Z A C or "spindle" (drives)
  std::string out;      ///< result directory (analysis)
  double pace = 0;      ///< times real time; 0 = free-running
  std::uint64_t seed = 1;
  std::vector<std::string> faults;  ///< in the text form of bus/fault.hpp
  int answer_timeout_ms = 5000;     ///< of host time, for each module in each cycle
  bool csv = false;                 ///< analysis: also write rows.csv
  bool no_report = false;           ///< analysis: no report.html
  std::string memory;               ///< folder of what the machine keeps while it is off
  std::vector<double>
      switched_on_at;  ///< axis positions [m, rad]; empty: those of the machine file
  std::string on_power_return = "end";
  bool resume = false;                   ///< NC unit: the program that was interrupted
  std::vector<std::string> operations;   ///< NC unit: in the text form of controller/operation.hpp
  bool block_delete = false;             ///< NC unit
  std::string dialect = "auto";          ///< NC unit: of the program
  int from_line = 0;                     ///< NC unit: the program begins there
  std::string tools, tools_unit = "mm";  ///< NC unit: tool table of LinuxCNC
  int control_fd = -1;
};

/// What a module program needs; each letter enables one option: m machine, p program and pace,
/// b bus, faults and answer time-out, t truth, a axis, o out, s seed, k memory, w where the axes
/// are switched on.
NodeOptions parse_node_options(int argc, char** argv, const char* description, const char* needs);

/// Runs a program's body: prints an exception as one line on stderr and turns it into exit code 2
/// for bad input (InputError) or 1 for everything else.
int guarded_main(const char* name, int (*body)(int, char**), int argc, char** argv);

/// Exit codes of every program.
inline constexpr int kExitOk = 0, kExitFailure = 1, kExitBadInput = 2, kExitAlarm = 3,
                     kExitInterrupted = 130;
/// Of a module only: it ended because the bus did, so the cause is elsewhere.
inline constexpr int kExitBusGone = 4;

}  // namespace vcnc
