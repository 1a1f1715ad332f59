// The embedded bus between processes: a hub and its clients over AF_UNIX SOCK_SEQPACKET.
//
// Batching. One datagram carries all frames of a slot. What the nodes say in a cycle is held in the
// hub and handed to the other nodes together with the master's next datagram, the one with SYNC;
// latch on SYNC makes that equivalent to handing it over at once, and a node is woken once per
// cycle. Answers for the master are held until every node that is connected has answered, or for 10
// ms; a node that did not answer the master's last datagram holds nothing up.
//
// End of file means that the module has died. The hub then speaks for a dead node: it sends the
// master a heartbeat "stopped" (700h+id, 04), so that the master can name it. When the master is
// gone the nodes' connections are closed.
//
// Taps are passive clients (node id 255) that see everything. The hub never waits for a client: a
// datagram that a full queue refuses is counted, and the client is told with the next one
// (Transport::lost).
//
// Datagrams. Client to hub: first {'V','C','H', version, node id}, answered by one byte (0 welcome,
// 1 id in use, 2 wrong version); then slots. Hub to client: u64 number of frames lost, then a slot.
// A slot is a row of {u16 id, u8 length, u8 1 = FD, payload}. All little-endian.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bus/fd.hpp"
#include "bus/transport.hpp"

namespace vcnc {

inline constexpr int kTapId = 255;  ///< node id of a passive listener

class Hub {
 public:
  /// Listens at `path` and serves in a thread of its own. Throws BusError.
  explicit Hub(const std::string& path);
  ~Hub();
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  std::string uri() const { return "hub://" + path_; }
  /// Frames that full queues of clients refused so far.
  std::uint64_t overruns() const;

 private:
  class Service;
  std::string path_;
  std::unique_ptr<Service> service_;
  std::thread thread_;
};

class HubTransport : public Transport {
 public:
  /// Throws BusError if there is no hub at `path` or it refuses this id.
  HubTransport(const std::string& path, int node_id);

  /// A master's frames wait for its next SYNC or NMT frame, with which they share a datagram.
  void send(std::span<const Frame> slot) override;
  Received receive(Frames& into, int timeout_ms) override;
  std::uint64_t lost() const override { return lost_; }

 private:
  Fd fd_;
  bool master_;
  bool tap_;
  int timeout_ms_ = -1;  ///< the one the socket is set to
  std::uint64_t lost_ = 0;
  std::vector<std::uint8_t> outgoing_;
  std::vector<std::uint8_t> incoming_;
};

}  // namespace vcnc
