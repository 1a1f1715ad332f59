#include "bus/run_node.hpp"

#include "bus/node_shell.hpp"

namespace vcnc {

NodeExit run_node(Node& node, Transport& bus, const std::atomic<bool>* stop) {
  constexpr int kStopCheckMs = 100;
  NodeShell shell(node);
  Frames arrived, answer;
  shell.boot(answer);
  bus.send(answer);
  while (stop == nullptr || !stop->load(std::memory_order_relaxed)) {
    arrived.clear();
    switch (bus.receive(arrived, stop == nullptr ? -1 : kStopCheckMs)) {
      case Transport::Received::timeout:
        continue;
      case Transport::Received::closed:
        return NodeExit::closed;
      case Transport::Received::frames:
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

}  // namespace vcnc
