// The commands of vcnc and their options.
#pragma once

namespace vcnc {

/// Runs what the arguments ask for; the exit code (apps/node_options.hpp). Throws InputError.
int command_line(int argc, char** argv);

}  // namespace vcnc
