#include "bus/node_shell.hpp"

#include <gtest/gtest.h>

#include <set>

#include "toy_machine.hpp"

namespace vcnc::node_shell_test {
namespace {

/// A node that writes down what it was given.
class Recorder : public Node {
 public:
  explicit Recorder(int id = 3) : id_(id) {}
  int id() const override { return id_; }
  std::string_view name() const override { return "recorder"; }
  bool accepts(std::uint16_t id) const override { return id != 0x185; }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override {
    ticks.push_back(k);
    heard.assign(inputs.begin(), inputs.end());
    if (!answers) return;
    out.push_back(encode(DriveStatus{.node = id_, .tick = low16(k)}));
    for (int i = 0; i < emergencies; ++i) out.push_back(encode(Emergency{id_, 0x1000}));
  }
  std::vector<Tick> ticks;
  Frames heard;
  bool answers = true;
  int emergencies = 0;

 private:
  int id_;
};

Frame frame_with(std::uint16_t id, std::uint8_t first = 0) {
  Frame frame;
  frame.id = id;
  frame.len = 8;
  frame.data[0] = first;
  return frame;
}

struct Rig {
  Recorder node;
  NodeShell shell{node};
  Frames out;

  Frames feed(const Frame& frame) {
    out.clear();
    shell.feed(frame, out);
    return out;
  }
  Frames sync(Tick k) { return feed(encode(Sync{sync_counter(k)})); }
  void start() {
    feed(encode(Nmt{NmtCommand::reset_comm, 0}));
    feed(encode(Nmt{NmtCommand::start, 0}));
  }
};

TEST(NodeShell, StartUpFollowsNetworkManagement) {
  Rig rig;
  EXPECT_TRUE(rig.sync(0).empty());  // not started: no answer, no step
  EXPECT_EQ(rig.feed(encode(Nmt{NmtCommand::reset_node, 0})),
            Frames{encode(Heartbeat{3, NmtState::boot_up})});
  EXPECT_EQ(rig.shell.state(), NmtState::pre_operational);
  EXPECT_TRUE(rig.feed(encode(Nmt{NmtCommand::start, 9})).empty());  // meant for another node
  EXPECT_EQ(rig.shell.state(), NmtState::pre_operational);
  EXPECT_EQ(rig.feed(encode(Nmt{NmtCommand::start, 3})),
            Frames{encode(Heartbeat{3, NmtState::operational})});
  EXPECT_TRUE(rig.feed(encode(Nmt{NmtCommand::start, 3})).empty());  // is operational already
  EXPECT_EQ(rig.sync(0).size(), 1u);
  EXPECT_FALSE(rig.shell.over());
  EXPECT_TRUE(rig.feed(encode(Nmt{NmtCommand::stop, 0})).empty());
  EXPECT_TRUE(rig.shell.over());
  EXPECT_TRUE(rig.sync(1).empty());
  EXPECT_EQ(rig.node.ticks, (std::vector<Tick>{0}));
}

TEST(NodeShell, FramesOfACycleActInTheNextOneInOrderOfTheirIdentifiers) {
  Rig rig;
  rig.feed(frame_with(0x200, 99));  // before the start: dropped
  rig.start();
  rig.sync(0);
  EXPECT_TRUE(rig.node.heard.empty());
  rig.feed(frame_with(0x200, 1));
  rig.feed(frame_with(0x185));  // not accepted
  rig.feed(frame_with(0x187, 2));
  rig.feed(frame_with(0x088, 3));
  rig.feed(frame_with(0x702));  // heartbeats stay in the shell
  EXPECT_TRUE(rig.node.heard.empty());
  rig.sync(1);
  EXPECT_EQ(rig.node.heard,
            (Frames{frame_with(0x088, 3), frame_with(0x187, 2), frame_with(0x200, 1)}));
  rig.sync(2);
  EXPECT_TRUE(rig.node.heard.empty());
}

TEST(NodeShell, CyclicFrameLeavesLast) {
  Rig rig;
  rig.node.emergencies = 2;
  rig.start();
  const Frames out = rig.sync(0);
  ASSERT_EQ(out.size(), 3u);
  EXPECT_EQ(out[0].id, 0x083);
  EXPECT_EQ(out[1].id, 0x083);
  EXPECT_EQ(out[2].id, 0x183);
}

TEST(NodeShell, TickIsUnwrappedFarBeyondTheCounter) {
  Rig rig;
  rig.start();
  constexpr Tick kCycles =
      2 * 65536 + 500;  // beyond both wraps: of the counter and of 16-bit ticks
  for (Tick k = 0; k < kCycles; ++k) {
    const Frames out = rig.sync(k);
    ASSERT_EQ(out.size(), 1u);
    ASSERT_EQ(decode_drive_status(out[0])->tick, low16(k));
  }
  ASSERT_EQ(rig.node.ticks.size(), static_cast<std::size_t>(kCycles));
  EXPECT_EQ(rig.node.ticks.back(), kCycles - 1);
  EXPECT_EQ(rig.shell.missed_syncs() + rig.shell.repeated_syncs() + rig.shell.double_frames(), 0u);
}

TEST(NodeShell, MissedSyncIsCountedAndReportedOnce) {
  Rig rig;
  rig.start();
  rig.sync(0);
  Frames out = rig.sync(239);  // across the wrap of the counter
  out = rig.sync(242);
  EXPECT_EQ(rig.node.ticks, (std::vector<Tick>{0, 239, 242}));
  EXPECT_EQ(rig.shell.missed_syncs(), 238u + 2u);
  EXPECT_EQ(out.size(), 1u);  // reported before, with tick 239
}

TEST(NodeShell, ReportOfAMissedSyncCarriesTheCount) {
  Rig rig;
  rig.start();
  rig.sync(0);
  const Frames out = rig.sync(3);
  ASSERT_EQ(out.size(), 2u);
  const auto emergency = decode_emergency(out[0]);
  ASSERT_TRUE(emergency);
  EXPECT_EQ(emergency->node, 3);
  EXPECT_EQ(emergency->code, 0x8100);
  EXPECT_EQ(emergency->detail, (std::array<std::uint8_t, 5>{1, 2, 0, 0, 0}));
}

TEST(NodeShell, RepeatedSyncDoesNotStepAgainAndIsReported) {
  Rig rig;
  rig.start();
  rig.sync(0);
  rig.sync(1);
  rig.feed(frame_with(0x200, 5));
  EXPECT_TRUE(rig.sync(1).empty());
  EXPECT_EQ(rig.shell.repeated_syncs(), 1u);
  const Frames out = rig.sync(2);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(decode_emergency(out[0])->detail[0], 2);
  EXPECT_EQ(rig.node.heard, Frames{frame_with(0x200, 5)});  // was not lost over it
  EXPECT_EQ(rig.node.ticks, (std::vector<Tick>{0, 1, 2}));
}

TEST(NodeShell, SecondCyclicFrameInACycleIsReported) {
  Rig rig;
  rig.start();
  rig.sync(0);
  rig.feed(frame_with(0x181, 1));
  rig.feed(frame_with(0x083, 1));
  rig.feed(frame_with(0x083, 2));  // emergencies may come several times
  rig.feed(frame_with(0x181, 2));
  const Frames out = rig.sync(1);
  EXPECT_EQ(rig.shell.double_frames(), 1u);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(decode_emergency(out[0])->detail[0], 3);
}

TEST(NodeShell, LossOnTheHostIsReported) {
  Rig rig;
  rig.start();
  rig.shell.note_lost(300);
  const Frames out = rig.sync(0);
  ASSERT_EQ(out.size(), 2u);
  const auto emergency = decode_emergency(out[0]);
  EXPECT_EQ(emergency->code, 0x8110);
  EXPECT_EQ(emergency->detail, (std::array<std::uint8_t, 5>{4, 0x2c, 0x01, 0, 0}));
}

TEST(NodeShell, ResetBeginsAnew) {
  Rig rig;
  rig.start();
  rig.sync(0);
  rig.sync(1);
  rig.feed(frame_with(0x200));
  rig.start();
  rig.sync(0);
  EXPECT_EQ(rig.node.ticks, (std::vector<Tick>{0, 1, 0}));
  EXPECT_TRUE(rig.node.heard.empty());
  EXPECT_EQ(rig.shell.missed_syncs(), 0u);
}

TEST(NodeShell, AnswerWithoutTheCyclicFrameIsAProgrammersError) {
  Rig rig;
  rig.start();
  rig.node.answers = false;
  EXPECT_THROW(rig.sync(0), std::logic_error);
}

TEST(NodeShell, NodeIdIsChecked) {
  Recorder zero(0), large(128);
  EXPECT_THROW(NodeShell{zero}, std::invalid_argument);
  EXPECT_THROW(NodeShell{large}, std::invalid_argument);
}

TEST(NodeShell, RandomFramesNeverUpsetIt) {
  toy::Random random(99);
  Rig rig;
  rig.start();
  for (int i = 0; i < 50000; ++i) {
    Frame frame;
    frame.id = static_cast<std::uint16_t>(random.next() % 4 == 0 ? 0x080 : random.next());
    frame.len = static_cast<std::uint8_t>(random.next() % 9);
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random.next());
    for (const Frame& said : rig.feed(frame))
      ASSERT_TRUE(said.id == 0x083 || said.id == 0x183 || said.id == 0x703) << said.id;
    if (rig.shell.state() != NmtState::operational) rig.start();
  }
}

}  // namespace
}  // namespace vcnc::node_shell_test
