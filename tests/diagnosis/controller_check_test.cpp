#include "diagnosis/healthy/controller_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/records/series.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "tests/diagnosis/stroke_run.hpp"

namespace vcnc::controller_check_test {
namespace {

using stroke_run::declared, stroke_run::recorded;

Machine with(const std::string& key, double value, Machine machine = declared()) {
  move_number(machine, key, value);
  return machine;
}

Machine with_other_friction() {
  Machine machine = declared();
  machine.effects.axis[kX].get<Coulomb>().level = 140;
  machine.effects.axis[kX].get<Viscous>().coefficient = 800;
  return machine;
}

std::optional<Confirmation> told_of(const Machine& truth, const Machine& without,
                                    const Machine& found) {
  const Record record = recorded(truth, 1);
  const MachineReplica replica(record, declared(), std::nullopt);
  return ControllerCheck(record, replica.channels(), declared())
      .of(kX, replica.predict(without), replica.predict(found));
}

/// RMS of r, and of the position, of what takes the declared machine to another.
std::pair<double, double> made_by(const Machine& other) {
  const Record record = recorded(declared(), 1);
  const MachineReplica replica(record, declared(), std::nullopt);
  const Prediction before = replica.predict(declared()), after = replica.predict(other);
  SeriesOfChannels change(before.size());
  for (std::size_t c = 0; c < change.size(); ++c)
    for (std::size_t k = 0; k < before[c].size(); ++k)
      change[c].push_back(after[c][k] - before[c][k]);
  const ControllerCheck check(record, replica.channels(), declared());
  return {std::sqrt(mean_square(check.equation(kX, change))), std::sqrt(mean_square(change[0]))};
}

TEST(ControllerCheck, AForceMakesNothing) {
  const auto [r, position] = made_by(with_other_friction());
  EXPECT_GT(position, 50e-9);
  EXPECT_LT(r, 0.1 * position);
}

class OfAGain : public testing::TestWithParam<std::pair<const char*, double>> {};

TEST_P(OfAGain, ATrueOneIsConfirmed) {
  const auto& [key, value] = GetParam();
  const auto b = told_of(with(key, value, with_other_friction()), with_other_friction(),
                         with(key, value, with_other_friction()));
  ASSERT_TRUE(b);
  EXPECT_NEAR(b->share, 1, 0.1);
  EXPECT_FALSE(b->contradicts());
}

TEST_P(OfAGain, OneThatStandsForFrictionIsContradicted) {
  const auto& [key, value] = GetParam();
  const auto b = told_of(with_other_friction(), declared(), with(key, value));
  ASSERT_TRUE(b);
  EXPECT_NEAR(b->share, 0, 0.2);
  EXPECT_TRUE(b->contradicts());
}

INSTANTIATE_TEST_SUITE_P(
    OfServo, OfAGain,
    testing::Values(std::pair{"effects.X.kv_error.deviation_percent", 10.0},
                    std::pair{"effects.X.velocity_ff_error.deviation_percent", 2.0},
                    std::pair{"effects.X.acceleration_ff_error.deviation_percent", 10.0},
                    std::pair{"effects.X.velocity_gain_error.deviation_percent", -20.0},
                    std::pair{"effects.X.integral_time_error.deviation_percent", 40.0},
                    std::pair{"effects.X.command_delay.delay_ms", 0.5}),
    [](const auto& of) {
      const std::string key = of.param.first;
      const std::size_t from = key.find("X.") + 2;
      return key.substr(from, key.rfind('.') - from);
    });

TEST(ControllerCheck, SaysNothingOfAForceAndWhereNoForceIsRecorded) {
  EXPECT_FALSE(told_of(with_other_friction(), declared(), with_other_friction()));
  const Record record = recorded(declared(), 1, false);
  const MachineReplica replica(record, declared(), std::nullopt);
  const Prediction before = replica.predict(declared()),
                   after = replica.predict(with("effects.X.kv_error.deviation_percent", 10.0));
  EXPECT_FALSE(ControllerCheck(record, replica.channels(), declared()).of(kX, before, after));
}

}  // namespace
}  // namespace vcnc::controller_check_test
