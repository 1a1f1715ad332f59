#include "servo_sim/spindle_node.hpp"

#include <gtest/gtest.h>

namespace vcnc::spindle_node_test {
namespace {

class SpindleNodeTest : public testing::Test {
 protected:
  DriveStatus cycle(GroupCommand::SpindleMode mode, bool tripped = false, std::uint8_t flags = 0,
                    std::uint16_t cw = cia402::kEnable) {
    GroupCommand c;
    c.tick = low16(k_ - 1);
    c.controlword = cw;
    c.spindle_mode = mode;
    c.spindle_speed = 100;
    c.flags = flags;
    OvertravelState guard;
    if (tripped) guard.state = OvertravelState::State::hard;
    const Frames inputs{encode(guard), encode(c)};
    Frames out;
    node_.step(k_++, inputs, out);
    return decode_drive_status(out.at(0)).value();
  }
  void enable() {
    for (std::uint16_t cw : {cia402::kShutdown, cia402::kShutdown, cia402::kSwitchOn})
      cycle(GroupCommand::SpindleMode::off, false, 0, cw);
  }
  double turn(int cycles, bool tripped = false, std::uint8_t flags = 0) {
    double speed = 0;
    for (int i = 0; i < cycles; ++i)
      speed = cycle(GroupCommand::SpindleMode::clockwise, tripped, flags).second_encoder;
    return speed;
  }

  Machine machine_;
  SpindleNode node_{machine_};
  Tick k_ = 0;
};

TEST_F(SpindleNodeTest, TurnsWhenEnabled) {
  EXPECT_EQ(turn(100), 0);
  enable();
  EXPECT_NEAR(turn(1000), 100, 1e-6);
}

TEST_F(SpindleNodeTest, ATripBrakesAndLocksItUntilTheResetWithTheCauseGone) {
  enable();
  turn(1000);
  turn(1, true);
  EXPECT_TRUE(node_.locked());
  EXPECT_NEAR(turn(2000, true), 0, 1e-9);
  EXPECT_NEAR(turn(500), 0, 1e-9) << "the lock is latched";
  turn(ResetButton::kHeldCycles, true, kResetLatch);
  EXPECT_TRUE(node_.locked()) << "no reset while the cause lasts";
  turn(1);
  turn(ResetButton::kHeldCycles - 1, false, kResetLatch);
  EXPECT_TRUE(node_.locked()) << "a spoiled frame or two open nothing";
  turn(1, false, kResetLatch);
  EXPECT_FALSE(node_.locked());
  EXPECT_NEAR(turn(1000), 100, 1e-6);
}

TEST_F(SpindleNodeTest, TheNcUnitCanLockItToo) {
  enable();
  turn(1, false, kSpindleLock);
  EXPECT_TRUE(node_.locked());
  EXPECT_NEAR(turn(500), 0, 1e-9);
}

/// Keeps one state, and counts how often it was saved.
class OneState : public NodeMemory {
 public:
  std::vector<std::uint8_t> load() override { return state; }
  void save(std::span<const std::uint8_t> s) override {
    state.assign(s.begin(), s.end());
    ++saves;
  }
  std::vector<std::uint8_t> state;
  int saves = 0;
};

TEST(SpindleLock, IsKeptWhenItClosesAndHoldsAfterSwitchingOn) {
  OneState memory;
  const auto step = [](SpindleNode& node, Tick k, std::uint8_t flags, std::uint16_t controlword) {
    GroupCommand command;
    command.tick = low16(k - 1);
    command.controlword = controlword;
    command.spindle_mode = GroupCommand::SpindleMode::clockwise;
    command.spindle_speed = 100;
    command.flags = flags;
    Frames out;
    node.step(k, Frames{encode(OvertravelState{}), encode(command)}, out);
    return decode_drive_status(out.at(0)).value();
  };
  {
    SpindleNode node(Machine{}, &memory);
    EXPECT_EQ(memory.saves, 0);
    step(node, 0, kSpindleLock, cia402::kShutdown);
    EXPECT_EQ(memory.saves, 1) << "at once";
    step(node, 1, kSpindleLock, cia402::kShutdown);
    EXPECT_EQ(memory.saves, 1) << "once";
  }
  EXPECT_EQ(decode_spindle_lock(memory.state), true);
  SpindleNode node(Machine{}, &memory);
  EXPECT_TRUE(node.locked());
  Tick k = 0;
  for (const std::uint16_t cw : {cia402::kShutdown, cia402::kShutdown, cia402::kSwitchOn})
    step(node, k++, 0, cw);
  DriveStatus status;
  for (int i = 0; i < 200; ++i) status = step(node, k++, 0, cia402::kEnable);
  EXPECT_EQ(cia402::state_of(status.statusword), cia402::State::operation_enabled);
  EXPECT_NE(status.statusword & cia402::kLocked, 0);
  EXPECT_EQ(status.second_encoder, 0) << "every start is refused";
  step(node, k++, kResetLatch, cia402::kEnable);
  EXPECT_TRUE(node.locked()) << "the button must be held";
  for (int i = 0; i < 2; ++i) step(node, k++, kResetLatch, cia402::kEnable);
  EXPECT_FALSE(node.locked());
  EXPECT_EQ(decode_spindle_lock(memory.state), false);
}

TEST(SpindleLock, IsNotKeptForASilenceAfterTheEndOfTheBus) {
  OneState memory;
  SpindleNode node(Machine{}, &memory);
  Frames out;
  node.step(0, Frames{encode(OvertravelState{}), encode(GroupCommand{})}, out);
  node.leave_bus();
  for (Tick k = 1; k < 10; ++k) node.step(k, {}, out);
  EXPECT_TRUE(node.locked());
  EXPECT_EQ(memory.saves, 0);
}

TEST(SpindleLock, RefusesWhatItCannotUnderstand) {
  for (const std::vector<std::uint8_t>& bad :
       {std::vector<std::uint8_t>{1}, {2, 1}, {1, 2}, {1, 1, 0}}) {
    EXPECT_FALSE(decode_spindle_lock(bad));
    OneState memory;
    memory.state = bad;
    EXPECT_THROW(SpindleNode(Machine{}, &memory), MemoryError);
  }
}

}  // namespace
}  // namespace vcnc::spindle_node_test
