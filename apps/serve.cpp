#include "apps/serve.hpp"

#include <iostream>

#include "apps/control_pipe.hpp"
#include "bus/run_node.hpp"
#include "bus/transport.hpp"

namespace vcnc {

int serve(Node& node, const NodeOptions& options) {
  const auto transport = open_transport(options.bus, node.id());
  ControlPipe(options.control_fd).ready();
  if (run_node(node, *transport) == NodeExit::stopped) return kExitOk;
  std::cerr << "the bus is gone";
  return kExitBusGone;
}

}  // namespace vcnc
