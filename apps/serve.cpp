#include "apps/serve.hpp"

#include <cstdio>
#include <iostream>

#include "apps/control_pipe.hpp"
#include "apps/faults.hpp"
#include "bus/canopen_device.hpp"
#include "bus/run_node.hpp"
#include "bus/transport.hpp"

namespace vcnc {

namespace {

/// "came to rest 0.120 s after the bus was lost"
void tell(const RunDown& alone, const ControlPipe& launcher) {
  char text[80];
  std::snprintf(text, sizeof text,
                alone.at_rest ? "came to rest %.3f s after the bus was lost"
                              : "was still moving %.3f s after the bus was lost",
                seconds(alone.cycles));
  launcher.note(text);
}

}  // namespace

int serve(Node& node, const NodeOptions& options, const std::function<std::string()>& last_word) {
  CanopenDevice device(node);
  FaultedNode faulted(device, parse_faults(options.faults));
  Node& module = faulted.harmless() ? static_cast<Node&>(device) : faulted;
  const auto transport = open_transport(options.bus, node.id());
  const ControlPipe launcher(options.control_fd);
  launcher.ready();
  RunDown alone;
  // The NC unit may wait for another module, so the patience with it is longer than its own.
  const NodeExit exit =
      run_node(module, *transport,
               {.silence_timeout_ms = 2 * options.answer_timeout_ms, .run_down = &alone});
  for (const std::string& fault : faulted.struck()) launcher.struck(fault);
  if (exit == NodeExit::stopped) return kExitOk;
  if (alone.cycles > 0) tell(alone, launcher);
  if (const std::string word = last_word ? last_word() : ""; !word.empty()) launcher.note(word);
  std::cerr << "the bus is gone";
  return kExitBusGone;
}

}  // namespace vcnc
