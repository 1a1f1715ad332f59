// Runs on a real SocketCAN interface, VCNC_CAN_IF or vcan0, and fails where there is none:
// tests/vcan/on-can.sh finds or makes one.
#include "bus/socketcan.hpp"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>

#include <cstdlib>
#include <cstring>

#include "bus/fd.hpp"
#include "bus/inproc.hpp"
#include "bus/main_loop.hpp"
#include "bus/run_node.hpp"
#include "tests/bus/toy_machine.hpp"

namespace vcnc::socketcan_test {
namespace {

std::string interface() {
  const char* name = std::getenv("VCNC_CAN_IF");
  return name != nullptr && *name != '\0' ? name : "vcan0";
}
std::string uri() { return "can://" + interface(); }

/// A raw socket of a third party on the same bus.
class Stranger {
 public:
  Stranger() : fd_(::socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
    const int on = 1;
    ::setsockopt(fd_.get(), SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface().c_str()));
    bound_ = ::bind(fd_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  bool write(canid_t id, std::uint8_t len, bool fd) const {
    canfd_frame frame{};
    frame.can_id = id;
    frame.len = len;
    const std::size_t size = fd ? CANFD_MTU : CAN_MTU;
    return bound_ && ::write(fd_.get(), &frame, size) == static_cast<ssize_t>(size);
  }

 private:
  Fd fd_;
  bool bound_ = false;
};

Frames receive(Transport& bus, std::size_t count) {
  Frames frames;
  while (frames.size() < count && bus.receive(frames, 2000) == Transport::Received::frames) {
  }
  return frames;
}

TEST(Socketcan, InterfaceIsUsable) { EXPECT_NO_THROW(open_transport(uri(), 0)); }

TEST(Socketcan, FramesArriveAsTheyWereSentInOrder) {
  SocketcanTransport a(interface()), b(interface());
  Frames sent{encode(Nmt{}),
              encode(Sync{7}),
              encode(GroupCommand{.tick = 5}),
              encode(DriveStatus{.node = 3, .position = 0.1}),
              encode(ProbeSample{.tick = 9}),
              encode(OvertravelState{}),
              encode(Emergency{.node = 1, .code = 0x8611})};
  constexpr int kLengths[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
  for (const int len : kLengths) {
    Frame frame;
    frame.id = 0x7ff;
    frame.fd = true;
    frame.len = static_cast<std::uint8_t>(len);
    for (std::size_t i = 0; i < frame.len; ++i) frame.data[i] = static_cast<std::uint8_t>(i + 1);
    sent.push_back(frame);
  }
  a.send(sent);
  EXPECT_EQ(receive(b, sent.size()), sent);
  Frames own;
  EXPECT_EQ(a.receive(own, 20), Transport::Received::timeout);  // one's own frames do not come back
}

TEST(Socketcan, SlotsBeyondOneBatchArriveWhole) {
  SocketcanTransport a(interface()), b(interface());
  Frames sent;
  for (int i = 0; i < 200; ++i)
    sent.push_back(encode(Emergency{.node = 1 + i % 100, .code = static_cast<std::uint16_t>(i)}));
  a.send(sent);
  EXPECT_EQ(receive(b, sent.size()), sent);
  EXPECT_EQ(b.lost(), 0u);
}

TEST(Socketcan, OverflowOfTheReceiveBufferIsCountedExactly) {
  SocketcanTransport a(interface()), b(interface());
  b.set_receive_buffer(1 << 14);
  constexpr std::uint64_t kSent = 5000;
  for (std::uint64_t i = 0; i < kSent; ++i) {
    const Frame frame = encode(Sync{static_cast<std::uint8_t>(1 + i % 240)});
    a.send({&frame, 1});
  }
  Frames got;
  while (b.receive(got, 100) == Transport::Received::frames) {
  }
  ASSERT_LT(got.size(), kSent);
  // The kernel tells the number of lost frames with the next one that it delivers.
  const Frame last = encode(Sync{1});
  a.send({&last, 1});
  ASSERT_EQ(b.receive(got, 2000), Transport::Received::frames);
  EXPECT_EQ(got.size() + b.lost(), kSent + 1);
}

TEST(Socketcan, StrangeFramesAreNotHandedOn) {
  SocketcanTransport bus(interface());
  Stranger stranger;
  ASSERT_TRUE(stranger.write(0x123 | CAN_EFF_FLAG, 4, false));
  ASSERT_TRUE(stranger.write(0x124 | CAN_RTR_FLAG, 0, false));
  ASSERT_TRUE(stranger.write(0x125, 63, true));  // passed by vcan, but no length of CAN FD
  ASSERT_TRUE(stranger.write(0x126, 8, false));
  Frames got = receive(bus, 1);
  ASSERT_EQ(got.size(), 1u);
  EXPECT_EQ(got[0].id, 0x126);
  EXPECT_EQ(bus.foreign(), 2u);
  EXPECT_EQ(bus.malformed(), 1u);
  EXPECT_EQ(bus.lost(), 0u);
}

TEST(Socketcan, MissingInterfaceTellsTheRemedy) {
  const auto message = [](const std::string& name) -> std::string {
    try {
      SocketcanTransport bus(name);
    } catch (const BusError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(message("nocan7").find("ip link add dev nocan7 type vcan"), std::string::npos);
  EXPECT_NE(message("a_name_that_is_far_too_long").find("no such interface"), std::string::npos);
  EXPECT_NE(message("lo"), "no error");  // no CAN interface
}

class ToyBus {
 public:
  explicit ToyBus(int count, Tick killed_at = -1) {
    for (int id = 1; id <= count; ++id)
      children_.emplace_back([=] {
        const auto bus = open_transport(uri(), id);
        toy::ToyNode node(id);
        if (id == 2 && killed_at >= 0)
          node.before_step = [=](Tick k) {
            if (k == killed_at) ::raise(SIGKILL);
          };
        return run_node(node, *bus) == NodeExit::stopped ? 0 : 1;
      });
  }
  std::vector<int> wait() {
    std::vector<int> codes;
    for (auto& child : children_) codes.push_back(child.wait());
    return codes;
  }

 private:
  std::vector<toy::ChildProcess> children_;
};

TEST(Socketcan, ProcessesGiveTheHashOfOneProcess) {
  constexpr int kNodes = 4;
  constexpr Tick kCycles = 600;  // beyond the wrap of the SYNC counter
  std::string expected;
  {
    auto nodes = toy::make_nodes(kNodes);
    InprocTransport bus(toy::pointers(nodes));
    toy::ToyMaster master(kCycles);
    Pacer pacer;
    expected = run_main_loop(master, bus, toy::roster(kNodes), {.pacer = pacer}).trace_hash;
  }
  ToyBus toys(kNodes);
  const auto bus = open_transport(uri(), 0);
  toy::ToyMaster master(kCycles);
  Pacer pacer;
  const auto result = run_main_loop(master, *bus, toy::roster(kNodes), {.pacer = pacer});
  EXPECT_TRUE(result.complete) << result.failure;
  EXPECT_EQ(result.trace_hash, expected);
  EXPECT_EQ(result.lost, 0u);
  EXPECT_EQ(toys.wait(), std::vector<int>(kNodes, 0));
}

TEST(Socketcan, KilledNodeTimesOutByName) {
  ToyBus toys(3, 40);
  const auto bus = open_transport(uri(), 0);
  toy::ToyMaster master(100000);
  Pacer pacer;
  const auto result =
      run_main_loop(master, *bus, toy::roster(3), {.pacer = pacer, .answer_timeout_ms = 1000});
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.failure, "no answer within 1000 ms in cycle 40 from: toy 2");
  EXPECT_EQ(toys.wait(), (std::vector<int>{0, 128 + SIGKILL, 0}));
}

}  // namespace
}  // namespace vcnc::socketcan_test
