#include "bus/main_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "bus/inproc.hpp"
#include "bus/timed_bus.hpp"
#include "bus/trace_hash.hpp"
#include "toy_machine.hpp"

namespace vcnc::main_loop_test {
namespace {

/// Keeps every cycle's frames.
class Log : public FrameTap {
 public:
  void cycle(Tick k, std::span<const Frame> frames) override {
    EXPECT_EQ(k, static_cast<Tick>(cycles.size()));
    cycles.emplace_back(frames.begin(), frames.end());
  }
  std::vector<Frames> cycles;
};

TEST(MainLoop, RunsTheCyclesInOrderAndLogsThem) {
  auto nodes = toy::make_nodes(3);
  InprocTransport bus(toy::pointers(nodes));
  toy::ToyMaster master(50);
  Pacer pacer;
  Log log;
  const auto result = run_main_loop(master, bus, toy::roster(3), {.pacer = pacer, .taps = {&log}});
  EXPECT_TRUE(result.complete) << result.failure;
  EXPECT_EQ(result.failure, "");
  EXPECT_EQ(result.cycles, 50);
  EXPECT_EQ(result.lost, 0u);
  ASSERT_EQ(log.cycles.size(), 50u);
  TraceHash hash;
  double worst = 0;
  for (std::size_t k = 0; k < log.cycles.size(); ++k) {
    const Frames& frames = log.cycles[k];
    EXPECT_TRUE(
        std::is_sorted(frames.begin(), frames.end(), [](auto& a, auto& b) { return a.id < b.id; }));
    EXPECT_EQ(frames.front(), encode(Sync{sync_counter(static_cast<Tick>(k))}));
    EXPECT_EQ(frames.back().id, kCommandId);
    for (std::uint16_t id = 0x181; id <= 0x183; ++id)
      EXPECT_EQ(std::count_if(frames.begin(), frames.end(), [id](auto& f) { return f.id == id; }),
                1);
    hash.add(static_cast<Tick>(k), frames);
    worst = std::max(worst, bus_load(frames, {}));
  }
  EXPECT_EQ(result.trace_hash, hash.hex());
  EXPECT_DOUBLE_EQ(result.bus_load_worst, worst);
  EXPECT_DOUBLE_EQ(master.last_load, bus_load(log.cycles[48], {}));  // of the cycle before the last
  for (const auto& node : nodes) {
    ASSERT_EQ(node->ticks.size(), 50u);
    for (std::size_t k = 0; k < 50; ++k) EXPECT_EQ(node->ticks[k], static_cast<Tick>(k));
  }
}

TEST(MainLoop, HashDependsOnEveryCycleAndRepeats) {
  const auto run = [](Tick cycles, int count) {
    auto nodes = toy::make_nodes(count);
    InprocTransport bus(toy::pointers(nodes));
    toy::ToyMaster master(cycles);
    Pacer pacer;
    return run_main_loop(master, bus, toy::roster(count), {.pacer = pacer}).trace_hash;
  };
  EXPECT_EQ(run(300, 4), run(300, 4));
  EXPECT_NE(run(300, 4), run(301, 4));
  EXPECT_NE(run(300, 4), run(300, 5));
}

TEST(MainLoop, OrderOfTheNodesInOneProcessDoesNotMatter) {
  std::string first;
  toy::Random random(12);
  for (int run = 0; run < 10; ++run) {
    auto nodes = toy::make_nodes(6);
    for (std::size_t i = nodes.size(); i > 1; --i)
      std::swap(nodes[i - 1], nodes[random.next() % i]);
    InprocTransport bus(toy::pointers(nodes));
    toy::ToyMaster master(200);
    Pacer pacer;
    const auto result = run_main_loop(master, bus, toy::roster(6), {.pacer = pacer});
    ASSERT_TRUE(result.complete) << result.failure;
    if (first.empty()) first = result.trace_hash;
    EXPECT_EQ(result.trace_hash, first);
  }
}

TEST(MainLoop, PacingDoesNotChangeTheResult) {
  std::string hashes[2];
  double seconds = 0;
  for (const double speed : {0.0, 5.0}) {
    auto nodes = toy::make_nodes(2);
    InprocTransport bus(toy::pointers(nodes));
    toy::ToyMaster master(500);
    Pacer pacer(speed);
    const double begin = pacer.elapsed();
    hashes[speed > 0] = run_main_loop(master, bus, toy::roster(2), {.pacer = pacer}).trace_hash;
    seconds = pacer.elapsed() - begin;
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_GE(seconds, 0.0998);  // 499 periods of 0.2 ms
}

TEST(MainLoop, NodeThatIsNotThereIsNamedAtTheStart) {
  auto nodes = toy::make_nodes(2);
  InprocTransport bus(toy::pointers(nodes));
  toy::ToyMaster master(10);
  Pacer pacer;
  const auto result =
      run_main_loop(master, bus, {{1, "drive X"}, {5, "drive C"}, {7, "probe"}}, {.pacer = pacer});
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.failure,
            "not on the bus within 15 s: drive C, probe; the machine starts no program without it");
  EXPECT_EQ(result.cycles, 0);
}

/// A bus that loses or adds something.
class Meddler : public Transport {
 public:
  explicit Meddler(Transport& bus) : bus_(bus) {}
  void send(std::span<const Frame> slot) override { bus_.send(slot); }
  Received receive(Frames& into, int timeout_ms) override {
    const std::size_t known = into.size();
    const Received received = bus_.receive(into, timeout_ms);
    if (meddle && into.size() > known && ++calls > 20) meddle(into);
    return into.size() > known            ? Received::frames
           : received == Received::closed ? received
                                          : Received::timeout;
  }
  std::uint64_t lost() const override { return lost_; }
  std::function<void(Frames&)> meddle;
  int calls = 0;
  std::uint64_t lost_ = 0;

