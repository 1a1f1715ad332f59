#include "controller/nc_record.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "controller/retract.hpp"

namespace vcnc::nc_record_test {
namespace {

NcRecord sample() {
  NcRecord r;
  r.stage = RunStage::retracting;
  r.program = "/home/user/s piece.ngc";
  r.program_hash = hash_of("G1 X1");
  r.machine_hash = hash_of("machine");
  r.cycle = 123'456'789'012;
  r.held = {54321, 0.1 + 0.2};
  r.position = {1, -2, 3e-9, 0.1, -1e300};
  r.path_point = {0.5, 0.25, -0.0, 1. / 3, 7};
  r.deflection = {1e-3, -2e-3, 3e-3};
  r.alarm = 4001;
  r.protection = {ProtectionState::hard, ProtectionCause::slip, 2.5e-3};
  return r;
}

TEST(NcRecord, ComesBackToTheBit) {
  const NcRecord r = sample();
  const auto bytes = encode_record(r);
  const auto back = decode_record(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(encode_record(*back), bytes);
  EXPECT_EQ(back->program, r.program);
  EXPECT_EQ(back->program_hash, r.program_hash);
  EXPECT_EQ(back->machine_hash, r.machine_hash);
  EXPECT_EQ(back->cycle, r.cycle);
  EXPECT_EQ(back->held.cycles, r.held.cycles);
  EXPECT_EQ(back->held.on_path, r.held.on_path);
  EXPECT_EQ(back->position, r.position);
  EXPECT_EQ(back->path_point, r.path_point);
  EXPECT_EQ(back->deflection, r.deflection);
  EXPECT_EQ(back->alarm, r.alarm);
  EXPECT_EQ(back->protection, r.protection);
  EXPECT_NE(r.program_hash, r.machine_hash);
}

TEST(NcRecord, RefusesWhatIsNone) {
  const auto bytes = encode_record(sample());
  for (std::size_t cut = 0; cut < bytes.size(); ++cut)
    EXPECT_FALSE(decode_record(std::span(bytes).first(cut))) << cut;
  auto longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(decode_record(longer));
  const auto with = [&](std::size_t at, std::uint8_t value) {
    auto changed = bytes;
    changed[at] = value;
    return decode_record(changed);
  };
  EXPECT_FALSE(with(0, 2)) << "version";
  EXPECT_FALSE(with(1, 9)) << "stage";
  EXPECT_FALSE(with(2, 4)) << "state";
  EXPECT_FALSE(with(3, 8)) << "cause";
  EXPECT_FALSE(with(7, 0x80)) << "negative alarm";
  NcRecord r = sample();
  r.position[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(decode_record(encode_record(r)));
  r = sample();
  r.held.on_path = -1;
  EXPECT_FALSE(decode_record(encode_record(r)));
}

TEST(NcRecord, AProbeThatTouchedIsDrivenOffByHand) {
  const Machine machine;
  NcRecord r = sample();
  r.position = {0.1, 0.2, 0.3, 0, 0};
  r.deflection = {0, 0, 5e-6};
  EXPECT_FALSE(driven_off_by_hand(machine, r)) << "below what counts as contact";
  EXPECT_EQ(position_at_switch_on(machine, r), r.position);
  r.deflection = {0.5e-3, 0, 0};  // trunnion: the probe's frame is the machine's
  EXPECT_TRUE(driven_off_by_hand(machine, r));
  const AxisVector free = position_at_switch_on(machine, r);
  EXPECT_NEAR(free[0], 0.1 + 0.5e-3 + kRetractClearance, 1e-12);
  EXPECT_EQ(free[1], 0.2);
}

}  // namespace
}  // namespace vcnc::nc_record_test
