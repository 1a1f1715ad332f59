// `vcnc memory` shows what a machine keeps while it is off, `vcnc reset` is the operator's reset.
#pragma once

#include <string>

namespace vcnc {

struct MemoryOptions {
  std::string folder;
  std::string write_tools, read_tools, tools_unit = "mm";  ///< files; empty: none
  std::string write_parameters;
  bool forget = false;  ///< offsets, parameters and tools
};

/// Prints what the memory holds, after the changes asked for. Throws InputError.
void memory_command(const MemoryOptions& options);

/// Prints what was latched and opens it: spindle lock, overtravel latches, an interrupted program.
/// Whether the cause is gone nobody can see while the machine is off: the protection judges anew as
/// soon as it is switched on, and latches again if it is not. Offsets, parameters and tools stay. A
/// damaged memory is made anew.
/// Throws InputError.
void reset_command(const std::string& folder);

}  // namespace vcnc
