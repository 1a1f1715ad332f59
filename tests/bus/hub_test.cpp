#include "bus/hub.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bus/inproc.hpp"
#include "bus/main_loop.hpp"
#include "bus/node_shell.hpp"
#include "bus/run_node.hpp"
#include "tests/scratch.hpp"
#include "toy_machine.hpp"

namespace vcnc::hub_test {
namespace {

constexpr int kNodes = 5;
constexpr Tick kCycles = 400;

std::string inproc_hash(Tick cycles = kCycles) {
  auto nodes = toy::make_nodes(kNodes);
  InprocTransport bus(toy::pointers(nodes));
  toy::ToyMaster master(cycles);
  Pacer pacer;
  return run_main_loop(master, bus, toy::roster(kNodes), {.pacer = pacer}).trace_hash;
}

/// Waits without result for a host time that has nothing to do with the simulated one.
void dawdle(std::uint64_t ms) { ::poll(nullptr, 0, static_cast<int>(ms)); }

MainLoopResult run_master(const std::string& uri, Tick cycles = kCycles, double speed = 0,
                          int answer_timeout_ms = 5000) {
  const auto bus = open_transport(uri, 0);
  toy::ToyMaster master(cycles);
  Pacer pacer(speed);
  return run_main_loop(master, *bus, toy::roster(kNodes),
                       {.pacer = pacer, .answer_timeout_ms = answer_timeout_ms});
}

std::vector<int> permuted(std::uint64_t seed) {
  std::vector<int> ids;
  for (int id = 1; id <= kNodes; ++id) ids.push_back(id);
  toy::Random random(seed);
  for (std::size_t i = ids.size(); i > 1; --i) std::swap(ids[i - 1], ids[random.next() % i]);
  return ids;
}

/// A node with random delays of the host, which must not matter.
void delay_randomly(toy::ToyNode& node, std::uint64_t seed) {
  node.before_step = [random = toy::Random(seed)](Tick) mutable {
    const auto draw = random.next();
    if (draw % 16 == 0) dawdle(draw / 16 % 3);
  };
}

TEST(Hub, ThreadsInAnyOrderWithDelaysGiveTheHashOfOneProcess) {
  const std::string expected = inproc_hash();
  Scratch dir;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Hub hub(dir / "bus");
    std::vector<std::thread> threads;
    std::atomic<int> stopped = 0;
    for (const int id : permuted(seed))
      threads.emplace_back([&hub, &stopped, id, seed] {
        toy::ToyNode node(id);
        if (seed > 0) delay_randomly(node, seed * 100 + static_cast<std::uint64_t>(id));
        const auto bus = open_transport(hub.uri(), id);
        if (run_node(node, *bus) == NodeExit::stopped) ++stopped;
      });
    const auto result = run_master(hub.uri(), kCycles, seed == 2 ? 4.0 : 0.0);
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(result.complete) << result.failure;
    EXPECT_EQ(result.trace_hash, expected);
    EXPECT_EQ(result.lost, 0u);
    EXPECT_EQ(stopped, kNodes);
    EXPECT_EQ(hub.overruns(), 0u);
  }
}

toy::ChildProcess node_process(const std::string& uri, int id, std::uint64_t delay_seed = 0) {
  return toy::ChildProcess([=] {
    // The hub may come up later than the node's process.
    for (int attempt = 0; attempt < 200; ++attempt) {
      std::unique_ptr<Transport> bus;
      try {
        bus = open_transport(uri, id);
      } catch (const BusError&) {
        dawdle(20);
        continue;
      }
      toy::ToyNode node(id);
      if (delay_seed > 0) delay_randomly(node, delay_seed);
      return run_node(node, *bus) == NodeExit::stopped ? 0 : 1;
    }
    return 2;
  });
}

TEST(Hub, ProcessesInAnyOrderWithDelaysGiveTheHashOfOneProcess) {
  const std::string expected = inproc_hash();
  Scratch dir;
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    // Forked before the hub's thread exists: a child of a threaded process may only exec.
    std::vector<toy::ChildProcess> children;
    for (const int id : permuted(seed))
      children.push_back(node_process("hub://" + dir / "bus", id,
                                      seed == 1 ? 0 : seed * 10 + static_cast<std::uint64_t>(id)));
    Hub hub(dir / "bus");
    const auto result = run_master(hub.uri(), kCycles, seed == 3 ? 4.0 : 0.0);
    ASSERT_TRUE(result.complete) << result.failure;
    EXPECT_EQ(result.trace_hash, expected);
    for (auto& child : children) EXPECT_EQ(child.wait(), 0);
  }
}

