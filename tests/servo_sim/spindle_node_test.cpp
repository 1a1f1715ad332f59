#include "servo_sim/spindle_node.hpp"

#include <gtest/gtest.h>

namespace vcnc {
namespace {

class SpindleNodeTest : public testing::Test {
 protected:
  DriveStatus cycle(GroupCommand::SpindleMode mode, bool tripped = false, std::uint8_t flags = 0,
                    std::uint16_t cw = cia402::kEnable) {
    GroupCommand c;
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
  turn(1, true, kResetLatch);
  EXPECT_TRUE(node_.locked()) << "no reset while the cause lasts";
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

}  // namespace
}  // namespace vcnc
