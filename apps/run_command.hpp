// `vcnc run`: the whole machine plays a program, the analysis watches, the results land in a
// folder.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/program_options.hpp"

namespace vcnc {

struct RunOptions {
  std::string program;
  std::string machine;
  std::vector<std::string> assignments;  ///< --set key=value
  std::vector<std::string> injections;   ///< --inject key=value
  std::vector<std::string> faults;       ///< --fault, in the text form of bus/fault.hpp
  int random_faults = 0;                 ///< --random-faults: so many more, drawn from the seed
  double answer_timeout_s = 5;           ///< the NC unit's patience with a module, in host time
  std::string bus = "hub://";            ///< hub:// picks a path of its own
  double pace = 0;                       ///< times real time, 0 = free-running
  std::uint64_t seed = 1;
  std::string out;
  bool in_process = false;
  bool csv = false;
  bool report = true;
  std::vector<std::string> operations;  ///< --operate, see apps/operations.hpp
  ProgramChoice how;                    ///< where the program begins, what it skips, its tools
  std::string memory;  ///< folder of what the machine keeps while it is off; empty: none
  std::string on_power_return = "end";
  bool resume = false;  ///< go on with the program that was interrupted
};

/// Exit code of the program (apps/node_options.hpp). Throws InputError before anything is written.
int run_command(RunOptions options);

}  // namespace vcnc
