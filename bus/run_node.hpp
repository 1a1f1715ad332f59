// Runs one node in a process of its own: receive, step, send, until the bus says stop.
//
// Whatever ends it, the node is then stepped alone, free-running and without inputs, until it is at
// rest: a drive brakes on its own when its commands are lost.
#pragma once

#include <atomic>

#include "bus/node.hpp"
#include "bus/transport.hpp"

namespace vcnc {

enum class NodeExit {
  stopped,      ///< NMT stop
  closed,       ///< the bus is gone, or no SYNC has come for too long
  interrupted,  ///< `stop` was set
};

/// What a node did alone after the bus had ended.
struct RunDown {
  Tick cycles = 0;
  bool at_rest = true;
};

inline constexpr Tick kLongestRunDown = 10000;  ///< cycles

struct RunNodeOptions {
  const std::atomic<bool>* stop = nullptr;  ///< set from outside
  /// Once in operation, so long without a frame means that the bus is gone; 0: for ever.
  int silence_timeout_ms = 0;
  RunDown* run_down = nullptr;  ///< filled in if given
};

/// Throws BusError if the bus fails.
NodeExit run_node(Node& node, Transport& bus, const RunNodeOptions& options = {});

/// Steps a node alone from cycle k on until it is at rest.
RunDown run_down(Node& node, Tick k);

}  // namespace vcnc
