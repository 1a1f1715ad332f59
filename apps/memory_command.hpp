// `vcnc memory` shows what a machine keeps while it is off, `vcnc reset` is the operator's reset.
#pragma once

#include <string>

namespace vcnc {

/// Prints what the memory holds. Throws InputError.
void memory_command(const std::string& folder);

/// Prints what was latched and opens it: spindle lock, overtravel latches, an interrupted program.
/// Whether the cause is gone nobody can see while the machine is off: the protection judges anew as
/// soon as it is switched on, and latches again if it is not. A damaged memory is made anew.
/// Throws InputError.
void reset_command(const std::string& folder);

}  // namespace vcnc
