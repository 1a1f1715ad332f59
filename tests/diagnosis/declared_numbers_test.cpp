// Declared numbers of an axis that are no more what they were in the healthy run.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/healthy/differential.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "tests/diagnosis/stroke_run.hpp"

namespace vcnc::declared_numbers_test {
namespace {

using stroke_run::declared;
using stroke_run::recorded;

/// What changed between a healthy run and one of `now`, of servo loops, friction and what a wave,
/// a spring or a weight on X does.
Diagnosis change(const Machine& now) {
  const Record reference = recorded(declared(), 16), record = recorded(now, 17);
  MachineReplica of_reference(reference, declared(), std::nullopt),
      replica(record, declared(), std::nullopt);
  const HealthyRun healthy = healthy_run_with_forces(reference, of_reference, declared());
  const DifferentialRecord difference = less_healthy(record, healthy);
  replica.apply(difference.unknown);
  std::vector<Candidate> all = candidates(declared());
  std::erase_if(all, [](const Candidate& c) {
    static constexpr std::array<std::string_view, 9> tried{"kv_error",
                                                           "velocity_gain_error",
                                                           "integral_time_error",
                                                           "torque_constant_error",
                                                           "load_encoder_error",
                                                           "cable_chain",
                                                           "weight_imbalance",
                                                           "friction_asymmetry",
                                                           "viscous"};
    return c.place != "X" || std::find(tried.begin(), tried.end(), c.effect) == tried.end();
  });
  return diagnose({record, replica, declared(), all}, difference);
}

TEST(DeclaredNumbers, OneFarOutOfItsToleranceIsToldAndNothingElse) {
  Machine now = declared();
  const std::string key = "axes.X.load_kg";
  const double load = number_of(now, key);
  now.effects.deviations.push_back({key, 1.6 * load});
  const Diagnosis d = change(now);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].place, key);
  EXPECT_NEAR(number_of(d.found, key), 1.6 * load, 0.04 * load);
}

TEST(DeclaredNumbers, SeveralDoNotStandForATorqueConstant) {
  // It is both masses and all friction at once.
  Machine now = declared();
  now.effects.axis[kX].get<TorqueConstantError>().deviation = -0.06;
  const Diagnosis d = change(now);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "torque_constant_error");
  EXPECT_NEAR(number_of(d.found, "effects.X.torque_constant_error.deviation_percent"), -6, 1);
}

// About where the machine counts nought it would be a spring and a weight.
TEST(DeclaredNumbers, ASpringIsToldWithWhereItRests) {
  Machine now = declared();
  auto& chain = now.effects.axis[kX].get<CableChain>();
  chain.stiffness = 1000;
  chain.rest = 0.12;
  const Diagnosis d = change(now);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "cable_chain");
  EXPECT_NEAR(number_of(d.found, "effects.X.cable_chain.stiffness_N_per_mm"), 1, 0.05);
  EXPECT_NEAR(number_of(d.found, "effects.X.cable_chain.rest_mm"), 120, 1);
}

}  // namespace
}  // namespace vcnc::declared_numbers_test
