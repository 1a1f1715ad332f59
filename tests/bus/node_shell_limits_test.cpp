#include <gtest/gtest.h>

#include "bus/node_shell.hpp"

namespace vcnc::node_shell_limits_test {
namespace {

/// Counts what it is handed.
class Counter : public Node {
 public:
  int id() const override { return 5; }
  std::string_view name() const override { return "counter"; }
  bool accepts(std::uint16_t) const override { return true; }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override {
    heard = inputs.size();
    out.push_back(encode(DriveStatus{.node = 5, .tick = low16(k)}));
  }
  std::size_t heard = 0;
};

TEST(NodeShell, FramesWithoutASyncDoNotPileUp) {
  Counter node;
  NodeShell shell(node);
  Frames out;
  shell.feed(encode(Nmt{NmtCommand::start, 0}), out);
  const Frame babble = encode(Emergency{.node = 3, .code = 0x1000});
  for (std::size_t i = 0; i < NodeShell::kMostFrames + 77; ++i) shell.feed(babble, out);
  out.clear();
  shell.feed(encode(Sync{sync_counter(0)}), out);
  EXPECT_EQ(node.heard, NodeShell::kMostFrames);
  ASSERT_EQ(out.size(), 2u);
  const Emergency emergency = decode_emergency(out[0]).value();
  EXPECT_EQ(emergency.code, kOverrunError);
  EXPECT_EQ(emergency.detail[0], 4);
  EXPECT_EQ(emergency.detail[1], 77);
}

}  // namespace
}  // namespace vcnc::node_shell_limits_test
