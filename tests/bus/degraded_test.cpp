// The main loop without a module, and a module without a bus.
#include <gtest/gtest.h>

#include <thread>

#include "bus/hub.hpp"
#include "bus/inproc.hpp"
#include "bus/main_loop.hpp"
#include "bus/run_node.hpp"
#include "tests/scratch.hpp"
#include "toy_machine.hpp"

namespace vcnc::degraded_test {
namespace {

/// Takes `after` more cycles from the first loss on.
class Careful : public Master {
 public:
  explicit Careful(Tick after) : after_(after) {}
  bool step(Tick k, std::span<const Frame> answers, Frames& out) override {
    last_cycle = k;
    last_answers = answers.size();
    if (!lost.empty() && since_ < 0) since_ = k;
    out.push_back(encode(GroupCommand{.tick = low16(k)}));
    return (since_ < 0 || k < since_ + after_) && k < 100000;
  }
  void node_lost(int id, const std::string& why) override { lost.emplace_back(id, why); }

  std::vector<std::pair<int, std::string>> lost;
  Tick last_cycle = -1;
  std::size_t last_answers = 0;

 private:
  Tick after_;
  Tick since_ = -1;
};

class LossyBus : public Transport {
 public:
  explicit LossyBus(Transport& bus) : bus_(bus) {}
  void send(std::span<const Frame> slot) override { bus_.send(slot); }
  Received receive(Frames& into, int timeout_ms) override {
    const std::size_t known = into.size();
    const Received received = bus_.receive(into, timeout_ms);
    if (into.size() > known) meddle(into);
    return into.size() > known            ? Received::frames
           : received == Received::closed ? received
                                          : Received::timeout;
  }
  std::function<void(Frames&)> meddle;

 private:
  Transport& bus_;
};

struct Rig {
  std::vector<std::unique_ptr<toy::ToyNode>> nodes = toy::make_nodes(3);
  InprocTransport inner{toy::pointers(nodes)};
  LossyBus bus{inner};
  Pacer pacer;
  int cycle = -1;
  MainLoopResult run(Master& master, Tick degraded_cycles = 10000) {
    nodes[0]->before_step = [this](Tick k) { cycle = static_cast<int>(k); };
    return run_main_loop(
        master, bus, toy::roster(3),
        {.pacer = pacer, .answer_timeout_ms = 250, .degraded_cycles = degraded_cycles});
  }
};

TEST(DegradedLoop, GoesOnWithoutTheSilentNodeUntilTheMasterHasEnough) {
  Rig r;
  r.bus.meddle = [&](Frames& frames) {
    if (r.cycle >= 50) std::erase_if(frames, [](const Frame& f) { return f.id == 0x182; });
  };
  Careful master(30);
  const auto result = r.run(master);
  EXPECT_FALSE(result.complete);
  ASSERT_EQ(master.lost.size(), 1u);
  EXPECT_EQ(master.lost[0].first, 2);
  EXPECT_EQ(master.lost[0].second, "no answer within 250 ms in cycle 50 from: toy 2");
  EXPECT_EQ(result.failure, master.lost[0].second);
  EXPECT_EQ(master.last_cycle, 80);
  EXPECT_EQ(result.cycles, 81);
  ASSERT_EQ(result.lost_nodes.size(), 1u);
  EXPECT_EQ(result.lost_nodes[0].name, "toy 2");
  EXPECT_EQ(result.lost_nodes[0].cycle, 50);
  EXPECT_EQ(r.nodes[0]->ticks.size(), 81u) << "the others are stepped to the end";
}

TEST(DegradedLoop, WhatALostNodeStillSaysIsDroppedAndCounted) {
  Rig r;
  r.bus.meddle = [&](Frames& frames) {
    if (r.cycle == 50) frames.push_back(encode(Heartbeat{2, NmtState::boot_up}));
  };
  Careful master(20);
  const auto result = r.run(master);
  EXPECT_EQ(result.failure, "toy 2 restarted in cycle 50");
  EXPECT_GE(result.late_frames, 20u);  // its answers of the cycles 51..70 and some emergencies
  EXPECT_LE(result.late_frames, 30u);
}

TEST(DegradedLoop, EndsByItselfIfTheMasterDoesNot) {
  Rig r;
  r.bus.meddle = [&](Frames& frames) {
    if (r.cycle == 10) frames.push_back(encode(Heartbeat{3, NmtState::stopped}));
  };
  Careful master(100000);
  const auto result = r.run(master, 70);
  EXPECT_EQ(result.cycles, 80);
  EXPECT_EQ(result.failure, "toy 3 left the bus in cycle 10");
}

TEST(DegradedLoop, SurvivesTheLossOfAll) {
  Rig r;
  r.bus.meddle = [&](Frames& frames) {
    if (r.cycle >= 10) frames.clear();
  };
  Careful master(25);
  const auto result = r.run(master);
  EXPECT_EQ(master.lost.size(), 3u);
  EXPECT_EQ(result.cycles, 36);
  EXPECT_EQ(master.last_answers, 0u);
}

// ------------------------------------------------------------------------------ without a bus

/// Moves on for 40 cycles after the last SYNC.
class Coaster : public toy::ToyNode {
 public:
  using ToyNode::ToyNode;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override {
    ToyNode::step(k, inputs, out);
    left_ = inputs.empty() ? left_ - 1 : 40;
  }
  bool at_rest() const override { return left_ <= 0; }

