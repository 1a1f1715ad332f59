#include "diagnosis/selection/simplest_form.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/selection/selection.hpp"
#include "toy_machine.hpp"

namespace vcnc::simplest_form_test {
namespace {

const std::string kOfX = "effects.X.straightness.";

/// A reading of a guide of X that is bowed and waved.
class GuideReplica : public Replica {
 public:
  explicit GuideReplica(const Record& commands)
      : x_(commands.find(SignalKind::command, 0)->value) {}

  const std::vector<ComparedChannel>& channels() const override { return channels_; }
  Prediction predict(const Machine& m) const override {
    const Straightness& s = m.effects.axis[kX].get<Straightness>();
    std::vector<double> y;
    for (const double x : x_)
      y.push_back(s.first_bow * x * x / 0.01 +
                  s.first_wave * std::sin(2 * kPi * x / s.wavelength + s.phase));
    return {y};
  }

 private:
  std::vector<double> x_;
  std::vector<ComparedChannel> channels_{{SignalKind::deflection, 1}};
};

Candidate straightness() {
  return {"straightness",
          "X",
          {{kOfX + "first_bow_um", 5, -1000, 1000},
           {kOfX + "first_wave_um", 2, -1000, 1000},
           {kOfX + "wavelength_mm", 10, 1, 1e5},
           {kOfX + "phase_deg", 0, -360, 360}},
          {2, 3},
          Family::geometry};
}

/// What is told of a guide with these numbers.
AddedEffect told(const std::vector<std::pair<std::string, double>>& truth, Machine* found) {
  Record record = toy::commands(1000, 4);
  GuideReplica replica(record);
  std::vector<double> reading = replica.predict(toy::machine(truth))[0];
  for (std::size_t k = 0; k < reading.size(); ++k)
    reading[k] += toy::kProbeNoise * gaussian_noise(31, 0, k)[0];
  record.signals.push_back({SignalKind::deflection, 1, "", reading, 0});
  Evidence evidence(record, replica, {});
  const SelectionResult result = select_effects_of(evidence, {}, {straightness()}, {}, {});
  FittedMachine machine = result.found;
  bring_to_simplest_form(evidence, {}, {}, result.floor, machine);
  *found = machine.machine;
  return machine.added.empty() ? AddedEffect{} : machine.added[0];
}

TEST(SimplestForm, ABowHasNoWave) {
  Machine found;
  const AddedEffect effect = told({{kOfX + "first_bow_um", 20}}, &found);
  ASSERT_EQ(effect.numbers.size(), 1U);
  EXPECT_EQ(effect.numbers[0].number.key, kOfX + "first_bow_um");
  EXPECT_NEAR(effect.numbers[0].value, 20, 0.2);
  const Straightness declared;
  EXPECT_EQ(found.effects.axis[kX].get<Straightness>().wavelength, declared.wavelength);
  EXPECT_EQ(found.effects.axis[kX].get<Straightness>().phase, declared.phase);
}

TEST(SimplestForm, AWaveKeepsPeriodAndPhaseAndIsPositive) {
  Machine found;
  const AddedEffect effect = told({{kOfX + "first_bow_um", 20},
                                   {kOfX + "first_wave_um", -2},
                                   {kOfX + "wavelength_mm", 11},
                                   {kOfX + "phase_deg", -60}},
                                  &found);
  ASSERT_EQ(effect.numbers.size(), 4U);
  EXPECT_NEAR(number_of(found, kOfX + "first_bow_um"), 20, 0.2);
  EXPECT_NEAR(number_of(found, kOfX + "first_wave_um"), 2, 0.02);
  EXPECT_NEAR(number_of(found, kOfX + "wavelength_mm"), 11, 0.02);
  EXPECT_NEAR(number_of(found, kOfX + "phase_deg"), 120, 2);
}

}  // namespace
}  // namespace vcnc::simplest_form_test
