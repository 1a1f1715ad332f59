// The bus inside one process: the same frames and the same protocol, moved by function calls.
//
// send() of the master runs every node that a SYNC in the slot addresses, in the order given, at
// once; their answers wait for receive(). Nodes see each other's frames in the next cycle only, as
// on every transport, so the order does not matter. One thread; no allocation once the buffers have
// grown.
#pragma once

#include <vector>

#include "bus/node_shell.hpp"
#include "bus/transport.hpp"

namespace vcnc {

class InprocTransport : public Transport {
 public:
  /// The nodes outlive the transport.
  explicit InprocTransport(const std::vector<Node*>& nodes);

  void send(std::span<const Frame> slot) override;
  /// Never waits: nothing can arrive later on a bus of one thread.
  Received receive(Frames& into, int timeout_ms) override;

 private:
  std::vector<NodeShell> shells_;
  Frames said_;   ///< stays empty: a node says nothing to a frame of another node
  Frames inbox_;  ///< of the master
  struct Said {
    std::size_t shell;
    std::size_t begin, end;  ///< in inbox_
  };
  std::vector<Said> round_;
};

}  // namespace vcnc
