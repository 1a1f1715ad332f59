#include "probe_sim/overtravel_node.hpp"

#include <gtest/gtest.h>

namespace vcnc {
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

  Machine machine_;  // range +-2 mm, vertical
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
  EXPECT_EQ(hear(3, 0, true).state, State::hard) << "no reset while the cause lasts";
  EXPECT_EQ(hear(0, 0, true).state, State::normal);
}

TEST_F(OvertravelNodeTest, TripsOnTheProbesSignalsAndOnSilence) {
  EXPECT_EQ(hear(0.1, ProbeSample::kOvertravel).cause, Cause::overtravel);
  hear(0, 0, true);
  EXPECT_EQ(hear(0.1, ProbeSample::kSignalFault).cause, Cause::signal);
  hear(0, 0, true);
  EXPECT_EQ(hear(0.1, ProbeSample::kSlip).cause, Cause::slip);
  hear(0, 0, true);
  EXPECT_EQ(step({}).state, State::normal);
  EXPECT_EQ(step({}).state, State::normal);
  EXPECT_EQ(step({}).cause, Cause::silent);
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

}  // namespace
}  // namespace vcnc
