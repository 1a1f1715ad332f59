#include "servo_sim/drive_node.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace vcnc::drive_node_test {
namespace {

/// One drive X alone on a bus that the test plays by hand.
class DriveNodeTest : public testing::Test {
 protected:
  DriveNodeTest() : truth_(open_local_truth()), node_(kX, machine_, 1, *truth_) {}

  DriveStatus cycle(std::uint16_t controlword, double position = 0, bool tripped = false,
                    bool command = true) {
    Frames inputs, out;
    OvertravelState guard;
    if (tripped) guard.state = OvertravelState::State::hard;
    inputs.push_back(encode(guard));
    if (command) {
      GroupCommand c;
      c.tick = low16(k_ - 1);
      c.controlword = controlword;
      c.axes[kX].position = position;
      inputs.push_back(encode(c));
    }
    node_.step(k_++, inputs, out);
    emergencies_ += static_cast<int>(out.size()) - 1;
    return decode_drive_status(out.at(0)).value();
  }
  void enable() {
    for (std::uint16_t cw : {cia402::kShutdown, cia402::kShutdown, cia402::kSwitchOn,
                             cia402::kEnable, cia402::kEnable})
      cycle(cw);
  }

  Machine machine_;
  std::unique_ptr<TruthPort> truth_;
  DriveNode node_;
  Tick k_ = 0;
  int emergencies_ = 0;
  std::vector<std::uint16_t> seen_;
};

TEST_F(DriveNodeTest, ComesUpThroughTheStatesOfCia402) {
  EXPECT_EQ(cia402::state_of(cycle(0).statusword), cia402::State::switch_on_disabled);
  EXPECT_EQ(cia402::state_of(cycle(cia402::kShutdown).statusword), cia402::State::ready);
  EXPECT_EQ(cia402::state_of(cycle(cia402::kSwitchOn).statusword), cia402::State::switched_on);
  EXPECT_EQ(cia402::state_of(cycle(cia402::kEnable).statusword), cia402::State::operation_enabled);
}

TEST_F(DriveNodeTest, DoesNotFollowBeforeItIsEnabled) {
  for (int i = 0; i < 50; ++i) EXPECT_NEAR(cycle(0, 0.01).position, 0, 1e-9);
}

TEST_F(DriveNodeTest, FollowsOnceEnabledAndStampsTheInstantOfThePosition) {
  enable();
  DriveStatus status;
  for (int i = 0; i < 2000; ++i) status = cycle(cia402::kEnable, 1e-3 * std::min(1.0, i / 1000.0));
  EXPECT_NEAR(status.position, 1e-3, 1e-7);
  EXPECT_EQ(status.tick, low16(k_));  // k_ is already the next cycle: the end of the last one
  std::array<TruthCycle, kTruthAxes> unused;
  EXPECT_FALSE(truth_->collect(k_ - 1, unused));  // the other four axes are not there
}

TEST_F(DriveNodeTest, ATripStopsItInTheCycleAfterTheMessage) {
  enable();
  for (int i = 0; i < 100; ++i) cycle(cia402::kEnable, 1e-5 * i);
  const DriveStatus status = cycle(cia402::kEnable, 1e-5 * 100, true);
  EXPECT_EQ(cia402::state_of(status.statusword), cia402::State::quick_stop);
  double last = status.position;
  for (int i = 0; i < 200; ++i) last = cycle(cia402::kEnable, 1, true).position;
  EXPECT_NEAR(cycle(cia402::kEnable, 1, true).position, last,
              1e-9);  // at rest, whatever is commanded
  EXPECT_LT(last, 2e-3);
  EXPECT_EQ(emergencies_, 0);  // the module that tripped reports it
}

TEST_F(DriveNodeTest, StopsWithAnEmergencyWhenTheCommandIsLost) {
  enable();
  for (int i = 0; i < 20; ++i) cycle(cia402::kEnable, 0);
  for (int i = 0; i < kSilentCyclesAllowed; ++i)
    EXPECT_EQ(cia402::state_of(cycle(0, 0, false, false).statusword),
              cia402::State::operation_enabled);
  EXPECT_EQ(cia402::state_of(cycle(0, 0, false, false).statusword), cia402::State::quick_stop);
  EXPECT_EQ(emergencies_, 1);
}

TEST_F(DriveNodeTest, StopsWhenTheOvertravelModuleFallsSilent) {
  enable();
  Frames out;
  GroupCommand c;
  c.controlword = cia402::kEnable;
  for (int i = 0; i <= kSilentCyclesAllowed; ++i) {
    out.clear();
    c.tick = low16(k_ - 1);
    node_.step(k_++, Frames{encode(c)}, out);
  }
  EXPECT_EQ(cia402::state_of(decode_drive_status(out.at(0))->statusword),
            cia402::State::quick_stop);
  EXPECT_EQ(decode_emergency(out.at(1))->code, 0x8130);
}

TEST_F(DriveNodeTest, CommandsThatComeTooLateAreNone) {
  enable();
  const auto late = [&](Tick cycles) {
    Frames out;
    GroupCommand c;
    c.controlword = cia402::kEnable;
    c.tick = low16(k_ - 1 - cycles);
    node_.step(k_++, Frames{encode(OvertravelState{}), encode(c)}, out);
    return cia402::state_of(decode_drive_status(out.at(0))->statusword);
  };
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(late(kSilentCyclesAllowed), cia402::State::operation_enabled);
  for (int i = 0; i < kSilentCyclesAllowed; ++i)
    EXPECT_EQ(late(kSilentCyclesAllowed + 1), cia402::State::operation_enabled);
  EXPECT_EQ(late(kSilentCyclesAllowed + 1), cia402::State::quick_stop);
}

TEST_F(DriveNodeTest, ASoftStopIsTheNcUnitsBusiness) {
  enable();
  Frames inputs{encode(OvertravelState{.state = OvertravelState::State::soft_stop})}, out;
  GroupCommand c;
  c.tick = low16(k_ - 1);
  c.controlword = cia402::kEnable;
  inputs.push_back(encode(c));
  node_.step(k_++, inputs, out);
  EXPECT_EQ(cia402::state_of(decode_drive_status(out.at(0))->statusword),
            cia402::State::operation_enabled);
}

/// Emergencies of one cycle.
std::vector<std::uint16_t> codes(const Frames& frames) {
  std::vector<std::uint16_t> all;
  for (const Frame& frame : frames)
    if (const auto emergency = decode_emergency(frame)) all.push_back(emergency->code);
  return all;
}

TEST_F(DriveNodeTest, AFollowingErrorBeyondTheWindowIsAFaultUntilReset) {
  enable();
  // The set-point jumps by more than the window: 1.5 x 0.5 m/s / 40 1/s + 1 mm = 19.75 mm.
  const auto status = [&](std::uint16_t controlword, double position) {
    Frames out;
    GroupCommand c;
    c.tick = low16(k_ - 1);
    c.controlword = controlword;
    c.axes[kX].position = position;
    node_.step(k_++, Frames{encode(OvertravelState{}), encode(c)}, out);
    for (const std::uint16_t code : codes(out)) seen_.push_back(code);
    return cia402::state_of(decode_drive_status(out.at(0))->statusword);
  };
  EXPECT_EQ(status(cia402::kEnable, 0.019), cia402::State::operation_enabled);
  status(cia402::kEnable, 0.045);
  EXPECT_EQ(seen_, std::vector<std::uint16_t>{kFollowingErrorCode});
  cia402::State state = cia402::State::fault_reaction;
  for (int i = 0; i < 2000 && state != cia402::State::fault; ++i)
    state = status(cia402::kEnable, 0.045);
  EXPECT_EQ(state, cia402::State::fault);
  EXPECT_EQ(seen_.size(), 1u) << "told once";
  EXPECT_EQ(status(cia402::kShutdown, 0.045), cia402::State::fault);
  EXPECT_EQ(status(cia402::kFaultReset, 0.045), cia402::State::switch_on_disabled);
}

TEST_F(DriveNodeTest, TheLimitSwitchStopsAndLetsBack) {
  // Travel +-1 m, switches 5 mm outside.
  machine_.axes[kX].limits.start = 1.0;
  DriveNode node(kX, machine_, 1, *truth_);
  Tick k = 0;
  std::vector<std::uint16_t> seen;
  const auto step = [&](std::uint16_t controlword, double position, double velocity = 0) {
    Frames out;
    GroupCommand c;
    c.tick = low16(k - 1);
    c.controlword = controlword;
    c.axes[kX] = {position, velocity};
    node.step(k++, Frames{encode(OvertravelState{}), encode(c)}, out);
    for (const std::uint16_t code : codes(out)) seen.push_back(code);
    return *decode_drive_status(out.at(0));
  };
  for (const std::uint16_t cw :
       {cia402::kShutdown, cia402::kShutdown, cia402::kSwitchOn, cia402::kEnable, cia402::kEnable})
    step(cw, 1.0);
  double x = 1.0;
  DriveStatus last;
  for (int i = 0; i < 1000 && seen.empty(); ++i) last = step(cia402::kEnable, x += 2e-5, 0.02);
  EXPECT_EQ(seen, std::vector<std::uint16_t>{kLimitSwitchError});
  EXPECT_NEAR(last.position, 1.005, 5e-5);
  for (int i = 0; i < 200; ++i) last = step(cia402::kEnable, x);
  EXPECT_EQ(cia402::state_of(last.statusword), cia402::State::fault);
  EXPECT_LT(last.position, 1.0052) << "braked at once";
  // Reset and back: still beyond the switch, but no new fault on the way home.
  const double rest = last.position;
  for (const std::uint16_t cw : {cia402::kFaultReset, cia402::kShutdown, cia402::kSwitchOn,
                                 cia402::kEnable, cia402::kEnable})
    step(cw, rest);
  for (int i = 1; i <= 500; ++i) last = step(cia402::kEnable, rest - 2e-5 * i, -0.02);
  EXPECT_EQ(seen, (std::vector<std::uint16_t>{kLimitSwitchError, kErrorReset}));
  EXPECT_LT(last.position, 1.0);
}

}  // namespace
}  // namespace vcnc::drive_node_test
