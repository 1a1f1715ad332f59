#include "bus/truth.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>

namespace vcnc {

namespace {

/// The cycles k and k+1 of every axis: a drive may be one cycle ahead of the probe's reading.
class TruthStore {
 public:
  void put(std::size_t axis, const TruthCycle& cycle) {
    cycles_.at(axis)[slot(cycle.tick)] = cycle;
  }
  bool get(Tick k, std::array<TruthCycle, kTruthAxes>& out) const {
    if (k < 0) return false;
    bool all = true;
    for (std::size_t axis = 0; axis < kTruthAxes; ++axis) {
      const TruthCycle& cycle = cycles_[axis][slot(k)];
      if (cycle.tick == k)
        out[axis] = cycle;
      else
        all = false;
    }
    return all;
  }

 private:
  static std::size_t slot(Tick k) { return static_cast<std::size_t>(k & 1); }
  std::array<std::array<TruthCycle, 2>, kTruthAxes> cycles_;
};

class LocalTruth : public TruthPort {
 public:
  void publish(std::size_t axis, const TruthCycle& cycle) override { store_.put(axis, cycle); }
  bool collect(Tick k, std::array<TruthCycle, kTruthAxes>& out) override {
    return store_.get(k, out);
  }

 private:
  TruthStore store_;
};

// A datagram: axis, tick, positions; 64-bit little-endian words.
constexpr std::size_t kWords = 2 + kLoopStepsPerCycle;
using Datagram = std::array<std::uint8_t, 8 * kWords>;

void put_word(Datagram& bytes, std::size_t word, std::uint64_t value) {
  for (std::size_t i = 0; i < 8; ++i)
    bytes[8 * word + i] = static_cast<std::uint8_t>(value >> (8 * i));
}
std::uint64_t get_word(const Datagram& bytes, std::size_t word) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value |= std::uint64_t{bytes[8 * word + i]} << (8 * i);
  return value;
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw TruthError(fmt::format("truth channel \"{}\": the path must have 1 to {} characters",
                                 path, sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

/// One end of the channel between processes. The kernel queues at least 10 datagrams of a
/// SOCK_DGRAM reader: the five of cycle k and, before the probe reads them, the five of k+1.
class TruthSocket : public TruthPort {
 public:
  explicit TruthSocket(const std::string& path) : path_(path), address_(address_of(path)) {
    fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd_ < 0) throw TruthError(fmt::format("truth channel: {}", std::strerror(errno)));
  }
  ~TruthSocket() override { ::close(fd_); }
  TruthSocket(const TruthSocket&) = delete;
  TruthSocket& operator=(const TruthSocket&) = delete;

  void publish(std::size_t, const TruthCycle&) override {
    throw std::logic_error("the reader of the truth channel cannot publish");
  }
  bool collect(Tick, std::array<TruthCycle, kTruthAxes>&) override {
    throw std::logic_error("a writer of the truth channel cannot collect");
  }
  std::uint64_t dropped() const override { return dropped_; }

 protected:
  const sockaddr* address() const { return reinterpret_cast<const sockaddr*>(&address_); }

  std::string path_;
  sockaddr_un address_;
  int fd_ = -1;
  std::uint64_t dropped_ = 0;
};

class TruthWriter : public TruthSocket {
 public:
  using TruthSocket::TruthSocket;

  void publish(std::size_t axis, const TruthCycle& cycle) override {
    Datagram bytes{};
    put_word(bytes, 0, axis);
    put_word(bytes, 1, static_cast<std::uint64_t>(cycle.tick));
    for (std::size_t i = 0; i < cycle.position.size(); ++i)
      put_word(bytes, 2 + i, std::bit_cast<std::uint64_t>(cycle.position[i]));
    ssize_t sent;
    do {
      sent = ::sendto(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL, address(),
                      sizeof address_);
    } while (sent < 0 && errno == EINTR);
    if (sent != static_cast<ssize_t>(bytes.size())) ++dropped_;
  }
};

class TruthReader : public TruthSocket {
 public:
  explicit TruthReader(const std::string& path) : TruthSocket(path) {
    ::unlink(path.c_str());  // of a run that was killed
    if (::bind(fd_, address(), sizeof address_) != 0)
      throw TruthError(fmt::format("truth channel \"{}\": {}", path, std::strerror(errno)));
  }
  ~TruthReader() override { ::unlink(path_.c_str()); }

  bool collect(Tick k, std::array<TruthCycle, kTruthAxes>& out) override {
    Datagram bytes{};
    for (;;) {
      const ssize_t got = ::recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_TRUNC);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) break;  // nothing more is there
      take(bytes, static_cast<std::size_t>(got));
    }
    return store_.get(k, out);
  }

 private:
  void take(const Datagram& bytes, std::size_t size) {
    const std::uint64_t axis = get_word(bytes, 0);
    if (size != bytes.size() || axis >= kTruthAxes) {
      ++dropped_;
      return;
    }
    TruthCycle cycle{.tick = static_cast<Tick>(get_word(bytes, 1))};
    for (std::size_t i = 0; i < cycle.position.size(); ++i)
      cycle.position[i] = std::bit_cast<double>(get_word(bytes, 2 + i));
    store_.put(axis, cycle);
  }

  TruthStore store_;
};

}  // namespace

std::unique_ptr<TruthPort> open_local_truth() { return std::make_unique<LocalTruth>(); }

std::unique_ptr<TruthPort> open_truth_reader(const std::string& path) {
  return std::make_unique<TruthReader>(path);
}

std::unique_ptr<TruthPort> open_truth_writer(const std::string& path) {
  return std::make_unique<TruthWriter>(path);
}

}  // namespace vcnc