TEST(Hub, KilledNodeIsNamed) {
  Scratch dir;
  std::vector<toy::ChildProcess> children;
  for (int id = 1; id <= kNodes; ++id)
    children.push_back(toy::ChildProcess([&dir, id] {
      for (int attempt = 0; attempt < 200; ++attempt) {
        try {
          const auto bus = open_transport("hub://" + dir / "bus", id);
          toy::ToyNode node(id);
          node.before_step = [id](Tick k) {
            if (id == 4 && k == 100) ::raise(SIGKILL);
          };
          return run_node(node, *bus) == NodeExit::stopped ? 0 : 1;
        } catch (const BusError&) {
          dawdle(20);
        }
      }
      return 2;
    }));
  Hub hub(dir / "bus");
  const auto result = run_master(hub.uri(), 100000);
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.failure, "toy 4 left the bus in cycle 100");
  for (int i = 0; i < kNodes; ++i)
    EXPECT_EQ(children[static_cast<std::size_t>(i)].wait(), i == 3 ? 128 + SIGKILL : 0);
}

TEST(Hub, SilentNodeTimesOutByName) {
  Scratch dir;
  Hub hub(dir / "bus");
  std::vector<std::thread> threads;
  for (int id = 1; id <= kNodes; ++id)
    threads.emplace_back([&hub, id] {
      toy::ToyNode node(id);
      const auto bus = open_transport(hub.uri(), id);
      if (id != 2) {
        run_node(node, *bus);
        return;
      }
      NodeShell shell(node);  // like run_node, but mute from cycle 50 on
      Frames arrived, answer;
      while (!shell.over() && bus->receive(arrived, -1) == Transport::Received::frames) {
        answer.clear();
        for (const Frame& frame : arrived) shell.feed(frame, answer);
        arrived.clear();
        if (shell.next_tick() <= 50 && !answer.empty()) bus->send(answer);
      }
    });
  const auto result = run_master(hub.uri(), 100000, 0, 300);
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.failure, "no answer within 300 ms in cycle 50 from: toy 2");
}

TEST(Hub, TapThatNeverReadsDoesNotStallTheMachine) {
  const Tick cycles = 3000;
  const std::string expected = inproc_hash(cycles);
  Scratch dir;
  Hub hub(dir / "bus");
  HubTransport sleeper(hub.uri().substr(6), kTapId);
  std::atomic<std::size_t> seen = 0;
  std::atomic<std::uint64_t> tap_lost = 0;  // on a busy host even a tap that reads may be too slow
  std::atomic<bool> ready = false;
  std::thread tap([&] {
    HubTransport transport(hub.uri().substr(6), kTapId);
    ready = true;
    Frames frames;
    bool over = false;
    while (!over && transport.receive(frames, 5000) == Transport::Received::frames) {
      for (const Frame& frame : frames) {
        if (frame.id > kStatusBase && frame.id <= kStatusBase + kNodes) ++seen;
        over = over || frame == encode(Nmt{NmtCommand::stop, 0});
      }
      frames.clear();
    }
    tap_lost = transport.lost();
  });
  while (!ready) dawdle(1);
  std::vector<std::thread> threads;
  for (int id = 1; id <= kNodes; ++id)
    threads.emplace_back([&hub, id] {
      toy::ToyNode node(id);
      const auto bus = open_transport(hub.uri(), id);
      run_node(node, *bus);
    });
  const auto result = run_master(hub.uri(), cycles);
  for (std::thread& thread : threads) thread.join();
  tap.join();
  EXPECT_TRUE(result.complete) << result.failure;
  EXPECT_EQ(result.trace_hash, expected);
  EXPECT_GE(seen + tap_lost, static_cast<std::size_t>(cycles) * kNodes);
  EXPECT_LE(seen, static_cast<std::size_t>(cycles) * kNodes);
  EXPECT_GT(hub.overruns(), 0u);

  // Nothing lost silently: the sleeper learns of it with the first datagram that fits again.
  Frames frames;
  while (sleeper.receive(frames, 0) == Transport::Received::frames) {
  }
  HubTransport late_master(hub.uri().substr(6), 0);
  const Frame nmt = encode(Nmt{NmtCommand::reset_comm, 0});
  late_master.send({&nmt, 1});
  ASSERT_EQ(sleeper.receive(frames, 5000), Transport::Received::frames);
  EXPECT_GT(sleeper.lost(), 0u);
  EXPECT_LE(sleeper.lost(), hub.overruns());
}

