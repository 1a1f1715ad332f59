#include "bus/hub.hpp"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "bus/fd.hpp"
#include "bus/hub_socket.hpp"
#include "bus/messages.hpp"
#include "bus/slot_codec.hpp"

namespace vcnc {

namespace {

constexpr int kIdleFlushMs = 10;  // how long answers wait for those that are missing
constexpr int kNoId = -1;

struct Client {
  Fd fd;
  int id = kNoId;
  std::uint64_t lost = 0;  ///< frames its full queue refused
  bool answered = false;   ///< since the master's last datagram
  bool behind = false;     ///< did not answer the one before: nobody waits for it
  bool gone = false;
  std::vector<std::uint8_t> said;  ///< held for the other nodes
  std::size_t said_frames = 0;
};

bool is_node(const Client& c) { return !c.gone && c.id >= 1 && c.id <= 127; }
bool is_master(const Client& c) { return !c.gone && c.id == 0; }
bool is_tap(const Client& c) { return !c.gone && c.id == kTapId; }

iovec piece(const std::uint8_t* data, std::size_t size) {
  return {const_cast<std::uint8_t*>(data), size};
}
iovec piece(const std::vector<std::uint8_t>& bytes) { return piece(bytes.data(), bytes.size()); }

/// A socket file that nobody listens at any more is in the way of a new hub.
void remove_if_dead(const std::string& path, const sockaddr_un& address) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0 || !S_ISSOCK(status.st_mode)) return;
  const Fd probe(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (probe.valid() && connect_to(probe.get(), address) != 0 && errno == ECONNREFUSED)
    ::unlink(path.c_str());
}

}  // namespace

class Hub::Service {
 public:
  explicit Service(const std::string& path);

  void run();
  void stop() { ::eventfd_write(stop_.get(), 1); }

  std::atomic<std::uint64_t> overruns = 0;

 private:
  void watch(int fd, Client* client);
  void accept();
  void serve(Client& client);
  void greet(Client& client, std::span<const std::uint8_t> hello);
  void from_master(std::span<const std::uint8_t> slot, std::size_t frames);
  void from_node(Client& node, std::span<const std::uint8_t> slot, std::size_t frames);
  void drop(Client& client);
  void tell_master(std::span<const std::uint8_t> slot, std::size_t frames);
  void flush_to_master();
  void tell_taps(std::span<const std::uint8_t> slot, std::size_t frames);
  void deliver(Client& client, std::size_t frames);
  bool all_answered() const;

  Fd listener_, epoll_, stop_;
  std::vector<std::unique_ptr<Client>> clients_;
  Client* master_ = nullptr;
  std::vector<std::uint8_t> incoming_;
  std::vector<std::uint8_t> to_master_;
  std::size_t frames_to_master_ = 0;
  std::vector<iovec> pieces_;  ///< of the datagram being sent; the first is for the lost header
};

Hub::Service::Service(const std::string& path) : incoming_(kLargestSlot) {
  const sockaddr_un address = hub_address(path);
  remove_if_dead(path, address);
  listener_ = Fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  epoll_ = Fd(::epoll_create1(EPOLL_CLOEXEC));
  stop_ = Fd(::eventfd(0, EFD_CLOEXEC));
  constexpr int kBacklog = 64;
  if (!listener_.valid() || !epoll_.valid() || !stop_.valid() ||
      ::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_.get(), kBacklog) != 0)
    throw BusError(fmt::format("hub \"{}\": {}", path, std::strerror(errno)));
  watch(listener_.get(), nullptr);
  epoll_event event{.events = EPOLLIN, .data = {.ptr = this}};
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, stop_.get(), &event);
}

void Hub::Service::watch(int fd, Client* client) {
  epoll_event event{.events = EPOLLIN, .data = {.ptr = client}};
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event);
}

void Hub::Service::run() {
  std::array<epoll_event, 64> events;
  for (;;) {
    const int ready = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()),
                                   to_master_.empty() ? -1 : kIdleFlushMs);
    if (ready == 0) flush_to_master();
    for (int i = 0; i < ready; ++i) {
      void* source = events[static_cast<std::size_t>(i)].data.ptr;
      if (source == this) return;
      if (source == nullptr)
        accept();
      else if (auto& client = *static_cast<Client*>(source); !client.gone)
        serve(client);
    }
    if (ready > 0 && !to_master_.empty() && all_answered()) flush_to_master();
    std::erase_if(clients_, [](const auto& client) { return client->gone; });
  }
}

void Hub::Service::accept() {
  Fd fd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!fd.valid()) return;
  clients_.push_back(std::make_unique<Client>());
  clients_.back()->fd = std::move(fd);
  watch(clients_.back()->fd.get(), clients_.back().get());
}

void Hub::Service::serve(Client& client) {
  const ssize_t got = ::recv(client.fd.get(), incoming_.data(), incoming_.size(), MSG_TRUNC);
  // A reset is told once, ahead of what the client said before it closed.
  if (got < 0 && (errno == EAGAIN || errno == EINTR || errno == ECONNRESET)) return;
  if (got <= 0 || static_cast<std::size_t>(got) > incoming_.size()) return drop(client);
  const std::span<const std::uint8_t> slot(incoming_.data(), static_cast<std::size_t>(got));
  if (client.id == kNoId) return greet(client, slot);
  const auto frames = count_frames(slot);
  if (!frames || is_tap(client)) return drop(client);
  tell_taps(slot, *frames);
  if (is_master(client))
    from_master(slot, *frames);
  else
    from_node(client, slot, *frames);
}

