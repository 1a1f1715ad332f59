// Runs one module of the machine as a process: opens the bus, says ready, answers until it is
// stopped.
#pragma once

#include "apps/node_options.hpp"
#include "bus/node.hpp"

namespace vcnc {

/// Exit code of the process. Throws BusError.
int serve(Node& node, const NodeOptions& options);

}  // namespace vcnc
