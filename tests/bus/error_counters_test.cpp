// Fault confinement against the sequences of ISO 11898-1.
#include "bus/error_counters.hpp"

#include <gtest/gtest.h>

namespace vcnc::error_counters_test {
namespace {

using State = ErrorCounters::State;

TEST(ErrorCounters, ASenderGoesPassiveAfter16AndBusOffAfter32Errors) {
  ErrorCounters c;
  for (int error = 1; error <= 32; ++error) {
    c.send_error();
    EXPECT_EQ(c.transmit(), 8 * error);
    EXPECT_EQ(c.warning(), error >= 12);
    EXPECT_EQ(c.state(), error < 16   ? State::error_active
                         : error < 32 ? State::error_passive
                                      : State::bus_off);
  }
  c.send_error();
  c.sent();
  EXPECT_EQ(c.transmit(), 256) << "who is off does not count";
}

TEST(ErrorCounters, EachFrameSentTakesOneOffDownToZero) {
  ErrorCounters c;
  c.sent();
  EXPECT_EQ(c.transmit(), 0);
  for (int i = 0; i < 16; ++i) c.send_error();
  EXPECT_EQ(c.state(), State::error_passive);
  c.sent();
  EXPECT_EQ(c.transmit(), 127);
  EXPECT_EQ(c.state(), State::error_active);
  // One error in nine frames: 8 up, 8 down. One in eight climbs.
  for (int round = 0; round < 100; ++round) {
    c.send_error();
    for (int i = 0; i < 8; ++i) c.sent();
  }
  EXPECT_EQ(c.transmit(), 127);
}

TEST(ErrorCounters, AReceiverGoesPassiveButNeverOff) {
  ErrorCounters c;
  for (int i = 0; i < 120; ++i) c.receive_error(false);
  EXPECT_EQ(c.receive(), 120);
  c.receive_error(true);
  EXPECT_EQ(c.receive(), 128);
  EXPECT_EQ(c.state(), State::error_passive);
  for (int i = 0; i < 1000; ++i) c.receive_error(true);
  EXPECT_EQ(c.state(), State::error_passive);
  c.received();
  EXPECT_EQ(c.receive(), 127);
  EXPECT_EQ(c.state(), State::error_active);
  c.received();
  EXPECT_EQ(c.receive(), 126);
}

TEST(ErrorCounters, AloneOnTheBusItStaysPassive) {
  ErrorCounters c;
  for (int i = 0; i < 1000; ++i) c.not_acknowledged();
  EXPECT_EQ(c.transmit(), 128);
  EXPECT_EQ(c.state(), State::error_passive);
}

TEST(ErrorCounters, ReturnsAfter128SequencesOf11RecessiveBits) {
  ErrorCounters c;
  c.recessive(1000);
  for (int i = 0; i < 32; ++i) c.send_error();
  c.recessive(127);
  EXPECT_EQ(c.state(), State::bus_off);
  c.recessive(1);
  EXPECT_EQ(c.state(), State::error_active);
  EXPECT_EQ(c.transmit(), 0);
  EXPECT_EQ(c.receive(), 0);
}

}  // namespace
}  // namespace vcnc::error_counters_test
