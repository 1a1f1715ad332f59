#include "model/safety/protection.hpp"

#include <gtest/gtest.h>

#include <random>

namespace vcnc::protection_test {
namespace {

using State = ProtectionState;
using Cause = ProtectionCause;

ProtectionEvidence at(double x_mm, double y_mm = 0, double z_mm = 0) {
  return {.sampled = true, .deflection = Vec3(x_mm, y_mm, z_mm) * 1e-3};
}

State after(Protection& p, const ProtectionEvidence& seen, bool reset = false) {
  p.step(seen, reset);
  return p.state();
}

// Range +-2 mm, vertical: the stylus of 10 g shifts z by 0.074 mm.
TEST(Protection, StagesFollowTheDeflection) {
  Protection p{ProbeParams{}};
  EXPECT_EQ(after(p, at(1.59)), State::normal);
  EXPECT_EQ(after(p, at(1.61)), State::warn);
  EXPECT_EQ(after(p, at(-1.5)), State::normal);
  EXPECT_EQ(after(p, at(0, 2.01)), State::soft_stop);
  EXPECT_EQ(p.cause(), Cause::range);
  EXPECT_NEAR(p.deflection(), 2.01e-3, 1e-12);
  EXPECT_EQ(after(p, at(0, 2.49)), State::soft_stop);
  EXPECT_EQ(after(p, at(0, 2.51)), State::hard);
  EXPECT_EQ(p.cause(), Cause::runaway);
}

TEST(Protection, LimitsOfTravelAndForce) {
  ProbeParams wide;
  wide.range = 20e-3;  // only the limits are left
  wide.overtravel_force_lateral = 1000;
  for (const auto& [seen, hard] :
       {std::pair{at(17.9), false}, std::pair{at(12.8, 12.8), true},
        std::pair{at(0, 0, 4.9), false}, std::pair{at(0, 0, -5.0), true}}) {
    Protection p{wide};
    EXPECT_EQ(after(p, seen) == State::hard, hard) << seen.deflection.transpose();
  }
  wide.overtravel_force_lateral = 20;  // 20 N / 1.324 N/mm = 15.106 mm
  Protection just_below{wide}, just_above{wide};
  EXPECT_NE(after(just_below, at(15.0)), State::hard);
  EXPECT_EQ(after(just_above, at(15.2)), State::hard);
  EXPECT_EQ(just_above.cause(), Cause::limit);
}

TEST(Protection, FlagsAndSilenceAreHard) {
  for (int which = 0; which < 3; ++which) {
    ProtectionEvidence seen = at(0.1);
    (which == 0 ? seen.overtravel : which == 1 ? seen.signal_fault : seen.slip) = true;
    Protection p{ProbeParams{}};
    EXPECT_EQ(after(p, seen), State::hard);
  }
  Protection p{ProbeParams{}};
  for (int i = 0; i < 100; ++i) EXPECT_EQ(after(p, {}), State::normal) << "never heard: not silent";
  after(p, at(0));
  EXPECT_EQ(after(p, {}), State::normal);
  EXPECT_EQ(after(p, {}), State::normal);
  EXPECT_EQ(after(p, {}), State::hard);
  EXPECT_EQ(p.cause(), Cause::silent);
}

TEST(Protection, OnlyTheOperatorOpensTheLatchAndOnlyWhenTheCauseIsGone) {
  Protection p{ProbeParams{}};
  after(p, at(2.1));
  EXPECT_EQ(after(p, at(0)), State::soft_stop);
  EXPECT_EQ(after(p, at(2.1), true), State::soft_stop) << "cause still there";
  EXPECT_EQ(after(p, {}, true), State::soft_stop) << "nothing seen, nothing gone";
  EXPECT_EQ(after(p, at(0.5), true), State::normal);
}

TEST(Protection, SleepsWithoutTheProbeButKeepsTheLatch) {
  ProbeParams out;
  out.in_spindle = false;
  Protection p{out};
  EXPECT_EQ(after(p, at(9)), State::normal);
}

/// Whatever comes, it never goes down by itself once latched, and every hard evidence is answered
/// at once.
TEST(Protection, NeverRelaxesByItself) {
  std::mt19937_64 random(5);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (int run = 0; run < 200; ++run) {
    Protection p{ProbeParams{}};
    State before = State::normal;
    for (int i = 0; i < 200; ++i) {
      ProtectionEvidence seen;
      if (uniform() < 0.95)
        seen = at(5 * uniform() * uniform() - 1, 2 * uniform() - 1, uniform() - 0.5);
      seen.slip = seen.sampled && uniform() < 0.003;
      const State now = after(p, seen);
      if (before >= State::soft_stop) {
        ASSERT_GE(now, before);
      }
      if (seen.slip || seen.deflection.head<2>().norm() > 2.51e-3 * std::sqrt(2.0)) {
        ASSERT_EQ(now, State::hard);
      }
      before = now;
    }
  }
}

}  // namespace
}  // namespace vcnc::protection_test
