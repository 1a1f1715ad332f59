#include <algorithm>
#include <cerrno>

#include "bus/fd.hpp"
#include "bus/hub.hpp"
#include "bus/hub_socket.hpp"
#include "bus/messages.hpp"
#include "bus/slot_codec.hpp"

namespace vcnc {

namespace {

constexpr int kWelcomeTimeoutMs = 5000;

void set_timeout(int fd, int timeout_ms) {
  timeval time{};  // zero: for ever
  if (timeout_ms > 0) {
    time.tv_sec = timeout_ms / 1000;
    time.tv_usec = timeout_ms % 1000 * 1000;
  }
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &time, sizeof time);
}

/// A call on a socket with a time limit ends with EINTR when the process was stopped and goes on,
/// even without a handler (signal(7)).
template <class Call>
ssize_t uninterrupted(Call call) {
  ssize_t result;
  do {
    result = call();
  } while (result < 0 && errno == EINTR);
  return result;
}

/// Sent at once, with what was kept back for it.
bool is_answered(const Frame& frame) {
  return frame.id == kSyncId || frame.id == kNmtId || is_sdo(frame.id);
}

}  // namespace

HubTransport::HubTransport(const std::string& path, int node_id)
    : master_(node_id == 0), tap_(node_id == kTapId), incoming_(1 << 18) {
  const sockaddr_un address = hub_address(path);
  if (node_id < 0 || (node_id > 127 && node_id != kTapId))
    throw BusError(
        fmt::format("hub \"{}\": node id {}: allowed are 0..127 and 255", path, node_id));
  fd_ = Fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (!fd_.valid() || connect_to(fd_.get(), address) != 0)
    throw BusError(
        fmt::format("no hub at \"{}\" ({}): is the machine running?", path, std::strerror(errno)));
  const std::uint8_t hello[kHelloSize] = {'V', 'C', 'H', kHubVersion,
                                          static_cast<std::uint8_t>(node_id)};
  set_timeout(fd_.get(), kWelcomeTimeoutMs);
  std::uint8_t reply = 0;
  const auto say = [&] { return ::send(fd_.get(), hello, sizeof hello, MSG_NOSIGNAL); };
  const auto hear = [&] { return ::recv(fd_.get(), &reply, 1, 0); };
  if (uninterrupted(say) != sizeof hello || uninterrupted(hear) != 1)
    throw BusError(fmt::format("hub \"{}\" does not answer", path));
  switch (Welcome{reply}) {
    case Welcome::ok:
      break;
    case Welcome::id_in_use:
      throw BusError(fmt::format("hub \"{}\": node id {} is already on the bus", path, node_id));
    case Welcome::wrong_version:
      throw BusError(fmt::format("hub \"{}\" speaks another version of the protocol", path));
  }
  set_timeout(fd_.get(), timeout_ms_);
}

void HubTransport::send(std::span<const Frame> slot) {
  if (tap_) throw BusError("a passive listener cannot send");
  append_slot(slot, outgoing_);
  if (outgoing_.size() > kLargestSlot)
    throw BusError(fmt::format("a slot of {} bytes is too large for the hub: {} are allowed",
                               outgoing_.size(), kLargestSlot));
  if (outgoing_.empty()) return;
  if (master_ && std::none_of(slot.begin(), slot.end(), is_answered)) return;
  const ssize_t sent = uninterrupted(
      [&] { return ::send(fd_.get(), outgoing_.data(), outgoing_.size(), MSG_NOSIGNAL); });
  outgoing_.clear();
  // That the hub is gone is told by receive(), behind what it said before.
  if (sent < 0 && errno != EPIPE && errno != ECONNRESET)
    throw BusError(fmt::format("hub: cannot send: {}", std::strerror(errno)));
}

Transport::Received HubTransport::receive(Frames& into, int timeout_ms) {
  if (timeout_ms != 0 && timeout_ms != timeout_ms_) {
    set_timeout(fd_.get(), timeout_ms);
    timeout_ms_ = timeout_ms;
  }
  for (;;) {
    const ssize_t got = ::recv(fd_.get(), incoming_.data(), incoming_.size(),
                               MSG_TRUNC | (timeout_ms == 0 ? MSG_DONTWAIT : 0));
    if (got == 0) return Received::closed;
    if (got < 0) {
      if (errno == EAGAIN || errno == EWOULDBLOCK) return Received::timeout;
      // A reset is told once, ahead of what the hub said before it closed.
      if (errno == EINTR || errno == ECONNRESET) continue;
      throw BusError(fmt::format("hub: cannot receive: {}", std::strerror(errno)));
    }
    const auto size = static_cast<std::size_t>(got);
    if (size < kLostHeader || size > incoming_.size() ||
        !parse_slot({incoming_.data() + kLostHeader, size - kLostHeader}, into))
      throw BusError("hub: received a datagram that is no slot");
    lost_ = 0;
    for (std::size_t i = 0; i < kLostHeader; ++i) lost_ |= std::uint64_t{incoming_[i]} << (8 * i);
    if (size > kLostHeader) return Received::frames;
  }
}

}  // namespace vcnc
