// How a program is to be taken, as people say it on a command line: for run, plan and check.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/node_options.hpp"
#include "controller/player.hpp"
#include "model/machine.hpp"

namespace vcnc {

struct ProgramChoice {
  std::vector<std::string> program_path;  ///< folders, searched before those of the machine
  std::string tools, tools_unit = "mm";   ///< LinuxCNC tool table instead of the machine's tools
  std::string from_block;                 ///< N word, "N40" or "40"
  int from_line = 0;
  bool block_delete = false;
  std::string dialect = "auto";
  std::string memory;    ///< folder of what the machine keeps; empty or not there yet: nothing
  bool resumed = false;  ///< what it kept when the interrupted program began
};

/// The machine with the folders on its path.
Machine with_program_path(Machine machine, const std::vector<std::string>& folders);

/// Throws InputError naming the option, or the file.
PlayerOptions player_options(const ProgramChoice& options, const std::string& program);

/// As the command line of the NC unit says it.
PlayerOptions player_options(const NodeOptions& options);

/// "auto", "ngc", "fanuc" or "siemens".
InterpreterOptions::Dialect dialect_of(const std::string& name);

/// Tool table of a file in "mm" or "inch". Throws InputError.
ToolTable read_tools(const std::string& path, const std::string& unit);

/// "from line 12: X 10.0000 ..."; empty for a program that begins at its begin.
std::string text_of_begin(const Player& player);

}  // namespace vcnc