void Hub::Service::greet(Client& client, std::span<const std::uint8_t> hello) {
  Welcome answer = Welcome::ok;
  int id = kNoId;
  if (hello.size() != kHelloSize || hello[0] != 'V' || hello[1] != 'C' || hello[2] != 'H')
    return drop(client);
  if (hello[3] != kHubVersion)
    answer = Welcome::wrong_version;
  else
    id = hello[4];
  if (id > 127 && id != kTapId) return drop(client);
  if (id != kTapId && id != kNoId &&
      std::any_of(clients_.begin(), clients_.end(),
                  [id](const auto& other) { return !other->gone && other->id == id; }))
    answer = Welcome::id_in_use;
  ::send(client.fd.get(), &answer, 1, MSG_DONTWAIT | MSG_NOSIGNAL);
  if (answer != Welcome::ok) return drop(client);
  client.id = id;
  if (id == 0) master_ = &client;
  // In order of their ids, so that no result and no timing depends on who came first.
  std::stable_sort(clients_.begin(), clients_.end(),
                   [](const auto& a, const auto& b) { return a->id < b->id; });
}

void Hub::Service::from_master(std::span<const std::uint8_t> slot, std::size_t frames) {
  for (const auto& receiver : clients_) {
    if (!is_node(*receiver)) continue;
    pieces_.assign(1, {});
    std::size_t total = frames;
    for (const auto& sender : clients_) {
      if (sender == receiver || sender->said.empty()) continue;
      pieces_.push_back(piece(sender->said));
      total += sender->said_frames;
    }
    pieces_.push_back(piece(slot.data(), slot.size()));
    receiver->behind = !receiver->answered;
    receiver->answered = false;
    deliver(*receiver, total);
  }
  for (const auto& client : clients_) {
    client->said.clear();
    client->said_frames = 0;
  }
}

void Hub::Service::from_node(Client& node, std::span<const std::uint8_t> slot, std::size_t frames) {
  if (master_ == nullptr) return;  // a bus without a master does not run
  node.answered = true;
  node.behind = false;
  if (node.said.size() + slot.size() > kLargestSlot) {
    overruns += node.said_frames;
    node.said.clear();
    node.said_frames = 0;
  }
  node.said.insert(node.said.end(), slot.begin(), slot.end());
  node.said_frames += frames;
  tell_master(slot, frames);
}

void Hub::Service::tell_master(std::span<const std::uint8_t> slot, std::size_t frames) {
  if (to_master_.size() + slot.size() > kLargestSlot) flush_to_master();
  to_master_.insert(to_master_.end(), slot.begin(), slot.end());
  frames_to_master_ += frames;
}

void Hub::Service::flush_to_master() {
  if (master_ != nullptr && !to_master_.empty()) {
    pieces_.assign({iovec{}, piece(to_master_)});
    deliver(*master_, frames_to_master_);
  }
  to_master_.clear();
  frames_to_master_ = 0;
}

void Hub::Service::tell_taps(std::span<const std::uint8_t> slot, std::size_t frames) {
  for (const auto& client : clients_) {
    if (!is_tap(*client)) continue;
    pieces_.assign({iovec{}, piece(slot.data(), slot.size())});
    deliver(*client, frames);
  }
}

/// Sends pieces_ to a client without ever waiting for it.
void Hub::Service::deliver(Client& client, std::size_t frames) {
  auto header = lost_header(client.lost);
  pieces_.front() = {header.data(), header.size()};
  msghdr message{};
  message.msg_iov = pieces_.data();
  message.msg_iovlen = pieces_.size();
  if (::sendmsg(client.fd.get(), &message, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) return;
  if (errno == EPIPE || errno == ECONNRESET) return;  // its end of file comes by itself
  client.lost += frames;
  overruns += frames;
}

void Hub::Service::drop(Client& client) {
  const bool node = is_node(client);
  client.gone = true;
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, client.fd.get(), nullptr);
  ::shutdown(client.fd.get(), SHUT_RDWR);
  if (&client == master_) {
    master_ = nullptr;
    for (const auto& other : clients_)
      if (is_node(*other)) drop(*other);
    flush_to_master();
  } else if (node && master_ != nullptr) {
    const Frame obituary = encode(Heartbeat{client.id, NmtState::stopped});
    std::vector<std::uint8_t> bytes;
    append_slot({&obituary, 1}, bytes);
    tell_master(bytes, 1);
    flush_to_master();
  }
}

bool Hub::Service::all_answered() const {
  return std::all_of(clients_.begin(), clients_.end(),
                     [](const auto& c) { return !is_node(*c) || c->answered || c->behind; });
}

Hub::Hub(const std::string& path)
    : path_(path),
      service_(std::make_unique<Service>(path)),
      thread_([this] { service_->run(); }) {}

Hub::~Hub() {
  service_->stop();
  thread_.join();
  ::unlink(path_.c_str());
}

std::uint64_t Hub::overruns() const { return service_->overruns.load(); }

}  // namespace vcnc
