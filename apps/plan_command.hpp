// `vcnc plan`: what the NC unit will command for a program, without running the machine.
#pragma once

#include <string>
#include <vector>

#include "apps/program_options.hpp"

namespace vcnc {

struct PlanOptions {
  std::string program, machine, csv;  ///< csv: where every cycle goes; empty: nowhere
  std::string dynamics;  ///< nc.dynamics instead of that of the machine file; empty: as it is
  std::vector<std::string> assignments, operations;
  ProgramChoice how;
};

/// Prints the total time and what share of its limits every axis uses. Throws InputError.
void plan_command(const PlanOptions& options);

}  // namespace vcnc
