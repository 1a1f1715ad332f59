// Moves frames between the modules. A transport knows bytes and sockets, no meaning.
//
//   inproc://            function calls inside one process (bus/inproc.hpp)
//   hub:///path.sock     embedded hub over AF_UNIX SOCK_SEQPACKET (bus/hub.hpp)
//   can://vcan0          Linux SocketCAN with CAN FD (bus/socketcan.hpp)
#pragma once

#include <memory>
#include <span>
#include <stdexcept>
#include <string>

#include "bus/frame.hpp"

namespace vcnc {

/// A bus that cannot be opened or that failed: one sentence saying what and, if known, the remedy.
class BusError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Transport {
 public:
  enum class Received { frames, timeout, closed };

  virtual ~Transport() = default;

  /// Sends one slot: all frames a module has to say at this moment, in order.
  virtual void send(std::span<const Frame> slot) = 0;

  /// Appends what arrived to `into`, waiting up to timeout_ms for the first frame (-1: for ever).
  /// `closed`: the other side is gone and nothing is left to read.
  virtual Received receive(Frames& into, int timeout_ms) = 0;

  /// Frames the operating system dropped on the way to us so far.
  virtual std::uint64_t lost() const { return 0; }
};

/// Opens hub:// or can:// for a module with the given node id (0: the master).
/// Throws BusError for an unknown scheme or a bus that is not there.
std::unique_ptr<Transport> open_transport(const std::string& uri, int node_id);

}  // namespace vcnc
