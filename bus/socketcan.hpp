// Linux SocketCAN as the bus: CAN_RAW sockets with FD frames.
//
// A virtual CAN interface drops frames silently when a reader's buffer is full; only SO_RXQ_OVFL
// tells. It is always on and feeds lost(). The buffer is enlarged to 4 MB if the host allows.
//
//   ip link add dev vcan0 type vcan && ip link set vcan0 mtu 72 up
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "bus/fd.hpp"
#include "bus/transport.hpp"

struct msghdr;

namespace vcnc {

class SocketcanTransport : public Transport {
 public:
  /// Throws BusError with the remedy if the interface is not there, is down or cannot carry FD
  /// frames.
  explicit SocketcanTransport(const std::string& interface);
  ~SocketcanTransport() override;

  void send(std::span<const Frame> slot) override;
  Received receive(Frames& into, int timeout_ms) override;
  std::uint64_t lost() const override { return lost_; }

  /// Frames with a length that no frame of their kind can have; not handed on.
  std::uint64_t malformed() const { return malformed_; }
  /// Extended, remote and error frames, which this bus does not use; not handed on.
  std::uint64_t foreign() const { return foreign_; }

  /// Wished receive buffer in bytes; the host may give less.
  void set_receive_buffer(int bytes);

 private:
  struct Buffers;
  void send_batch(std::size_t count);
  int receive_batch(Frames& into);
  void note_overflow(msghdr& header);

  std::string interface_;
  Fd fd_;
  std::uint64_t lost_ = 0;
  std::uint32_t overflow_ = 0;  ///< the kernel's counter of dropped frames
  std::uint64_t malformed_ = 0;
  std::uint64_t foreign_ = 0;
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace vcnc
