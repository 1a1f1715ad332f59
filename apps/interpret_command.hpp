// `vcnc interpret`: the path a program describes, before any planning.
#pragma once

#include <string>
#include <vector>

namespace vcnc {

struct InterpretOptions {
  std::string program, json, machine, tools, tools_unit = "mm", dialect = "auto";
  std::vector<std::string> assignments, program_path;
  bool block_delete = false;
};

/// Writes the path; what the file holds: apps/path_writer.hpp. Returns the exit code: 1 where the
/// program is refused. Throws InputError for wrong files.
int interpret_command(const InterpretOptions& options);

}  // namespace vcnc