TEST(Hub, MastersCommandsTravelWithItsNextSync) {
  Scratch dir;
  Hub hub(dir / "bus");
  HubTransport node(dir / "bus", 1), master(dir / "bus", 0);
  const Frame command = encode(GroupCommand{}), sync = encode(Sync{1});
  master.send({&command, 1});
  Frames frames;
  EXPECT_EQ(node.receive(frames, 50), Transport::Received::timeout);
  master.send({&sync, 1});
  ASSERT_EQ(node.receive(frames, 5000), Transport::Received::frames);
  EXPECT_EQ(frames, (Frames{command, sync}));
}

TEST(Hub, AnswersReachTheOtherNodesWithTheNextSync) {
  Scratch dir;
  Hub hub(dir / "bus");
  HubTransport a(dir / "bus", 1), b(dir / "bus", 2), master(dir / "bus", 0);
  const Frame sync = encode(Sync{1}), from_a = encode(DriveStatus{.node = 1}),
              from_b = encode(DriveStatus{.node = 2});
  Frames frames;
  master.send({&sync, 1});
  a.send({&from_a, 1});
  b.send({&from_b, 1});
  while (frames.size() < 2) ASSERT_EQ(master.receive(frames, 5000), Transport::Received::frames);
  sort_by_id(frames);
  EXPECT_EQ(frames, (Frames{from_a, from_b}));
  master.send({&sync, 1});
  const auto heard = [&](HubTransport& node) {
    Frames got;
    node.receive(got, 5000);  // first SYNC
    got.clear();
    node.receive(got, 5000);
    return got;
  };
  EXPECT_EQ(heard(a), (Frames{from_b, sync}));  // not one's own
  EXPECT_EQ(heard(b), (Frames{from_a, sync}));
}

TEST(Hub, TapSeesEverything) {
  Scratch dir;
  Hub hub(dir / "bus");
  HubTransport tap(dir / "bus", kTapId), node(dir / "bus", 1), master(dir / "bus", 0);
  for (int i = 0; i < 100; ++i) {
    const Frame sync = encode(Sync{static_cast<std::uint8_t>(i + 1)}),
                answer = encode(DriveStatus{.node = 1});
    Frames heard, answers, seen;
    master.send({&sync, 1});
    ASSERT_EQ(node.receive(heard, 5000), Transport::Received::frames);
    node.send({&answer, 1});
    ASSERT_EQ(master.receive(answers, 5000), Transport::Received::frames);
    while (seen.size() < 2) ASSERT_EQ(tap.receive(seen, 5000), Transport::Received::frames);
    EXPECT_EQ(seen, (Frames{sync, answer}));
  }
  EXPECT_EQ(tap.lost(), 0u);
}

TEST(Hub, LossOfASlowTapIsCountedExactly) {
  Scratch dir;
  Hub hub(dir / "bus");
  HubTransport tap(dir / "bus", kTapId), master(dir / "bus", 0);
  constexpr std::uint64_t kSent = 2000;
  Frames seen;
  const Frame sync = encode(Sync{1});
  for (std::uint64_t i = 0; i < kSent; ++i) master.send({&sync, 1});
  while (tap.receive(seen, 200) == Transport::Received::frames) {
  }
  ASSERT_LT(seen.size(), kSent);
  master.send({&sync, 1});
  ASSERT_EQ(tap.receive(seen, 5000), Transport::Received::frames);
  EXPECT_EQ(seen.size() + tap.lost(), kSent + 1);
  EXPECT_EQ(tap.lost(), hub.overruns());
}

TEST(Hub, EndOfTheMasterClosesTheNodes) {
  Scratch dir;
  Hub hub(dir / "bus");
  HubTransport node(dir / "bus", 1);
  auto master = std::make_unique<HubTransport>(dir / "bus", 0);
  const Frame nmt = encode(Nmt{NmtCommand::stop, 0});
  master->send({&nmt, 1});
  master.reset();
  Frames frames;
  ASSERT_EQ(node.receive(frames, 5000),
            Transport::Received::frames);  // what was said still arrives
  EXPECT_EQ(frames, Frames{nmt});
  EXPECT_EQ(node.receive(frames, 5000), Transport::Received::closed);
  EXPECT_NO_THROW(node.send(frames));
}

