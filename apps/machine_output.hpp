// Where a command writes a machine file; nothing else of the user's is ever lost there.
#pragma once

#include <string>

namespace vcnc {

/// Throws InputError unless `out` is a new file in a folder that can be written to, or an earlier
/// machine file.
void check_machine_output(const std::string& out);

}  // namespace vcnc
