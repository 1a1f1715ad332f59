#include "bus/run_node.hpp"

#include "bus/node_shell.hpp"

namespace vcnc {

namespace {

NodeExit serve_bus(NodeShell& shell, Transport& bus, const RunNodeOptions& options) {
  constexpr int kCheckMs = 100;
  const bool checks = options.stop != nullptr || options.silence_timeout_ms > 0;
  Frames arrived, answer;
  int silent_ms = 0;
  shell.boot(answer);
  bus.send(answer);
  while (options.stop == nullptr || !options.stop->load(std::memory_order_relaxed)) {
    arrived.clear();
    switch (bus.receive(arrived, checks ? kCheckMs : -1)) {
      case Transport::Received::timeout:
        silent_ms += kCheckMs;
        if (options.silence_timeout_ms > 0 && silent_ms >= options.silence_timeout_ms &&
            shell.state() == NmtState::operational)
          return NodeExit::closed;
        continue;
      case Transport::Received::closed:
        return NodeExit::closed;
      case Transport::Received::frames:
        silent_ms = 0;
        break;
    }
    shell.note_lost(bus.lost());
    answer.clear();
    for (const Frame& frame : arrived) shell.feed(frame, answer);
    if (!answer.empty()) bus.send(answer);
    if (shell.over()) return NodeExit::stopped;
  }
  return NodeExit::interrupted;
}

}  // namespace

RunDown run_down(Node& node, Tick k) {
  RunDown result;
  node.leave_bus();
  Frames unheard;
  for (; !node.at_rest() && result.cycles < kLongestRunDown; ++result.cycles) {
    unheard.clear();
    node.step(k + result.cycles, {}, unheard);
  }
  result.at_rest = node.at_rest();
  return result;
}

NodeExit run_node(Node& node, Transport& bus, const RunNodeOptions& options) {
  NodeShell shell(node);
  const auto rest = [&] {
    const RunDown alone = run_down(node, shell.next_tick());
    if (options.run_down != nullptr) *options.run_down = alone;
  };
  try {
    const NodeExit exit = serve_bus(shell, bus, options);
    rest();
    return exit;
  } catch (const BusError&) {
    rest();
    throw;
  }
}

}  // namespace vcnc