 private:
  int left_ = 40;
};

struct Orphan {
  NodeExit exit{};
  RunDown alone;
  std::vector<Tick> ticks;
};

/// A node on a hub whose master goes after ten cycles, with or without a last NMT "stop", or only
/// falls silent.
enum class End { closed, stopped, silent };
Orphan orphan(End end) {
  Scratch dir;
  Hub hub(dir / "bus");
  Orphan result;
  auto master = open_transport(hub.uri(), 0);
  std::thread thread([&] {
    Coaster node(1);
    const auto bus = open_transport(hub.uri(), 1);
    result.exit = run_node(node, *bus, {.silence_timeout_ms = 300, .run_down = &result.alone});
    result.ticks = node.ticks;
  });
  const auto say = [&](const Frame& frame) { master->send({&frame, 1}); };
  const auto wait = [&] {
    Frames answers;
    return master->receive(answers, 5000) == Transport::Received::frames;
  };
  EXPECT_TRUE(wait()) << "boot-up";
  say(encode(Nmt{NmtCommand::start, 0}));
  EXPECT_TRUE(wait());
  for (Tick k = 0; k < 10; ++k) {
    const Frames slot{encode(GroupCommand{}), encode(Sync{sync_counter(k)})};
    master->send(slot);
    EXPECT_TRUE(wait());
  }
  if (end == End::stopped) say(encode(Nmt{NmtCommand::stop, 0}));
  if (end == End::closed) master.reset();
  thread.join();
  return result;
}

TEST(RunNode, StepsOnAloneToRestHoweverTheBusEnds) {
  for (const End end : {End::closed, End::stopped, End::silent}) {
    const Orphan o = orphan(end);
    EXPECT_EQ(o.exit, end == End::stopped ? NodeExit::stopped : NodeExit::closed);
    EXPECT_TRUE(o.alone.at_rest);
    EXPECT_EQ(o.alone.cycles, 40);
    ASSERT_EQ(o.ticks.size(), 50u);
    for (std::size_t k = 0; k < 50; ++k) EXPECT_EQ(o.ticks[k], static_cast<Tick>(k));
  }
}

TEST(RunNode, GivesUpOnANodeThatNeverRests) {
  class Restless : public toy::ToyNode {
   public:
    using ToyNode::ToyNode;
    bool at_rest() const override { return false; }
  } node(1);
  const RunDown alone = run_down(node, 7);
  EXPECT_FALSE(alone.at_rest);
  EXPECT_EQ(alone.cycles, kLongestRunDown);
  EXPECT_EQ(node.ticks.front(), 7);
}

}  // namespace
}  // namespace vcnc::degraded_test
