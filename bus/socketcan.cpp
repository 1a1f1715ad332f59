#include "bus/socketcan.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace vcnc {

namespace {

constexpr std::size_t kBatch = 64;
constexpr int kReceiveBuffer = 4 << 20;
constexpr int kSendPatienceMs = 1000;
constexpr std::uint8_t kFdfFlag = 0x04;  // CANFD_FDF, missing in older kernel headers

[[noreturn]] void fail(const std::string& interface, int error) {
  const auto text = [&](std::string_view what) {
    return BusError(fmt::format("can://{}: {}", interface, what));
  };
  switch (error) {
    case ENODEV:
    case ENXIO:
      throw text(
          fmt::format("there is no such interface; make it with: ip link add dev {0} type "
                      "vcan && ip link set {0} mtu 72 up",
                      interface));
    case ENETDOWN:
      throw text(
          fmt::format("the interface is down; bring it up with: ip link set {} up", interface));
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
      throw text("this kernel has no CAN; load it with: modprobe can_raw, or use hub://");
    case EPERM:
    case EACCES:
      throw text("not permitted to open a CAN socket here");
    case ENOBUFS:
      throw text(
          fmt::format("the send queue stayed full for {} ms; enlarge it with: ip link set {} "
                      "txqueuelen 1000",
                      kSendPatienceMs, interface));
    default:
      throw text(std::strerror(error));
  }
}

std::size_t to_kernel(const Frame& frame, canfd_frame& out) {
  out = {};
  out.can_id = frame.id;
  out.len = frame.len;
  if (frame.fd) out.flags = CANFD_BRS | kFdfFlag;
  std::memcpy(out.data, frame.data.data(), frame.len);
  return frame.fd ? CANFD_MTU : CAN_MTU;
}

}  // namespace

struct SocketcanTransport::Buffers {
  std::array<canfd_frame, kBatch> frames;
  std::array<iovec, kBatch> pieces;
  std::array<mmsghdr, kBatch> messages;
  alignas(cmsghdr) std::array<std::array<char, 64>, kBatch> control;
};

SocketcanTransport::SocketcanTransport(const std::string& interface)
    : interface_(interface), buffers_(std::make_unique<Buffers>()) {
  if (interface.empty() || interface.size() >= IFNAMSIZ) fail(interface, ENODEV);
  fd_ = Fd(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  if (!fd_.valid()) fail(interface, errno);
  ifreq request{};
  std::memcpy(request.ifr_name, interface.data(), interface.size());
  if (::ioctl(fd_.get(), SIOCGIFMTU, &request) != 0) fail(interface, errno);
  if (request.ifr_mtu < static_cast<int>(CANFD_MTU))
    throw BusError(fmt::format(
        "can://{0}: the interface does not carry CAN FD frames; allow them with: ip link set {0} "
        "down mtu 72 && ip link set {0} up",
        interface));
  if (::ioctl(fd_.get(), SIOCGIFFLAGS, &request) != 0) fail(interface, errno);
  if ((request.ifr_flags & IFF_UP) == 0) fail(interface, ENETDOWN);
  const int on = 1;
  set_receive_buffer(kReceiveBuffer);
  ::setsockopt(fd_.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
  if (::setsockopt(fd_.get(), SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) != 0)
    fail(interface, errno);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  if (::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    fail(interface, errno);
}

SocketcanTransport::~SocketcanTransport() = default;

void SocketcanTransport::set_receive_buffer(int bytes) {
  if (::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0)
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
}

void SocketcanTransport::send(std::span<const Frame> slot) {
  while (!slot.empty()) {
    const std::size_t count = std::min(slot.size(), kBatch);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t size = to_kernel(slot[i], buffers_->frames[i]);
      buffers_->pieces[i] = {&buffers_->frames[i], size};
      buffers_->messages[i] = {};
      buffers_->messages[i].msg_hdr.msg_iov = &buffers_->pieces[i];
      buffers_->messages[i].msg_hdr.msg_iovlen = 1;
    }
    send_batch(count);
    slot = slot.subspan(count);
  }
}

void SocketcanTransport::send_batch(std::size_t count) {
  std::size_t done = 0;
  int waited_ms = 0;
  while (done < count) {
    const int sent = ::sendmmsg(fd_.get(), buffers_->messages.data() + done,
                                static_cast<unsigned>(count - done), 0);
    if (sent > 0) {
      done += static_cast<std::size_t>(sent);
      waited_ms = 0;
    } else if (errno == ENOBUFS || errno == EAGAIN) {
      // POLLOUT is of no use here: the socket is writable, the queue of the interface is full.
      if (++waited_ms > kSendPatienceMs) fail(interface_, ENOBUFS);
      ::poll(nullptr, 0, 1);
    } else if (errno != EINTR) {
      fail(interface_, errno);
    }
  }
}

Transport::Received SocketcanTransport::receive(Frames& into, int timeout_ms) {
  const std::size_t known = into.size();
  for (;;) {
    const int got = receive_batch(into);
    if (into.size() > known) return Received::frames;
    if (got > 0) continue;  // only frames that are not ours
    if (timeout_ms == 0) return Received::timeout;
    pollfd ready{fd_.get(), POLLIN, 0};
    const int events = ::poll(&ready, 1, timeout_ms);
    if (events == 0) return Received::timeout;
    if (events < 0 && errno != EINTR) fail(interface_, errno);
  }
}

/// Messages read; 0: none are there.
int SocketcanTransport::receive_batch(Frames& into) {
  for (std::size_t i = 0; i < kBatch; ++i) {
    buffers_->pieces[i] = {&buffers_->frames[i], sizeof(canfd_frame)};
    msghdr& header = buffers_->messages[i].msg_hdr;
    header = {};
    header.msg_iov = &buffers_->pieces[i];
    header.msg_iovlen = 1;
    header.msg_control = buffers_->control[i].data();
    header.msg_controllen = buffers_->control[i].size();
  }
  const int got = ::recvmmsg(fd_.get(), buffers_->messages.data(), kBatch, MSG_DONTWAIT, nullptr);
  if (got < 0) {
    if (errno == EAGAIN || errno == EINTR) return 0;
    fail(interface_, errno);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(got); ++i) {
    note_overflow(buffers_->messages[i].msg_hdr);
    const canfd_frame& frame = buffers_->frames[i];
    const std::size_t size = buffers_->messages[i].msg_len;
    if ((frame.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0) {
      ++foreign_;
      continue;
    }
    const bool fd = size == CANFD_MTU;
    if ((!fd && size != CAN_MTU) || !valid_length(frame.len, fd)) {
      ++malformed_;
      continue;
    }
    Frame& taken = into.emplace_back();
    taken.id = static_cast<std::uint16_t>(frame.can_id & CAN_SFF_MASK);
    taken.len = frame.len;
    taken.fd = fd;
    std::memcpy(taken.data.data(), frame.data, frame.len);
  }
  return got;
}

void SocketcanTransport::note_overflow(msghdr& header) {
  for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
    std::uint32_t total = 0;
    std::memcpy(&total, CMSG_DATA(c), sizeof total);
    lost_ += static_cast<std::uint32_t>(total - overflow_);  // the kernel's counter wraps at 32 bit
    overflow_ = total;
  }
}

}  // namespace vcnc
