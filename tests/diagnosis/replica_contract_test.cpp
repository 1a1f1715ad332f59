// Every effect of the library, injected into the whole machine: the replica with the same effect
// reproduces the recording, from nothing but its commands.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "diagnosis/candidates/effect_stage.hpp"
#include "model/effects/numbers.hpp"
#include "tests/diagnosis/recorded_run.hpp"

namespace vcnc::replica_contract_test {
namespace {

constexpr double nm = 1e-9;

/// Which do not settle: play on a contact without damping, and a limit cycle of 1 um. The error of
/// the spline's velocity (about 1 um/s) decides when they tip over.
const std::set<std::string> kChaotic{"backlash", "encoder_quantisation"};
/// Which this motion does not excite.
const std::set<std::string> kIdle{"torque_limit"};

std::vector<std::string> hypotheses() {
  std::vector<std::string> names;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (no_hypothesis<Effect>().empty()) names.emplace_back(Effect::text.name);
  });
  return names;
}

template <class Effect>
RecordedRun run_with() {
  constexpr bool turning =
      Effect::place == Place::rotary_axis || Effect::text.showing == Showing::spin;
  constexpr bool of_a = Effect::text.name == "pivot_length" || Effect::text.name[0] == 'a';
  const std::size_t axis = !turning ? kX : of_a ? kA : kC;
  Showing showing = Effect::text.showing;
  if (turning) showing = Showing::spin;
  if (showing == Showing::s_piece || showing == Showing::corner || showing == Showing::circle_feeds)
    showing = Showing::circle;
  Effects effects;
  // What servo and friction effects need to show.
  if (Effect::text.family == Family::servo || Effect::text.family == Family::friction ||
      Effect::text.family == Family::mechanics)
    effects.axis[axis].get<Coulomb>() = Coulomb::nominal(is_rotary(axis));
  const Effect nominal = nominal_of<Effect>(is_rotary(axis));
  if constexpr (of_axis(Effect::place))
    effects.axis[axis].get<Effect>() = nominal;
  else
    effects.get<Effect>() = nominal;
  ExperimentOptions options;
  if (showing == Showing::circle) options.feed_mm_min = 5000;
  return recorded_run(showing, axis, effects, options);
}

class ReplicaContract : public testing::TestWithParam<std::string> {};

TEST_P(ReplicaContract, ReproducesTheWholeMachine) {
  RecordedRun run;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (Effect::text.name != GetParam()) return;
    run = run_with<Effect>();
  });
  ASSERT_GT(run.record.samples(), 1000u);
  ASSERT_TRUE(run.record.warnings.empty()) << run.record.warnings.front();
  const MachineReplica replica = run.replica();
  const auto quick = replica.predict(run.true_machine);
  const auto full = replica.predict_in_full(run.true_machine);
  Machine without = run.true_machine;
  without.effects = Effects();
  if (GetParam() != "coulomb")
    for (std::size_t i = 0; i < kAxisCount; ++i)
      without.effects.axis[i].get<Coulomb>() = run.true_machine.effects.axis[i].get<Coulomb>();
  const auto lacking = replica.predict(without);
  const auto of = [&](const auto& prediction, SignalKind kind, bool rotary = false) {
    return misfit(run, replica, prediction, kind, rotary);
  };
  using enum SignalKind;
  const double lacking_sum = of(lacking, position).rms + of(lacking, position, true).rms +
                             of(lacking, deflection).rms + 1e-9 * of(lacking, force).rms;
  if (!kIdle.contains(GetParam())) {
    EXPECT_GT(lacking_sum, 1.5 * nm) << "does not show";
  }
  if (kChaotic.contains(GetParam())) {
    EXPECT_LT(of(full, position).rms, 0.75 * of(lacking, position).rms);
    return;
  }
  for (const bool rotary : {false, true}) {
    // Dry friction lets go a little earlier or later.
    EXPECT_LT(of(full, position, rotary).rms, 0.5 * nm);
    EXPECT_LT(of(full, position, rotary).largest, 10 * nm);
    EXPECT_LT(of(full, twist, rotary).rms, 0.5 * nm);
    EXPECT_LT(of(full, force, rotary).rms, rotary ? 0.05 : 1.6);  // quantised in 4 N, 50 mNm
    EXPECT_LT(of(full, force, rotary).largest, rotary ? 0.5 : 25);
  }
  EXPECT_LT(of(full, deflection).rms, 1 * nm);
  EXPECT_LT(of(full, deflection).largest, 20 * nm);
  // The drift's ring of samples is coarser, which shows while the ball touches the piece first.
  // Where the ball is slow the mean over 20 ms holds some of the signals' error itself; a loop
  // closed on what is read late answers jumps of the acceleration.
  const std::string effect = GetParam();
  const double coarse = effect == "clock_drift"                                             ? 0.08
                        : effect.starts_with("signal_") || effect == "load_encoder_latency" ? 0.03
                                                                                            : 0.02;
  const double change = of(replica.predict(run.declared), deflection).rms;
  EXPECT_LT(of(quick, deflection).rms, 0.1 * nm + coarse * change);
}

INSTANTIATE_TEST_SUITE_P(Library, ReplicaContract, testing::ValuesIn(hypotheses()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace vcnc::replica_contract_test
