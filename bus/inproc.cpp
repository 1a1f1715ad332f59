#include "bus/inproc.hpp"

namespace vcnc {

InprocTransport::InprocTransport(const std::vector<Node*>& nodes) {
  shells_.reserve(nodes.size());
  for (Node* node : nodes) shells_.emplace_back(*node);
  for (NodeShell& shell : shells_) shell.boot(inbox_);
}

void InprocTransport::send(std::span<const Frame> slot) {
  for (const Frame& frame : slot) {
    round_.clear();
    for (std::size_t i = 0; i < shells_.size(); ++i) {
      const std::size_t begin = inbox_.size();
      if (!shells_[i].over()) shells_[i].feed(frame, inbox_);
      if (inbox_.size() > begin) round_.push_back({i, begin, inbox_.size()});
    }
    // Only now, when every node has stepped, do the nodes hear each other: that is the next cycle.
    for (const Said& said : round_)
      for (std::size_t f = said.begin; f < said.end; ++f)
        for (std::size_t i = 0; i < shells_.size(); ++i)
          if (i != said.shell && !shells_[i].over()) shells_[i].feed(inbox_[f], said_);
  }
}

Transport::Received InprocTransport::receive(Frames& into, int /*timeout_ms*/) {
  if (inbox_.empty()) return Received::timeout;
  into.insert(into.end(), inbox_.begin(), inbox_.end());
  inbox_.clear();
  return Received::frames;
}

}  // namespace vcnc
