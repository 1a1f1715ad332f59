// All numbers fitted at the same time, against machines whose numbers are known.
#include "diagnosis/fit/joint_fit.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "diagnosis/fit/settling.hpp"
#include "toy_machine.hpp"

namespace vcnc::joint_fit_test {
namespace {

constexpr std::size_t kCoulomb = 1, kViscous = 2, kPlay = 4, kPitch = 7;

/// The record of `truth`, and the declared machine with some effects in its fit, begun elsewhere.
struct Begun {
  Begun(const Machine& truth,
        const std::vector<std::pair<std::size_t, std::vector<double>>>& effects)
      : record(measured(truth)), replica(record), evidence(record, replica, Machine()) {
    m = fit_declared(evidence, Machine());
    for (const auto& [candidate, values] : effects) {
      const Candidate c = toy::candidates()[candidate];
      AddedEffect added{.candidate = candidate};
      for (std::size_t i = 0; i < values.size(); ++i) {
        added.numbers.push_back({.number = c.numbers[i], .value = values[i], .shape = i > 0});
        FreeNumber& number = added.numbers.back().number;
        if (number.typical == 0) number.typical = 30;  // of a phase
      }
      m.added.push_back(std::move(added));
    }
    m.machine = with(m.machine, m.numbers());
    stay(evidence, m);
  }
  static Record measured(const Machine& truth) {
    Record record = toy::commands(400, 4);
    toy::measure(record, truth, 3);
    return record;
  }
  double found(const std::string& key) const { return number_of(m.machine, key); }
  double left_per_sample() const {
    return evidence.chi2(m.residual, Role::held_out) / evidence.count(Role::held_out);
  }

  Record record;
  toy::ToyReplica replica;
  Evidence evidence;
  FittedMachine m;
};

TEST(JointFit, RecoversNumbersThatHangTogether) {
  Begun b(toy::machine({{"effects.X.coulomb.level_N", 180},
                        {"effects.X.viscous.coefficient_Ns_per_m", 1500},
                        {"effects.X.load_play.width_um", 5}}),
          {{kCoulomb, {20}}, {kViscous, {9000}}, {kPlay, {1}}});
  EXPECT_GT(b.left_per_sample(), 100);
  fit_jointly(b.evidence, b.m, every(b.m));
  EXPECT_NEAR(b.found("effects.X.coulomb.level_N"), 180, 0.5);
  EXPECT_NEAR(b.found("effects.X.viscous.coefficient_Ns_per_m"), 1500, 5);
  EXPECT_NEAR(b.found("effects.X.load_play.width_um"), 5, 0.02);
  EXPECT_NEAR(b.left_per_sample(), 1, 0.1);
}

TEST(JointFit, FollowsAWaveWhosePeriodIsAPerCentOff) {
  Begun b(toy::machine({{"effects.X.pitch_periodic.amplitude_um", 3},
                        {"effects.X.pitch_periodic.period_mm", 10},
                        {"effects.X.pitch_periodic.phase_deg", 30}}),
          {{kPitch, {2, 10.1, 45}}});
  EXPECT_GT(b.left_per_sample(), 2);
  fit_jointly(b.evidence, b.m, every(b.m));
  EXPECT_NEAR(b.found("effects.X.pitch_periodic.amplitude_um"), 3, 0.02);
  EXPECT_NEAR(b.found("effects.X.pitch_periodic.period_mm"), 10, 0.005);
  EXPECT_NEAR(b.left_per_sample(), 1, 0.1);
}

TEST(JointFit, KeepsNumbersWithinTheirRangeAndTheOthersFittedBeside) {
  Begun b(toy::machine({{"effects.X.coulomb.level_N", 180}, {"effects.X.load_play.width_um", 5}}),
          {{kCoulomb, {100}}, {kPlay, {1}}});
  b.m.added[0].numbers[0].number.max = 150;
  fit_jointly(b.evidence, b.m, every(b.m));
  EXPECT_DOUBLE_EQ(b.found("effects.X.coulomb.level_N"), 150);
  EXPECT_NEAR(b.found("effects.X.load_play.width_um"), 5, 0.02);
}

TEST(JointFit, StaysWhereNothingIsToBeGained) {
  Begun b(toy::machine({{"effects.X.load_play.width_um", 5}}), {{kPlay, {5}}});
  fit_jointly(b.evidence, b.m, every(b.m));
  const double once = b.found("effects.X.load_play.width_um");
  EXPECT_NEAR(once, 5, 0.02);
  fit_jointly(b.evidence, b.m, every(b.m));
  EXPECT_EQ(b.found("effects.X.load_play.width_um"), once);
}

}  // namespace
}  // namespace vcnc::joint_fit_test