 private:
  Transport& bus_;
};

struct MeddledRun {
  std::vector<std::unique_ptr<toy::ToyNode>> nodes = toy::make_nodes(3);
  InprocTransport inner{toy::pointers(nodes)};
  Meddler bus{inner};
  Pacer pacer;

  MainLoopResult run() {
    toy::ToyMaster master(100);
    return run_main_loop(master, bus, {{1, "drive X"}, {2, "drive Y"}, {3, "probe"}},
                         {.pacer = pacer, .answer_timeout_ms = 250});
  }
};

TEST(MainLoop, SilentNodeIsNamed) {
  MeddledRun r;
  r.bus.meddle = [](Frames& frames) {
    std::erase_if(frames, [](const Frame& f) { return f.id == 0x182; });
  };
  const auto result = r.run();
  EXPECT_FALSE(result.complete);
  EXPECT_TRUE(result.failure.starts_with("no answer within 250 ms in cycle ")) << result.failure;
  EXPECT_TRUE(result.failure.ends_with(" from: drive Y")) << result.failure;
}

TEST(MainLoop, DoubleAnswerRestartAndDepartureEndTheRun) {
  const std::vector<std::pair<Frame, std::string>> cases{
      {encode(ProbeSample{}), "answered twice"},
      {encode(Heartbeat{2, NmtState::boot_up}), "drive Y restarted in cycle"},
      {encode(Heartbeat{3, NmtState::stopped}), "probe left the bus in cycle"}};
  for (const auto& [frame, text] : cases) {
    MeddledRun r;
    Frame extra = frame;
    if (extra.id == 0x187) extra.id = 0x183;
    r.bus.meddle = [extra](Frames& frames) { frames.push_back(extra); };
    const auto result = r.run();
    EXPECT_FALSE(result.complete);
    EXPECT_NE(result.failure.find(text), std::string::npos) << result.failure;
  }
}

TEST(MainLoop, FramesLostByTheHostEndTheRunAndAreCounted) {
  MeddledRun r;
  r.bus.meddle = [&r](Frames&) { r.bus.lost_ = 3; };
  const auto result = r.run();
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.lost, 3u);
  EXPECT_NE(result.failure.find("lost 3 frames"), std::string::npos) << result.failure;
}

TEST(MainLoop, StopFlagEndsAfterTheCycle) {
  auto nodes = toy::make_nodes(2);
  std::atomic<bool> stop = false;
  nodes[0]->before_step = [&](Tick k) { stop = k >= 30; };
  InprocTransport bus(toy::pointers(nodes));
  toy::ToyMaster master(1000);
  Pacer pacer;
  const auto result = run_main_loop(master, bus, toy::roster(2), {.pacer = pacer, .stop = &stop});
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.failure, "interrupted");
  EXPECT_GE(result.cycles, 30);
  EXPECT_LE(result.cycles, 31);
}

TEST(MainLoop, ExceptionOfTheMasterStillStopsTheNodes) {
  class Thrower : public Master {
   public:
    bool step(Tick k, std::span<const Frame>, Frames&) override {
      if (k == 5) throw std::runtime_error("disk full");
      return true;
    }
  } master;
  auto nodes = toy::make_nodes(2);
  InprocTransport bus(toy::pointers(nodes));
  Pacer pacer;
  EXPECT_THROW(run_main_loop(master, bus, toy::roster(2), {.pacer = pacer}), std::runtime_error);
  // The nodes are stopped: another SYNC finds nobody.
  const Frame sync = encode(Sync{7});
  bus.send({&sync, 1});
  EXPECT_EQ(nodes[0]->ticks.size(), 6u);
}

TEST(Barrier, RosterIsChecked) {
  auto nodes = toy::make_nodes(1);
  InprocTransport bus(toy::pointers(nodes));
  EXPECT_THROW(Barrier(bus, {}), std::invalid_argument);
  EXPECT_THROW(Barrier(bus, {{0, "zero"}}), std::invalid_argument);
  EXPECT_THROW(Barrier(bus, {{128, "far"}}), std::invalid_argument);
  EXPECT_THROW(Barrier(bus, {{1, "one"}, {1, "again"}}), std::invalid_argument);
}

}  // namespace
}  // namespace vcnc::main_loop_test
