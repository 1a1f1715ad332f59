#include "diagnosis/screening/detection_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/selection/selection.hpp"
#include "toy_machine.hpp"

namespace vcnc::detection_limits_test {
namespace {

TEST(DetectionLimit, IsWhereTheHeldOutHalfGainsEnough) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, Machine(), 2);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  const std::vector<Candidate> all = toy::candidates();
  DiagnosisOptions options;
  options.least_contour_um = options.least_of_noise = 0;  // whatever the consequence
  const SelectionResult result = select_effects_of(evidence, Machine(), all, options, {});
  // command_delay: e = -t v in the position with 50 nm of noise, and -t v at the probe with 100 nm.
  double sum = 0;
  const std::vector<double>& x = record.find(SignalKind::command, 0)->value;
  for (std::size_t k = 1; k + 1 < x.size(); ++k) {
    const double v = (x[k + 1] - x[k - 1]) / 2e-3, a = (x[k + 1] - 2 * x[k] + x[k - 1]) / 1e-6;
    if (std::abs(a) > 100) continue;
    sum += v * v * (1 / std::pow(toy::kPositionNoise, 2) + 1 / std::pow(toy::kProbeNoise, 2));
  }
  const double limit = 5 / std::sqrt(sum / 2) * 1e3;  // a gain of 25 on half of the laps
  EXPECT_NEAR(result.trials.front().detection_limit, limit, 0.05 * limit);

  // Of the part at the probe nothing counts below a gain of 100, of the position all does.
  double position = 0;
  for (std::size_t k = 1; k + 1 < x.size(); ++k) {
    const double v = (x[k + 1] - x[k - 1]) / 2e-3, a = (x[k + 1] - 2 * x[k] + x[k - 1]) / 1e-6;
    if (std::abs(a) < 100) position += v * v / std::pow(toy::kPositionNoise, 2);
  }
  options.form_of_channel = {0, 0, 200};
  const SelectionResult doubted = select_effects_of(evidence, Machine(), all, options, {});
  EXPECT_NEAR(doubted.trials.front().detection_limit, 5 / std::sqrt(position / 2) * 1e3,
              0.05 * limit);
}

TEST(DetectionLimit, ADeclaredNumberIsToldWhereItLeavesItsToleranceForCertain) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, Machine(), 2);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  const SelectionResult result = select_effects_of(evidence, Machine(), toy::candidates(), {}, {});
  // The force tells the mass far better than its tolerance of 1 %: it is told from where it is no
  // matter of tolerance, 4.5 of them.
  double mass = 0;
  for (std::size_t i = 0; i < result.release_limits.size(); ++i)
    if (result.base.nuisances.numbers[i].number.key == "axes.X.load_kg")
      mass = result.release_limits[i];
  EXPECT_NEAR(mass, 4.5 * 5, 0.1);
}

/// Play that does nothing up to a width, and beyond it what one of half the rest does.
class PlayFrom : public toy::ToyReplica {
 public:
  PlayFrom(const Record& commands, double first_um)
      : toy::ToyReplica(commands), first_(1e-6 * first_um) {}

  Prediction predict(const Machine& m) const override {
    Machine shown = m;
    double& width = shown.effects.axis[0].get<LoadPlay>().width;
    width = width > first_ ? 0.5 * (width + first_) : 0;
    return toy::ToyReplica::predict(shown);
  }

 private:
  double first_;
};

double limit_of(const SelectionResult& result, const char* effect) {
  const std::vector<Candidate> all = toy::candidates();
  for (const TrialColumns& t : result.trials)
    if (all[t.trial.candidate].effect == effect) return t.detection_limit;
  return 0;
}

TEST(DetectionLimit, OfAnEffectThatSmallSizesDoNotHaveIsWhereItBegins) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, Machine(), 2);
  const auto limits = [&](Replica& replica) {
    Evidence evidence(record, replica, Machine());
    DiagnosisOptions options;
    options.least_contour_um = 0.001, options.least_of_noise = 0;
    const SelectionResult r =
        select_effects_of(evidence, Machine(), toy::candidates(), options, {});
    return std::pair{limit_of(r, "load_play"), limit_of(r, "squareness")};
  };
  toy::ToyReplica linear(record);
  const auto [play, squareness] = limits(linear);
  for (const double first_um : {0.1, 0.7, 3.0}) {
    PlayFrom replica(record, first_um);
    const auto [later, as_before] = limits(replica);
    EXPECT_GE(later, first_um);
    EXPECT_LE(later, 2 * first_um);
    EXPECT_NEAR(as_before, squareness, 1e-9 * squareness);
  }
  EXPECT_LT(play, 0.05);  // where it is linear
}

/// Of the held-out chi-square of x, the part on the line, where y stands.
double part_on_the_line(const Record& record, std::size_t lap, int laps) {
  const std::vector<double>& x = record.find(SignalKind::command, 0)->value;
  double all = 0, line = 0, mean = 0;
  const std::size_t from = 2 * lap * static_cast<std::size_t>(laps);
  for (std::size_t k = 0; k < x.size(); ++k) mean += x[k] / static_cast<double>(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) all += std::pow(x[k] - mean, 2);
  for (std::size_t k = from; k < x.size(); ++k) line += std::pow(x[k] - mean, 2);
  return line / all;
}

TEST(DetectionLimit, BesideALargeEffectIsWhatShowsWhileThatRests) {
  Record record = toy::commands(1000, 4);
  const auto limits = [&](double squareness_urad) {
    toy::measure(record, toy::machine({{"effects.geometry.squareness.xy_urad", squareness_urad}}),
                 2);
    toy::ToyReplica replica(record);
    Evidence evidence(record, replica, Machine());
    DiagnosisOptions options;
    options.least_contour_um = options.least_of_noise = 0;
    options.share_of_found = 0.005;
    return select_effects_of(evidence, Machine(), toy::candidates(), options, {});
  };
  const SelectionResult clean = limits(0);
  EXPECT_FALSE(clean.beside_found);
  const SelectionResult found = limits(1000);
  ASSERT_EQ(found.found.added.size(), 1u);
  ASSERT_TRUE(found.beside_found);
  const std::vector<Candidate> all = toy::candidates();
  for (std::size_t t = 0; t < found.trials.size(); ++t) {
    const std::string& effect = all[found.trials[t].trial.candidate].effect;
    const double alone = found.trials[t].detection_limit, beside = found.beside_found->of_trials[t];
    // Half a percent of what 1 mrad explains is more than a scale gains on circles: what counts of
    // it is its gain on the line, along which squareness does nothing.
    double expected = 0;
    if (effect == "scale_error") expected = alone / std::sqrt(part_on_the_line(record, 1000, 4));
    if (effect == "squareness" || effect == "coulomb") expected = alone;  // nothing hides these
    if (expected > 0) {
      EXPECT_NEAR(beside, expected, 0.02 * expected) << effect;
    }
  }
}

}  // namespace
}  // namespace vcnc::detection_limits_test
