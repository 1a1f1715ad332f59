// Eight processes in lockstep over the hub, against a bare ping-pong of the same topology in the
// same run: a master, a forwarding thread and eight client processes that exchange datagrams of the
// same sizes over AF_UNIX SOCK_SEQPACKET and do nothing else.
#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <functional>
#include <thread>
#include <vector>

#include "apps/machine_roster.hpp"
#include "bus/hub.hpp"
#include "bus/main_loop.hpp"
#include "bus/messages.hpp"
#include "bus/run_node.hpp"
#include "probe_sim/overtravel_node.hpp"
#include "probe_sim/probe_node.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"
#include "tests/bench/stopwatch.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc {
namespace {

constexpr int kNodes = 8;
constexpr int kCycles = 20000;

/// Forks a process that runs `body` and ends.
pid_t spawn(const std::function<void()>& body) {
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  body();
  ::_exit(0);
}

void reap(const std::vector<pid_t>& children) {
  for (const pid_t child : children) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
}

// ------------------------------------------------------------------------------ bare ping-pong

std::array<int, 2> pair() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends.data()) != 0) std::abort();
  return ends;
}

/// Cycles per second of master -> forwarder -> 8 clients -> forwarder -> master.
double bare_ping_pong() {
  constexpr std::size_t kToNode = 400, kFromNode = 24, kToMaster = kNodes * kFromNode,
                        kFromMaster = 80;
  const auto master = pair();
  std::array<std::array<int, 2>, kNodes> links{};
  for (auto& link : links) link = pair();
  std::vector<pid_t> children;
  for (int i = 0; i < kNodes; ++i)
    children.push_back(spawn([&] {
      std::array<char, 4096> buffer{};
      while (::recv(links[static_cast<std::size_t>(i)][1], buffer.data(), buffer.size(), 0) > 0)
        ::send(links[static_cast<std::size_t>(i)][1], buffer.data(), kFromNode, 0);
    }));
  std::thread forwarder([&] {
    std::array<char, 4096> buffer{};
    const int epoll = ::epoll_create1(0);
    for (const auto& link : links) {
      epoll_event event{.events = EPOLLIN, .data = {.fd = link[0]}};
      ::epoll_ctl(epoll, EPOLL_CTL_ADD, link[0], &event);
    }
    while (::recv(master[1], buffer.data(), buffer.size(), 0) > 1) {
      for (const auto& link : links) ::send(link[0], buffer.data(), kToNode, 0);
      for (int answers = 0; answers < kNodes;) {
        std::array<epoll_event, kNodes> events{};
        const int ready = ::epoll_wait(epoll, events.data(), kNodes, -1);
        for (int i = 0; i < ready; ++i, ++answers)
          ::recv(events[static_cast<std::size_t>(i)].data.fd, buffer.data(), buffer.size(), 0);
      }
      ::send(master[1], buffer.data(), kToMaster, 0);
    }
    ::close(epoll);
  });
  std::array<char, 4096> buffer{};
  const auto cycles = [&](int n) {
    for (int i = 0; i < n; ++i) {
      ::send(master[0], buffer.data(), kFromMaster, 0);
      ::recv(master[0], buffer.data(), buffer.size(), 0);
    }
  };
  cycles(1000);
  const Stopwatch watch;
  cycles(kCycles);
  const double rate = kCycles / watch.seconds();
  ::send(master[0], buffer.data(), 1, 0);
  forwarder.join();
  reap(children);
  for (const auto& link : links) ::close(link[0]), ::close(link[1]);
  ::close(master[0]);
  ::close(master[1]);
  return rate;
}

// ------------------------------------------------------------------------------ the hub

/// Sends a group command of the usual size each cycle, after a warm-up measures.
class Metronome : public Master {
 public:
  bool step(Tick k, std::span<const Frame>, Frames& out) override {
    if (k == 1000) watch_ = Stopwatch();
    GroupCommand command;
    command.controlword = 0x0f;
    out.push_back(encode(command));
    if (k < 1000 + kCycles) return true;
    rate = kCycles / watch_.seconds();
    return false;
  }
  double rate = 0;

 private:
  Stopwatch watch_;
};

/// Answers with a frame of the size of a drive's status.
class Answering : public Node {
 public:
  explicit Answering(int id) : id_(id) {}
  int id() const override { return id_; }
  std::string_view name() const override { return "node"; }
  bool accepts(std::uint16_t id) const override { return id == kCommandId; }
  void step(Tick, std::span<const Frame>, Frames& out) override {
    Frame answer;
    answer.id = static_cast<std::uint16_t>(kStatusBase + id_);
    answer.len = 16;
    answer.fd = true;
    out.push_back(answer);
  }

 private:
  int id_;
};

double hub(const std::function<void(int id, const std::string& uri)>& node_body) {
  const std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("vcnc-bench-{}", ::getpid())).string();
  std::vector<pid_t> children;
  Hub server(path);
  for (int id = 1; id <= kNodes; ++id)
    children.push_back(spawn([&] { node_body(id, server.uri()); }));
  Metronome master;
  Pacer pacer;
  const auto bus = open_transport(server.uri(), 0);
  const MainLoopResult result =
      run_main_loop(master, *bus, machine_roster(), {.pacer = pacer, .taps = {}});
  if (!result.complete) fmt::print("failed: {}\n", result.failure);
  reap(children);
  return master.rate;
}

double trivial_nodes() {
  return hub([](int id, const std::string& uri) {
    Answering node(id);
    const auto bus = open_transport(uri, id);
    run_node(node, *bus);
  });
}

double machine_nodes() {
  const Machine machine = load_machine(configs("machines/trunnion_measured.toml"));
  const auto params = piece_params(machine);
  const std::string truth_path =
      (std::filesystem::temp_directory_path() / fmt::format("vcnc-bench-truth-{}", ::getpid()))
          .string();
  return hub([&](int id, const std::string& uri) {
    const auto bus = open_transport(uri, id);
    if (id <= static_cast<int>(kAxisCount)) {
      const auto truth = open_truth_writer(truth_path);
      DriveNode node(static_cast<std::size_t>(id - 1), machine, 1, *truth);
      run_node(node, *bus);
    } else if (id == kSpindleNode) {
      SpindleNode node(machine);
      run_node(node, *bus);
    } else if (id == kProbeNode) {
      const auto truth = open_truth_reader(truth_path);
      ProbeNode node(machine, make_piece(*params), 1, *truth);
      run_node(node, *bus);
    } else {
      OvertravelNode node(machine);
      run_node(node, *bus);
    }
  });
}

}  // namespace
}  // namespace vcnc

int main() {
  using namespace vcnc;
  std::array<double, 3> bare{}, trivial{}, machine{};
  for (std::size_t i = 0; i < 3; ++i) {  // interleaved: these machines drift
    bare[i] = bare_ping_pong();
    trivial[i] = trivial_nodes();
    machine[i] = machine_nodes();
    fmt::print(
        "bare ping-pong {:6.0f} cycles/s;  hub, trivial nodes {:6.0f} ({:.2f});  hub, machine's "
        "modules {:6.0f} ({:.2f})\n",
        bare[i], trivial[i], trivial[i] / bare[i], machine[i], machine[i] / bare[i]);
  }
  const auto median = [](std::array<double, 3> v) {
    std::sort(v.begin(), v.end());
    return v[1];
  };
  fmt::print(
      "median ratio to the bare ping-pong: trivial nodes {:.2f}, machine's modules {:.2f}  (limit "
      "0.60)\n",
      median(trivial) / median(bare), median(machine) / median(bare));
}
