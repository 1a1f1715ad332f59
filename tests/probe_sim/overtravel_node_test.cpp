#include "probe_sim/overtravel_node.hpp"

#include <gtest/gtest.h>

namespace vcnc::overtravel_node_test {
namespace {

using State = OvertravelState::State;
using Cause = OvertravelState::Cause;

class OvertravelNodeTest : public testing::Test {
 protected:
  OvertravelState hear(double x_mm, std::uint16_t flags = 0, bool reset = false) {
    GroupCommand command;
    if (reset) command.flags = kResetLatch;
    const Frames inputs{encode(ProbeSample{.flags = flags, .deflection = {x_mm * 1e-3, 0, 0}}),
                        encode(command)};
    return step(inputs);
  }
  OvertravelState step(const Frames& inputs) {
    Frames out;
    node_.step(k_++, inputs, out);
    emergencies_ += static_cast<int>(out.size()) - 1;
    return decode_overtravel_state(out.at(0)).value();
  }

  /// The button held for as long as it takes.
  OvertravelState reset(double x_mm = 0) {
    for (int i = 1; i < ResetButton::kHeldCycles; ++i) hear(x_mm, 0, true);
    return hear(x_mm, 0, true);
  }

  /// Range +-2 mm, vertical. Periods so long that steps of any size are counted.
  static Machine coarse() {
    Machine machine;
    machine.probe.signal_period = 2e-3;
    return machine;
  }

