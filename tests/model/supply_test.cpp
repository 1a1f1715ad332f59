#include "model/safety/supply.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::supply_test {
namespace {

constexpr double kStep = 1e-3;

/// Steps without mains until it is dark; how many that took.
int steps_until_dark(Supply& supply, const SupplyLoad& load) {
  int steps = 0;
  while (!supply.dark() && steps < 10'000'000) {
    supply.step(false, load, kStep);
    ++steps;
  }
  return steps;
}

// t = E / P.
TEST(Supply, LastsAsLongAsItsEnergyOverThePower) {
  const SupplyParams params{.hold_up_energy = 100, .electronics_power = 150, .drive_power = 20};
  for (const int drives : {0, 5, 6}) {
    Supply supply(params);
    const double power = 150 + 20 * drives;
    EXPECT_EQ(steps_until_dark(supply, {.drives = drives}),
              static_cast<int>(std::ceil(100 / power / kStep)))
        << drives;
    EXPECT_EQ(supply.energy(), 0);
  }
}

// The worked example of a buffered 24 V supply: 0.5 F from 24 V to 18 V at 0.85 is 53.55 J in the
// load; 40 W take them in 1.34 s.
TEST(Supply, AgreesWithTheHoldUpTimeOfACapacitor) {
  const double energy = 0.5 * 0.5 * (24. * 24 - 18. * 18) * 0.85;
  Supply supply({.hold_up_energy = energy, .electronics_power = 40});
  EXPECT_NEAR(steps_until_dark(supply, {}) * kStep, 1.34, 2e-3);
}

// Braking from v0 with constant force: what goes back into the circuit is burnt, so the energy is
// that of the electronics alone. Accelerating: E = P_e t + m v^2 / 2 eta.
TEST(Supply, PaysForAccelerationAndGetsNothingBack) {
  const double mass = 500, acceleration = 2, seconds = 0.4;
  const auto spent = [&](double sign) {
    Supply supply({.hold_up_energy = 1e4, .electronics_power = 100, .efficiency = 0.8});
    const int steps = static_cast<int>(std::lround(seconds / kStep));
    for (int i = 0; i < steps; ++i) {
      const double t = (i + 0.5) * kStep;
      const double v = sign > 0 ? acceleration * t : acceleration * (seconds - t);
      supply.step(false, {.motion_power = sign * mass * acceleration * v}, kStep);
    }
    return 1e4 - supply.energy();
  };
  const double v = acceleration * seconds;
  EXPECT_NEAR(spent(+1), 100 * seconds + 0.5 * mass * v * v / 0.8, 1e-6);
  EXPECT_NEAR(spent(-1), 100 * seconds, 1e-6);
}

TEST(Supply, ASignalComesAfterItsDelayAndGoesWithTheMains) {
  Supply supply({.signal_delay = 5e-3});
  for (int i = 1; i <= 4; ++i) {
    supply.step(false, {}, kStep);
    EXPECT_FALSE(supply.failing()) << i;
  }
  supply.step(false, {}, kStep);
  EXPECT_TRUE(supply.failing());
  supply.step(true, {}, kStep);
  EXPECT_FALSE(supply.failing());
  supply.step(false, {}, kStep);
  EXPECT_FALSE(supply.failing()) << "counted anew";
}

TEST(Supply, LossesAddUpWithinARun) {
  Supply supply({.hold_up_energy = 0.3, .electronics_power = 100});
  supply.step(false, {}, kStep);
  supply.step(false, {}, kStep);
  for (int i = 0; i < 1000; ++i) supply.step(true, {}, kStep);
  EXPECT_NEAR(supply.energy(), 0.1, 1e-12) << "not charged again";
  EXPECT_FALSE(supply.dark());
  supply.step(false, {.drives = 1}, kStep);
  EXPECT_TRUE(supply.dark());
  supply.step(true, {}, kStep);
  EXPECT_TRUE(supply.dark()) << "until it is switched on again";
}

TEST(Supply, WithoutAStoreTheLossIsDarkAtOnce) {
  Supply supply({.hold_up_energy = 0});
  supply.step(true, {.drives = 5}, kStep);
  EXPECT_FALSE(supply.dark());
  supply.step(false, {.drives = 5}, kStep);
  EXPECT_TRUE(supply.dark());
}

}  // namespace
}  // namespace vcnc::supply_test
