// Runs one module of the machine as a process: opens the bus, says ready, answers until it is
// stopped.
#pragma once

#include <functional>
#include <string>

#include "apps/node_options.hpp"
#include "bus/node.hpp"

namespace vcnc {

/// Exit code of the process. Throws BusError.
/// `last_word`: what else to note when the bus was lost, empty: nothing.
int serve(Node& node, const NodeOptions& options,
          const std::function<std::string()>& last_word = nullptr);

}  // namespace vcnc