  Machine machine_ = coarse();
  OvertravelNode node_{machine_};
  Tick k_ = 0;
  int emergencies_ = 0;
};

TEST_F(OvertravelNodeTest, TellsEveryStage) {
  EXPECT_EQ(hear(0.5).state, State::normal);
  EXPECT_EQ(hear(1.61).state, State::warn);
  const OvertravelState soft = hear(2.01);
  EXPECT_EQ(soft.state, State::soft_stop);
  EXPECT_EQ(soft.cause, Cause::range);
  EXPECT_NEAR(soft.deflection, 2.01e-3, 1e-6);
  EXPECT_EQ(hear(2.6).state, State::hard);
  EXPECT_EQ(emergencies_, 2) << "one for each stage that latches";
}

TEST_F(OvertravelNodeTest, IsLatchedAndReportedOnce) {
  hear(3);
  EXPECT_EQ(emergencies_, 1);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(hear(0).state, State::hard);
  EXPECT_EQ(emergencies_, 1);
  EXPECT_EQ(reset(3).state, State::hard) << "no reset while the cause lasts";
  hear(3);
  hear(0, 0, true);
  EXPECT_EQ(hear(0, 0, true).state, State::hard) << "a spoiled frame or two open nothing";
  EXPECT_EQ(hear(0, 0, true).state, State::normal);
}

TEST_F(OvertravelNodeTest, TripsOnTheProbesSignalsAndOnSilence) {
  EXPECT_EQ(hear(0.1, ProbeSample::kOvertravel).cause, Cause::overtravel);
  reset();
  EXPECT_EQ(hear(0.1, ProbeSample::kSignalFault).cause, Cause::signal);
  reset();
  EXPECT_EQ(hear(0.1, ProbeSample::kSlip).cause, Cause::slip);
  reset();
  EXPECT_EQ(step({}).state, State::normal);
  EXPECT_EQ(step({}).state, State::normal);
  EXPECT_EQ(step({}).cause, Cause::silent);
}

/// 20 um, half a period per 100 us: 100 um in a cycle can be counted.
TEST(OvertravelNode, AReadingThatJumpsFurtherThanCanBeCountedIsLost) {
  const auto cause_after = [](double jump_um, int cycles) {
    OvertravelNode node{Machine{}};
    Frames out;
    const auto hear = [&](Tick k, double um) {
      const Frames inputs{
          encode(ProbeSample{.tick = low16(k), .deflection = {300e-6, um * 1e-6, 0}})};
      out.clear();
      node.step(k + 1, inputs, out);
      return decode_overtravel_state(out.at(0))->cause;
    };
    EXPECT_EQ(hear(0, -20), Cause::none) << "wherever it begins";
    for (int k = 1; k < cycles; ++k) {
      out.clear();
      node.step(k + 1, {}, out);
    }
    return hear(cycles, -20 + jump_um);
  };
  EXPECT_EQ(cause_after(99, 1), Cause::none);
  EXPECT_EQ(cause_after(101, 1), Cause::slip);
  EXPECT_EQ(cause_after(-101, 1), Cause::slip);
  EXPECT_EQ(cause_after(199, 2), Cause::none) << "one sample was lost";
  EXPECT_EQ(cause_after(201, 2), Cause::slip);
}

TEST(OvertravelNode, SleepsWhileTheProbeIsNotInTheSpindle) {
  Machine machine;
  machine.probe.in_spindle = false;
  OvertravelNode node(machine);
  Frames out;
  const Frames inputs{encode(ProbeSample{.deflection = {9e-3, 0, 0}})};
  node.step(0, inputs, out);
  EXPECT_EQ(decode_overtravel_state(out.at(0))->state, State::normal);
}

/// Keeps one state.
class OneLatch : public NodeMemory {
 public:
  std::vector<std::uint8_t> load() override { return state; }
  void save(std::span<const std::uint8_t> s) override { state.assign(s.begin(), s.end()); }
  std::vector<std::uint8_t> state;
};

TEST(OvertravelLatch, HoldsAfterSwitchingOnUntilTheResetWithTheCauseGone) {
  OneLatch memory;
  Frames out;
  Tick k = 0;
  const auto judged = [&](OvertravelNode& node, double x, std::uint8_t flags) {
    GroupCommand command;
    command.flags = flags;
    out.clear();
    node.step(
        k, Frames{encode(ProbeSample{.tick = low16(k), .deflection = {x, 0, 0}}), encode(command)},
        out);
    ++k;
    return decode_overtravel_state(out.at(0)).value();
  };
  {
    OvertravelNode node(Machine{}, &memory);
    const auto creep = [&](double from, double to) {
      for (double x = from; x < to; x += 0.05e-3) judged(node, x, 0);
      judged(node, to, 0);
    };
    creep(0, 0.5e-3);
    EXPECT_TRUE(memory.state.empty()) << "nothing latched";
    creep(0.5e-3, 2.1e-3);
    EXPECT_EQ(decode_protection_latch(memory.state)->state, ProtectionState::soft_stop);
    creep(2.1e-3, 3e-3);
  }
  const auto latch = decode_protection_latch(memory.state);
  ASSERT_TRUE(latch);
  EXPECT_EQ(latch->state, ProtectionState::hard);
  EXPECT_EQ(latch->cause, ProtectionCause::runaway);
  EXPECT_NEAR(latch->deflection, 2.5e-3, 0.06e-3) << "when it was latched";

  OvertravelNode node(Machine{}, &memory);
  out.clear();
  node.step(0, {}, out);
  EXPECT_EQ(decode_overtravel_state(out.at(0))->state, State::hard) << "before any sample";
  EXPECT_EQ(decode_overtravel_state(out.at(0))->cause, Cause::runaway);
  EXPECT_EQ(judged(node, 0, 0).state, State::hard);
  EXPECT_EQ(judged(node, 0, kResetLatch).state, State::hard) << "the button must be held";
  judged(node, 0, kResetLatch);
  EXPECT_EQ(judged(node, 0, kResetLatch).state, State::normal);
  EXPECT_EQ(decode_protection_latch(memory.state)->state, ProtectionState::normal);
}

TEST(OvertravelLatch, RefusesWhatItCannotUnderstand) {
  const auto good = encode_protection_latch({ProtectionState::hard, ProtectionCause::slip, 1e-3});
  EXPECT_TRUE(decode_protection_latch(good));
  for (std::size_t at = 0; at < 3; ++at) {
    OneLatch memory;
    memory.state = good;
    memory.state[at] = 9;
    EXPECT_THROW(OvertravelNode(Machine{}, &memory), MemoryError);
  }
  EXPECT_FALSE(decode_protection_latch(std::span(good).first(10)));
}

}  // namespace
}  // namespace vcnc::overtravel_node_test
