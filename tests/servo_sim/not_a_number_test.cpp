// Commands that are no numbers: they count as not sent, and leave the simulation sane.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "model/drive/spindle.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace vcnc::not_a_number_test {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

GroupCommand enabled(std::uint16_t controlword) {
  GroupCommand command;
  command.controlword = controlword;
  return command;
}

TEST(NotANumber, SetPointLeadsToAQuickStopAsIfNoCommandHadCome) {
  const Machine machine;
  const auto truth = open_local_truth();
  // One of another axis as well: laws may read it.
  for (const std::size_t axis : {kX, kC}) {
    DriveNode node(kX, machine, 1, *truth);
    Frames out;
    Tick k = 0;
    const auto cycle = [&](GroupCommand command) {
      out.clear();
      command.tick = low16(k - 1);
      node.step(k++, Frames{encode(command)}, out);
      return decode_drive_status(out.at(0)).value();
    };
    for (const std::uint16_t cw : {cia402::kShutdown, cia402::kShutdown, cia402::kSwitchOn,
                                   cia402::kEnable, cia402::kEnable})
      cycle(enabled(cw));
    GroupCommand bad = enabled(cia402::kEnable);
    bad.axes[axis].position = kNoNumber;
    for (int i = 0; i < kSilentCyclesAllowed; ++i)
      EXPECT_EQ(cia402::state_of(cycle(bad).statusword), cia402::State::operation_enabled);
    EXPECT_EQ(cia402::state_of(cycle(bad).statusword), cia402::State::quick_stop);
    ASSERT_EQ(out.size(), 2u);
    EXPECT_EQ(decode_emergency(out[1])->code, kCommandLostError);
    for (int i = 0; i < 20; ++i) EXPECT_NEAR(cycle(bad).position, 0, 1e-9);
  }
}

TEST(NotANumber, SpindleSpeedMeansOff) {
  const Machine machine;
  SpindleNode node(machine);
  Frames out;
  Tick k = 0;
  const auto cycle = [&](GroupCommand command) {
    out.clear();
    command.tick = low16(k - 1);
    node.step(k++, Frames{encode(command)}, out);
    return decode_drive_status(out.at(0)).value();
  };
  for (const std::uint16_t cw : {cia402::kShutdown, cia402::kShutdown, cia402::kSwitchOn})
    cycle(enabled(cw));
  GroupCommand command = enabled(cia402::kEnable);
  command.spindle_mode = GroupCommand::SpindleMode::clockwise;
  command.spindle_speed = 20;
  for (int i = 0; i < 100; ++i) cycle(command);
  EXPECT_NEAR(cycle(command).second_encoder, 20, 1e-5);  // the resolution of the speed
  command.spindle_speed = kNoNumber;
  DriveStatus status;
  for (int i = 0; i < 60; ++i) status = cycle(command);  // 20 rad/s at 400 rad/s^2: 50 ms
  EXPECT_EQ(status.second_encoder, 0);
}

// 2.4e8 turns would be counted one by one ten times a cycle.
TEST(SpindleDrive, FastAndSlowToBrakeOrientsWithoutCountingTurns) {
  SpindleParams params;
  params.max_speed = 20000;
  params.acceleration = 1e5;
  SpindleDrive fast(params);
  for (int i = 0; i < 300; ++i) fast.step(SpindleMode::clockwise, 20000);
  params.acceleration = 1;
  SpindleDrive slow(params);
  for (int i = 0; i < 20000; ++i) slow.step(SpindleMode::clockwise, 20000);
  const SpindleCycle before = slow.step(SpindleMode::clockwise, 20000);
  EXPECT_NEAR(before.speed, 20, 0.01);
  for (int i = 0; i < 60000; ++i) slow.step(SpindleMode::orient, 0);
  const SpindleCycle after = slow.step(SpindleMode::orient, 0);
  EXPECT_TRUE(after.oriented);
  EXPECT_EQ(after.angle, 0);
}

}  // namespace
}  // namespace vcnc::not_a_number_test
