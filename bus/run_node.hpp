// Runs one node in a process of its own: receive, step, send, until the bus says stop.
#pragma once

#include <atomic>

#include "bus/node.hpp"
#include "bus/transport.hpp"

namespace vcnc {

enum class NodeExit {
  stopped,      ///< NMT stop
  closed,       ///< the bus is gone
  interrupted,  ///< `stop` was set
};

/// Throws BusError if the bus fails.
NodeExit run_node(Node& node, Transport& bus, const std::atomic<bool>* stop = nullptr);

}  // namespace vcnc
