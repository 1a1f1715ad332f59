// `vcnc check`: can the machine run a program?
#pragma once

#include <string>
#include <vector>

#include "apps/program_options.hpp"

namespace vcnc {

struct CheckOptions {
  std::vector<std::string> programs, assignments;
  std::string machine;
  ProgramChoice how;
};

/// Runs the whole interpretation and, with a machine, every check before motion: travel, feeds,
/// interlocks. Throws ProgramError for the first program that is refused.
void check_command(const CheckOptions& options);

}  // namespace vcnc