TEST(Hub, ErrorsAreClear) {
  Scratch dir;
  const auto message = [](const auto& action) -> std::string {
    try {
      action();
    } catch (const BusError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(message([&] { HubTransport(dir / "bus", 1); }).find("is the machine running?"),
            std::string::npos);
  EXPECT_NE(message([&] { Hub("/nowhere/at/all"); }).find("No such file"), std::string::npos);
  EXPECT_NE(message([&] { Hub(std::string(300, 'x')); }).find("1 to 107 characters"),
            std::string::npos);
  Hub hub(dir / "bus");
  EXPECT_NE(message([&] { Hub(dir / "bus"); }).find("in use"), std::string::npos);
  HubTransport first(dir / "bus", 3);
  EXPECT_NE(message([&] { HubTransport(dir / "bus", 3); }).find("node id 3 is already on the bus"),
            std::string::npos);
  EXPECT_NE(message([&] { HubTransport(dir / "bus", 200); }).find("0..127 and 255"),
            std::string::npos);
  HubTransport tap(dir / "bus", kTapId), second_tap(dir / "bus", kTapId);
  EXPECT_NE(message([&] { tap.send({}); }).find("cannot send"), std::string::npos);
}

/// A process that is stopped while it waits for its welcome hears it when it goes on.
TEST(Hub, AClientStoppedBeforeItsWelcomeIsWelcome) {
  Scratch dir;
  const std::string path = dir / "bus";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, path.c_str());
  const int listener = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  const pid_t client = ::fork();
  if (client == 0) {
    try {
      HubTransport node(path, 1);
      _exit(0);
    } catch (const BusError&) {
      _exit(1);
    }
  }
  const int served = ::accept(listener, nullptr, nullptr);
  char hello[5];
  ASSERT_EQ(::recv(served, hello, sizeof hello, 0), 5);
  int status = 0;
  for (int i = 0; i < 3; ++i) {
    dawdle(5);  // now it listens
    ::kill(client, SIGSTOP);
    ASSERT_EQ(::waitpid(client, &status, WUNTRACED), client);
    ASSERT_TRUE(WIFSTOPPED(status)) << status;
    ::kill(client, SIGCONT);
  }
  dawdle(5);
  const char welcome = 0;
  ::send(served, &welcome, 1, MSG_NOSIGNAL);
  ASSERT_EQ(::waitpid(client, &status, 0), client);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  ::close(served);
  ::close(listener);
}

TEST(Hub, FileOfAKilledHubIsReplaced) {
  Scratch dir;
  const std::string path = dir / "bus";
  {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
    ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ::close(fd);
  }
  ASSERT_TRUE(std::filesystem::exists(path));
  {
    Hub hub(path);
    HubTransport node(path, 1);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  std::ofstream(path) << "not a socket";
  EXPECT_THROW(Hub{path}, BusError);  // somebody else's file is not removed
  EXPECT_TRUE(std::filesystem::exists(path));
  std::filesystem::remove(path);
}

TEST(Hub, NonsenseFromAClientEndsThatClientOnly) {
  Scratch dir;
  Hub hub(dir / "bus");
  HubTransport node(dir / "bus", 1), master(dir / "bus", 0);
  toy::Random random(8);
  for (int i = 0; i < 200; ++i) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, (dir / "bus").c_str());
    const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
    ASSERT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    if (i % 2 == 0) {
      const char hello[] = {'V', 'C', 'H', 1, 9};
      char reply = -1;
      ASSERT_EQ(::send(fd, hello, sizeof hello, MSG_NOSIGNAL), 5);
      ASSERT_EQ(::recv(fd, &reply, 1, 0), 1);
      ASSERT_EQ(reply, 0);
    }
    std::vector<char> bytes(5 + random.next() % 300);
    for (char& byte : bytes) byte = static_cast<char>(random.next());
    bytes[2] = 77;  // a length that no frame has
    ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    char end;
    EXPECT_LE(::recv(fd, &end, 1, 0), 0);
    ::close(fd);
  }
  const Frame sync = encode(Sync{1});
  master.send({&sync, 1});
  Frames frames;
  ASSERT_EQ(node.receive(frames, 5000), Transport::Received::frames);
  EXPECT_EQ(frames, Frames{sync});
}

TEST(OpenTransport, UnknownSchemesAreRefused) {
  for (const char* uri : {"", "hub", "hub://relative", "tcp://localhost", "inproc://", "can://"})
    EXPECT_THROW(open_transport(uri, 1), BusError) << uri;
}

}  // namespace
}  // namespace vcnc::hub_test
