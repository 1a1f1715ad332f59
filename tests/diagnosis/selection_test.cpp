#include "diagnosis/selection/selection.hpp"

#include <gtest/gtest.h>

#include "diagnosis/fit/settling.hpp"
#include "diagnosis/healthy/common_numbers.hpp"
#include "diagnosis/selection/machine_changes.hpp"
#include "toy_machine.hpp"

namespace vcnc::selection_test {
namespace {

std::string names(const SelectionResult& result, const std::vector<Candidate>& candidates) {
  std::string all;
  const auto add = [&](const std::string& name) {
    if (!all.empty()) all.push_back(' ');
    all += name;
  };
  for (const AddedEffect& a : result.found.added) add(candidates[a.candidate].name());
  for (const ReleasedNumber& r : result.found.released) add(r.key);
  return all;
}

SelectionResult search(const Record& record, const Machine& declared) {
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, declared);
  return select_effects_of(evidence, declared, toy::candidates(), {}, {});
}

/// What `truth` would have read, with white noise.
void read(Record& record, const Replica& replica, const Machine& truth, std::uint64_t seed) {
  std::vector<double> reading = replica.predict(truth)[0];
  for (std::size_t k = 0; k < reading.size(); ++k)
    reading[k] += toy::kProbeNoise * gaussian_noise(seed, 0, k)[0];
  record.signals.push_back({SignalKind::deflection, 0, "", reading, 0});
}

struct Injected {
  const char* key;
  double value;
  const char* found;
};

TEST(Selection, NamesEveryEffectOfTheToyMachine) {
  for (const Injected& i :
       {Injected{"effects.X.command_delay.delay_ms", 0.01, "X.command_delay"},
        Injected{"effects.X.coulomb.level_N", 5, "X.coulomb"},
        Injected{"effects.X.viscous.coefficient_Ns_per_m", 60, "X.viscous"},
        // Never quite absent, so a number that leaves its tolerance.
        Injected{"effects.X.scale_error.error_ppm", -8, "effects.X.scale_error.error_ppm"},
        Injected{"effects.X.load_play.width_um", 0.4, "X.load_play"},
        Injected{"effects.geometry.squareness.xy_urad", 6, "geometry.squareness"},
        Injected{"axes.X.load_kg", 545, "axes.X.load_kg"}}) {
    Record record = toy::commands(1000, 4);
    const Machine truth = toy::machine({{i.key, i.value}});
    toy::measure(record, truth, 7);
    const SelectionResult result = search(record, Machine());
    EXPECT_EQ(names(result, toy::candidates()), i.found) << i.key;
    EXPECT_NEAR(number_of(result.found.machine, i.key), i.value, 0.1 * std::abs(i.value)) << i.key;
  }
}

TEST(Selection, FindsPeriodAndPhaseOfAWave) {
  Record record = toy::commands(1000, 4);
  const Machine truth = toy::machine({{"effects.X.pitch_periodic.amplitude_um", 0.5},
                                      {"effects.X.pitch_periodic.period_mm", 7.3},
                                      {"effects.X.pitch_periodic.phase_deg", 130}});
  toy::measure(record, truth, 3);
  const SelectionResult result = search(record, Machine());
  ASSERT_EQ(names(result, toy::candidates()), "X.pitch_periodic");
  const Machine& found = result.found.machine;
  EXPECT_NEAR(number_of(found, "effects.X.pitch_periodic.amplitude_um"), 0.5, 0.02);
  EXPECT_NEAR(number_of(found, "effects.X.pitch_periodic.period_mm"), 7.3, 0.02);
  EXPECT_NEAR(number_of(found, "effects.X.pitch_periodic.phase_deg"), 130, 5);
}

/// As slots of a motor make, some 300 waves in the travel.
TEST(Selection, FindsAWaveThatIsShort) {
  Record record = toy::commands(4000, 4);
  const Machine truth = toy::machine({{"effects.X.pitch_periodic.amplitude_um", 0.2},
                                      {"effects.X.pitch_periodic.period_mm", 0.2341},
                                      {"effects.X.pitch_periodic.phase_deg", 130}});
  toy::measure(record, truth, 3);
  const SelectionResult result = search(record, Machine());
  ASSERT_EQ(names(result, toy::candidates()), "X.pitch_periodic");
  const Machine& found = result.found.machine;
  EXPECT_NEAR(number_of(found, "effects.X.pitch_periodic.amplitude_um"), 0.2, 0.01);
  EXPECT_NEAR(number_of(found, "effects.X.pitch_periodic.period_mm"), 0.2341, 1e-4);
}

TEST(Selection, FindsAWaveThatALargeEffectHid) {
  // An ellipse over the position of X has lines that are all stronger than that of the wave.
  Record record = toy::commands(1000, 4);
  const Machine truth = toy::machine({{"effects.X.command_delay.delay_ms", 1},
                                      {"effects.geometry.squareness.xy_urad", 300},
                                      {"effects.X.pitch_periodic.amplitude_um", 0.3},
                                      {"effects.X.pitch_periodic.period_mm", 7.3},
                                      {"effects.X.pitch_periodic.phase_deg", 130}});
  toy::measure(record, truth, 21);
  const SelectionResult result = search(record, Machine());
  ASSERT_EQ(names(result, toy::candidates()),
            "X.command_delay geometry.squareness X.pitch_periodic");
  EXPECT_NEAR(number_of(result.found.machine, "effects.X.pitch_periodic.period_mm"), 7.3, 0.02);
}

TEST(Selection, AccusesNoCleanMachine) {
  for (std::uint64_t seed = 100; seed < 112; ++seed) {
    Record record = toy::commands(500, 4);
    Machine truth;
    // Within tolerance, and clamped a little off.
    move_number(truth, "axes.X.load_kg", 500 * (1 + 0.01 * gaussian_noise(seed, 9, 0)[0]));
    move_number(truth, "effects.setup.piece_offset.shift_um.x", 3 * gaussian_noise(seed, 9, 1)[0]);
    toy::measure(record, truth, seed);
    EXPECT_EQ(names(search(record, Machine()), toy::candidates()), "") << seed;
  }
}

TEST(Selection, FindsThreeEffectsTogether) {
  Record record = toy::commands(1000, 4);
  const Machine truth = toy::machine({{"effects.X.command_delay.delay_ms", 0.02},
                                      {"effects.X.load_play.width_um", 1},
                                      {"effects.geometry.squareness.xy_urad", 20}});
  toy::measure(record, truth, 11);
  const SelectionResult result = search(record, Machine());
  EXPECT_EQ(result.found.added.size(), 3U) << names(result, toy::candidates());
}

TEST(Selection, OfEqualsTakesTheOneOfUsualSize) {
  Record record = toy::commands(1000, 4);
  const Machine truth = toy::machine({{"effects.X.load_play.width_um", 1}});
  toy::measure(record, truth, 12);
  toy::ToyReplica replica(record);
  const Machine declared;
  std::vector<Candidate> all = toy::candidates();
  Candidate odd = *std::find_if(all.begin(), all.end(),
                                [](const Candidate& c) { return c.effect == "load_play"; });
  odd.effect = "odd";
  odd.numbers[0].typical /= 1000;
  all.insert(all.begin(), odd);
  Evidence evidence(record, replica, declared);
  const SelectionResult result = select_effects_of(evidence, declared, all, {}, {});
  ASSERT_EQ(result.found.added.size(), 1U);
  EXPECT_EQ(all[result.found.added[0].candidate].effect, "load_play");
  EXPECT_EQ(result.found.added[0].class_with, std::vector<std::size_t>{0});
}

/// A guide whose deviations, of sizes that no guide has, are a scale and a squareness together.
class GuideLikeBoth : public toy::ToyReplica {
 public:
  explicit GuideLikeBoth(const Record& commands)
      : toy::ToyReplica(commands),
        x_(commands.find(SignalKind::command, 0)->value),
        y_(commands.find(SignalKind::command, 1)->value) {}

  Prediction predict(const Machine& m) const override {
    Prediction p = toy::ToyReplica::predict(m);
    const Straightness& s = m.effects.axis[0].get<Straightness>();
    std::vector<double> reading = p[2];
    for (std::size_t k = 0; k < reading.size(); ++k)
      reading[k] += 10 * (s.first_bow * x_[k] + s.second_bow * y_[k]);
    p[2] = reading;
    return p;
  }

 private:
  std::vector<double> x_, y_;
};

TEST(Selection, AnEffectAndADeclaredNumberAreToldForOneThatSaysMore) {
  Record record = toy::commands(1000, 4);
  toy::measure(record,
               toy::machine({{"effects.geometry.squareness.xy_urad", 60},
                             {"effects.X.scale_error.error_ppm", -40}}),
               17);
  GuideLikeBoth replica(record);
  Evidence evidence(record, replica, Machine());
  std::vector<Candidate> all = toy::candidates();
  all.push_back({"straightness",
                 "X",
                 {{"effects.X.straightness.first_bow_um", 0.01, -1000, 1000},
                  {"effects.X.straightness.second_bow_um", 0.01, -1000, 1000}},
                 {}});
  const SelectionResult result = select_effects_of(evidence, Machine(), all, {}, {});
  const std::string found = names(result, all);
  EXPECT_TRUE(found == "X.scale_error geometry.squareness" ||
              found == "geometry.squareness X.scale_error")
      << found;
  EXPECT_NEAR(number_of(result.found.machine, "effects.X.scale_error.error_ppm"), -40, 0.5);
  EXPECT_NEAR(number_of(result.found.machine, "effects.geometry.squareness.xy_urad"), 60, 0.5);
}

TEST(Selection, WhatIsFoundIsNotKnownWellEnoughForAnEffectBehindIt) {
  Record record = toy::commands(1000, 4);
  const double little = 6;  // 0.05 % of the chi-square
  const Machine truth = toy::machine(
      {{"effects.X.load_play.width_um", 20}, {"effects.geometry.squareness.xy_urad", little}});
  toy::measure(record, truth, 13);
  toy::ToyReplica replica(record);
  const Machine declared;
  Evidence evidence(record, replica, declared);
  const auto found = [&](double share) {
    DiagnosisOptions options;
    options.share_of_found = share;
    return select_effects_of(evidence, declared, toy::candidates(), options, {});
  };
  EXPECT_EQ(names(found(1e-6), toy::candidates()), "X.load_play geometry.squareness");
  EXPECT_EQ(names(found(0.1), toy::candidates()), "X.load_play");
}

TEST(Selection, BetweenClippedReadingsAnEffectIsSeenAsIfNothingClipped) {
  // A tilt that is declared makes the reading 9 um large, of which a third is clipped: play does
  // less than half a percent of that, but most of it where nothing is clipped.
  Record record = toy::commands(1000, 4);
  const std::pair<std::string, double> tilt{"effects.geometry.squareness.xy_urad", 300};
  const Machine declared = toy::machine({tilt});
  toy::measure(record,
               toy::machine({tilt,
                             {"effects.probe.range_clip.limit_mm", 0.006},
                             {"effects.X.load_play.width_um", 0.1}}),
               13);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, declared);
  std::vector<Candidate> candidates = toy::candidates();
  candidates.push_back(
      {"range_clip", "probe", {{"effects.probe.range_clip.limit_mm", 0.4, 0, 50, true}}, {}});
  DiagnosisOptions options;
  options.share_of_found = 0.005;
  const SelectionResult result = select_effects_of(evidence, declared, candidates, options, {});
  EXPECT_EQ(names(result, candidates), "probe.range_clip X.load_play");
  EXPECT_NEAR(number_of(result.found.machine, "effects.X.load_play.width_um"), 0.1, 0.02);
}

TEST(Selection, EndsAtTheMostEffectsThatAreAllowed) {
  Record record = toy::commands(1000, 4);
  const Machine truth = toy::machine(
      {{"effects.X.load_play.width_um", 2}, {"effects.geometry.squareness.xy_urad", 20}});
  toy::measure(record, truth, 15);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, {});
  DiagnosisOptions options;
  options.max_effects = 1;
  const SelectionResult result = select_effects_of(evidence, {}, toy::candidates(), options, {});
  EXPECT_EQ(names(result, toy::candidates()), "X.load_play");
}

/// A reading of waves of a lap, each as strong as the number of one effect says [um].
class WaveReplica : public Replica {
 public:
  struct Wave {
    const char* key;
    std::vector<double> harmonics;  ///< amplitudes of the third, fourth, ... wave per lap
  };

  WaveReplica(std::size_t samples, std::vector<Wave> waves)
      : samples_(samples), waves_(std::move(waves)), channels_{{SignalKind::deflection, 0}} {}

  const std::vector<ComparedChannel>& channels() const override { return channels_; }
  Prediction predict(const Machine& m) const override {
    std::vector<double> x(samples_);
    for (const Wave& w : waves_) {
      const double um = number_of(m, w.key);
      for (std::size_t h = 0; h < w.harmonics.size(); ++h)
        for (std::size_t k = 0; k < samples_; ++k)
          x[k] += 1e-6 * um * w.harmonics[h] *
                  std::sin(2 * kPi * static_cast<double>((3 + h) * k) / 1000);
    }
    return {x};
  }

  std::vector<Candidate> candidates() const {
    std::vector<Candidate> all;
    for (const Wave& w : waves_) all.push_back({w.key, "", {{w.key, 1, 0, 1000, true}}, {}});
    return all;
  }

 private:
  std::size_t samples_;
  std::vector<Wave> waves_;
  std::vector<ComparedChannel> channels_;
};

TEST(Selection, StandInsForEachOtherAllGo) {
  // The machine is a + b. "first" alone does more than either; beside it "second" fits better than
  // b. Then a does better than "first", and only then b better than "second".
  Record record = toy::commands(1000, 4);
  WaveReplica replica(record.samples(),
                      {{"effects.X.load_play.width_um", {1, 0, 0, 0}},      // a
                       {"effects.Y.load_play.width_um", {0, 1, 0, 0}},      // b
                       {"effects.Z.load_play.width_um", {1, 0.3, 0.1, 0}},  // first
                       {"effects.X.lost_motion.compliance_nm_per_N", {0, 1, -0.05, 0.02}}});
  const Machine truth =
      toy::machine({{"effects.X.load_play.width_um", 1}, {"effects.Y.load_play.width_um", 1}});
  read(record, replica, truth, 14);
  Evidence evidence(record, replica, {});
  DiagnosisOptions options;
  options.max_effects = 2;  // a third would make "second" needless, and so drop it
  const SelectionResult result = select_effects_of(evidence, {}, replica.candidates(), options, {});
  EXPECT_EQ(result.ladder.front().name, "effects.Z.load_play.width_um");
  ASSERT_EQ(result.found.added.size(), 2U);
  EXPECT_NEAR(number_of(result.found.machine, "effects.X.load_play.width_um"), 1, 0.02);
  EXPECT_NEAR(number_of(result.found.machine, "effects.Y.load_play.width_um"), 1, 0.02);
}

/// A drive with friction and play: without friction play rattles, which is a wave that no lap
/// repeats, with friction it is the fourth wave of a lap.
class RattlingReplica : public Replica {
 public:
  static constexpr const char* kFriction = "effects.X.coulomb.level_N";
  static constexpr const char* kPlay = "effects.X.backlash.gap_um";

  explicit RattlingReplica(std::size_t samples) : samples_(samples) {}

  const std::vector<ComparedChannel>& channels() const override { return channels_; }
  Prediction predict(const Machine& m) const override {
    const double friction = number_of(m, kFriction), play = number_of(m, kPlay);
    const double waves = friction > 0.1 ? 4 : 71.37;
    std::vector<double> x(samples_);
    for (std::size_t k = 0; k < samples_; ++k) {
      const double lap = 2 * kPi * static_cast<double>(k) / 1000;
      x[k] = 1e-6 * (friction * std::sin(3 * lap) + play * std::sin(waves * lap));
    }
    return {x};
  }
  static std::vector<Candidate> candidates() {
    std::vector<Candidate> all;
    for (const char* key : {kFriction, kPlay})
      all.push_back({key, "X", {{key, 1, 0, 1000, true}}, {}, Family::mechanics});
    return all;
  }

 private:
  std::size_t samples_;
  std::vector<ComparedChannel> channels_{{SignalKind::deflection, 0}};
};

TEST(Selection, LooksAgainAtADriveAtWhichSomethingWasFound) {
  Record record = toy::commands(1000, 4);
  RattlingReplica replica(record.samples());
  const Machine truth =
      toy::machine({{RattlingReplica::kFriction, 2}, {RattlingReplica::kPlay, 0.5}});
  read(record, replica, truth, 16);
  Evidence evidence(record, replica, {});
  const SelectionResult result =
      select_effects_of(evidence, {}, RattlingReplica::candidates(), {}, {});
  ASSERT_EQ(result.found.added.size(), 2U);
  EXPECT_NEAR(number_of(result.found.machine, RattlingReplica::kFriction), 2, 0.02);
  EXPECT_NEAR(number_of(result.found.machine, RattlingReplica::kPlay), 0.5, 0.02);
}

/// The readings of waves, and of a mass: that of the first two waves, and a little of a third.
class WavesAndMass : public WaveReplica {
 public:
  using WaveReplica::WaveReplica;
  static constexpr const char* kMass = "axes.X.load_kg";

  Prediction predict(const Machine& m) const override {
    const Prediction waves = WaveReplica::predict(m);
    std::vector<double> x = waves[0];
    const double um = 0.1 * (number_of(m, kMass) - number_of(Machine(), kMass));
    for (std::size_t k = 0; k < x.size(); ++k) {
      const double lap = 2 * kPi * static_cast<double>(k) / 1000;
      x[k] += 1e-6 * um * (std::sin(3 * lap) + std::sin(4 * lap) + 0.3 * std::sin(5 * lap));
    }
    return {x};
  }
};

TEST(Selection, ADeclaredNumberThatStoodForEffectsGetsItsToleranceBack) {
  Record record = toy::commands(1000, 4);
  WavesAndMass replica(record.samples(), {{"effects.X.load_play.width_um", {1, 0}},
                                          {"effects.Y.load_play.width_um", {0, 1}}});
  const Machine truth =
      toy::machine({{"effects.X.load_play.width_um", 50}, {"effects.Y.load_play.width_um", 40}});
  read(record, replica, truth, 17);
  Evidence evidence(record, replica, {});
  const SelectionResult result = select_effects_of(evidence, {}, replica.candidates(), {}, {});
  ASSERT_FALSE(result.ladder.empty());
  EXPECT_EQ(result.ladder.front().name, WavesAndMass::kMass);
  EXPECT_EQ(result.found.added.size(), 2U);
  EXPECT_TRUE(result.found.released.empty());
  EXPECT_NEAR(number_of(result.found.machine, "effects.X.load_play.width_um"), 50, 0.5);
}

TEST(Selection, ADeclaredNumberTakesThePlaceOfAnEffectThatStoodForIt) {
  // The mass is off, and there is Y. "first" is like the mass, and like a part of Y as well.
  const std::string first = "effects.X.load_play.width_um", part = "effects.Z.load_play.width_um",
                    y = "effects.Y.load_play.width_um";
  Record record = toy::commands(1000, 4);
  WavesAndMass replica(record.samples(), {{first.c_str(), {1, 1, 0.3, 0, 0}},
                                          {part.c_str(), {0, 0, 0, 1, 0}},
                                          {y.c_str(), {0, 0, 0, 1, 0.5}}});
  const Machine truth = toy::machine({{WavesAndMass::kMass, 800}, {y, 12}});
  read(record, replica, truth, 19);
  Evidence evidence(record, replica, {});
  const std::vector<Candidate> all{{"first", "", {{first, 1, 0, 1000}, {part, 1, 0, 1000}}, {}},
                                   {"y", "", {{y, 1, 0, 1000}}, {}}};
  const SelectionResult result = select_effects_of(evidence, {}, all, {}, {});
  ASSERT_FALSE(result.ladder.empty());
  EXPECT_EQ(result.ladder.front().name, "first");
  EXPECT_EQ(names(result, all), std::string("y ") + WavesAndMass::kMass);
  EXPECT_NEAR(number_of(result.found.machine, y), 12, 0.1);
  EXPECT_NEAR(number_of(result.found.machine, WavesAndMass::kMass), 800, 1);
}

/// Of each effect on X there is as much of the fourth wave besides as its position loop lags, in
/// 0.5 ms: a number that the healthy run has in common.
class TurningWaves : public WaveReplica {
 public:
  using WaveReplica::WaveReplica;

  Prediction predict(const Machine& m) const override {
    const double lag = m.axes[kX].servo.position_lag / 500e-6;
    const Prediction waves = WaveReplica::predict(m);
    std::vector<double> x = waves[0];
    double um = 0;
    for (const Candidate& c : candidates())
      if (c.effect.starts_with("effects.X.")) um += number_of(m, c.effect);
    for (std::size_t k = 0; k < x.size(); ++k)
      x[k] += 1e-6 * um * lag * std::sin(2 * kPi * 4 * static_cast<double>(k) / 1000);
    return {x};
  }
};

TEST(Selection, RivalsHaveTheCommonNumbersOfTheOneInPlace) {
  // The machine is "right", with all of the fourth wave by its lag, and a sixth wave. "wrong" has
  // most of the fourth wave itself, and a little of the fifth.
  const char *right = "effects.X.load_play.width_um", *wrong = "effects.X.backlash.gap_um",
             *sixth = "effects.Y.load_play.width_um";
  Record record = toy::commands(1000, 4);
  TurningWaves inner(record.samples(),
                     {{right, {1, 0, 0}}, {wrong, {1, 0.9, 0.1}}, {sixth, {0, 0, 0, 1}}});
  Machine truth = toy::machine({{right, 2}, {sixth, 1}});
  truth.axes[kX].servo.position_lag = 500e-6;
  read(record, inner, truth, 20);
  DiagnosisOptions options;
  options.max_effects = 2;
  options.common = common_numbers({});
  ReplicaOfChange replica(inner, {}, options.common);
  Evidence evidence(record, replica, {});
  const SelectionResult result = select_effects_of(evidence, {}, inner.candidates(), options, {});
  EXPECT_EQ(result.found.added.size(), 2U);
  EXPECT_NEAR(number_of(result.found.machine, right), 2, 0.02);
  EXPECT_NEAR(number_of(result.found.machine, sixth), 1, 0.01);
}

/// The readings of two replicas.
class TwoReadings : public Replica {
 public:
  TwoReadings(const Replica& x, const Replica& y)
      : x_(x), y_(y), channels_{{SignalKind::deflection, 0}, {SignalKind::deflection, 1}} {}

  const std::vector<ComparedChannel>& channels() const override { return channels_; }
  Prediction predict(const Machine& m) const override {
    return {x_.predict(m)[0], y_.predict(m)[0]};
  }

 private:
  const Replica &x_, &y_;
  std::vector<ComparedChannel> channels_;
};

TEST(Selection, WhatTheModelsFormMayBeDoesNotRank) {
  // All of x is "right". What is in y is of the model's form, and "wrong" takes it for its own:
  // with most of x it gains more.
  const char *right = "effects.X.load_play.width_um", *wrong = "effects.X.backlash.gap_um";
  Record record = toy::commands(1000, 4);
  const WaveReplica x(record.samples(), {{right, {1, 0}}, {wrong, {1, 0.3}}}),
      y(record.samples(), {{wrong, {1}}});
  TwoReadings replica(x, y);
  const Machine truth = toy::machine({{right, 1}});
  for (std::size_t c = 0; c < 2; ++c) {
    std::vector<double> reading = replica.predict(truth)[c];
    for (std::size_t k = 0; k < reading.size(); ++k)
      reading[k] += toy::kProbeNoise * gaussian_noise(21, c, k)[0] +
                    (c == 1 ? 1e-6 : 0) * std::sin(2 * kPi * 3 * static_cast<double>(k) / 1000);
    record.signals.push_back({SignalKind::deflection, c, "", reading, 0});
  }
  for (const bool known : {false, true}) {
    Evidence evidence(record, replica, {});
    DiagnosisOptions options;
    options.max_effects = 1;
    if (known) options.form_of_channel = {0, 100 * evidence.count(1, Role::held_out)};
    options.taken_of_form = 1;
    const SelectionResult result = select_effects_of(evidence, {}, x.candidates(), options, {});
    ASSERT_FALSE(result.ladder.empty());
    EXPECT_EQ(result.ladder.front().name, known ? right : wrong);
    EXPECT_EQ(result.found.added.size(), 1U);
    EXPECT_NEAR(number_of(result.found.machine, right), known ? 1 : 0, 0.02);
  }
}

/// The effect on X has as much of the fourth wave besides as the mass is off, in 10 kg. Without it
/// the mass does next to nothing.
class MassTurnsX : public WaveReplica {
 public:
  using WaveReplica::WaveReplica;
  static constexpr const char* kOnX = "effects.X.load_play.width_um";

  Prediction predict(const Machine& m) const override {
    const Prediction waves = WaveReplica::predict(m);
    const double off = number_of(m, WavesAndMass::kMass) - number_of({}, WavesAndMass::kMass),
                 um = number_of(m, kOnX) * off / 10;
    std::vector<double> x = waves[0];
    for (std::size_t k = 0; k < x.size(); ++k)
      x[k] += 1e-6 * um * std::sin(2 * kPi * 4 * static_cast<double>(k) / 1000) +
              1e-10 * off * std::sin(2 * kPi * 9 * static_cast<double>(k) / 1000);
    return {x};
  }
};

TEST(Selection, OfThoseThatDoAsWellTheOneIsTakenThatDoesBestWhenAllIsFitted) {
  // Alone, "imitation" explains more: what the mass does shows only where the effect is.
  const char* imitation = "effects.Y.load_play.width_um";
  Record record = toy::commands(1000, 4);
  MassTurnsX replica(record.samples(), {{MassTurnsX::kOnX, {1}}, {imitation, {1, 0.03}}});
  const Machine truth = toy::machine({{MassTurnsX::kOnX, 3}, {WavesAndMass::kMass, 500.6}});
  read(record, replica, truth, 22);
  Evidence evidence(record, replica, {});
  std::vector<Candidate> all = replica.candidates();
  for (Candidate& c : all) c.family = Family::mechanics, c.place = "X";
  const SelectionResult result = select_effects_of(evidence, {}, all, {}, {});
  EXPECT_EQ(names(result, all), std::string("X.") + MassTurnsX::kOnX);
  EXPECT_NEAR(number_of(result.found.machine, MassTurnsX::kOnX), 3, 0.02);
  EXPECT_NEAR(number_of(result.found.machine, WavesAndMass::kMass), 500.6, 0.1);
}

TEST(Selection, BesideAnotherOfItsDriveAnEffectMustExplainMoreOfWhatIsLeft) {
  // The machine is the first and the second wave, and one that nothing explains.
  Record record = toy::commands(1000, 4);
  WaveReplica replica(record.samples(), {{"effects.X.load_play.width_um", {1, 0}},
                                         {"effects.X.backlash.gap_um", {0, 1}}});
  const Machine truth =
      toy::machine({{"effects.X.load_play.width_um", 3}, {"effects.X.backlash.gap_um", 1}});
  read(record, replica, truth, 18);
  std::vector<double>& reading = record.signals.back().value;
  for (std::size_t k = 0; k < reading.size(); ++k)
    reading[k] += 2e-6 * std::sin(2 * kPi * 29 * static_cast<double>(k) / 1000);
  std::vector<Candidate> all = replica.candidates();
  const std::string x = "X", y = "Y";
  for (const std::string& place : {x, y})
    for (const Family first : {Family::mechanics, Family::geometry})
      for (const double share : {0.1, 0.5}) {
        for (Candidate& c : all) c.family = Family::mechanics, c.place = x;
        all[0].family = first;
        all[1].place = place;
        Evidence evidence(record, replica, {});
        DiagnosisOptions options;
        options.share_beside = share;
        const SelectionResult result = select_effects_of(evidence, {}, all, options, {});
        const bool beside = place == x && first == Family::mechanics;
        EXPECT_EQ(result.found.added.size(), beside && share == 0.5 ? 1U : 2U) << place;
      }
}

TEST(Selection, TwoOfOneDriveThatTakeEachOtherBackAreNotTold) {
  // What there is, the fourth wave, is what two differ by that make the third one.
  const char *first = "effects.X.load_play.width_um", *both = "effects.X.backlash.gap_um";
  Record record = toy::commands(1000, 4);
  WaveReplica replica(record.samples(), {{first, {1, 0}}, {both, {-1, 0.2}}});
  read(record, replica, {}, 23);
  std::vector<double>& reading = record.signals.back().value;
  for (std::size_t k = 0; k < reading.size(); ++k)
    reading[k] += 1e-6 * std::sin(2 * kPi * 4 * static_cast<double>(k) / 1000);
  std::vector<Candidate> all = replica.candidates();
  for (const char* place : {"X", "Y"}) {
    all[0].place = "X";
    all[1].place = place;
    Evidence evidence(record, replica, {});
    const SelectionResult result = select_effects_of(evidence, {}, all, {}, {});
    EXPECT_EQ(result.found.added.size() == 2, all[1].place == "Y");
  }
}

TEST(Selection, WhatSpoilsASignalDoesNotHoldUp) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, {}, 31);
  toy::ToyReplica replica(record);
  const Machine declared;
  Evidence evidence(record, replica, declared);
  const std::vector<Candidate> candidates = toy::candidates();
  const DiagnosisOptions options;
  std::vector<TrialColumns> trials;
  const FittedMachine base = fit_declared(evidence, declared);
  const ContestRules rules{
      evidence, candidates, options, trials,
      {},       0,          {},      [](const std::string&, double) { return true; }};
  const MachineChanges changes(evidence, declared, rules, base);
  const auto holds_up = [&](double delay_ms) {
    FittedMachine m = base;
    move_number(m.machine, "effects.X.command_delay.delay_ms", delay_ms);
    m.prediction = evidence.predict(m.machine);
    return changes.holds_up(m);
  };
  EXPECT_TRUE(holds_up(1e-4));   // a position off by 21 nm rms beside 50 nm of noise
  EXPECT_FALSE(holds_up(1e-2));  // by 2.1 um
}

/// What it measures lies somewhere.
class LyingWaves : public WaveReplica {
 public:
  using WaveReplica::WaveReplica;

  Prediction predict(const Machine& m) const override {
    const Prediction waves = WaveReplica::predict(m);
    std::vector<double> x = waves[0];
    for (double& value : x)
      value += m.effects.get<PieceOffset>().shift.x() + 0.3 * m.effects.get<Squareness>().xz;
    return {x};
  }
};

TEST(Selection, OfEqualsTakesTheOneThatNeedsFewerNumbers) {
  // Squareness has a number for an axis that stands: with it the piece lies elsewhere, as it may
  // anyway. The other one needs both of its numbers to do the same.
  const std::string xy = "effects.geometry.squareness.xy_urad",
                    xz = "effects.geometry.squareness.xz_urad",
                    one = "effects.X.straightness.first_bow_um",
                    two = "effects.X.straightness.second_bow_um",
                    shift = "effects.setup.piece_offset.shift_um.x";
  Record record = toy::commands(1000, 4);
  LyingWaves replica(record.samples(),
                     {{xy.c_str(), {1, 0}}, {one.c_str(), {0.7, 0.7}}, {two.c_str(), {0, 0.7}}});
  read(record, replica, toy::machine({{xy, 2}, {shift, 300}}), 24);
  const std::vector<Candidate> all{
      {"other", "", {{one, 1, -1000, 1000}, {two, 1, -1000, 1000}}, {}},
      {"squareness", "", {{xy, 1, -1000, 1000}, {xz, 1, -1000, 1000}}, {}}};
  Evidence evidence(record, replica, {});
  const SelectionResult result = select_effects_of(evidence, {}, all, {}, {});
  EXPECT_EQ(names(result, all), "squareness");
  EXPECT_NEAR(number_of(result.found.machine, xy), 2, 0.02);
}

/// Play that does nothing below 2 um, where nothing rubs.
class PlayBesideFriction : public WaveReplica {
 public:
  using WaveReplica::WaveReplica;
  static constexpr const char *kPlay = "effects.X.backlash.gap_um",
                              *kFriction = "effects.X.load_play.width_um";

  Prediction predict(const Machine& m) const override {
    const Prediction waves = WaveReplica::predict(m);
    const double play = number_of(m, kPlay);
    std::vector<double> x = waves[0];
    if (play > 2 || number_of(m, kFriction) > 0.1)
      for (std::size_t k = 0; k < x.size(); ++k) {
        const double lap = 2 * kPi * static_cast<double>(k) / 1000;
        x[k] += 1e-6 * play * (std::sin(3 * lap) + std::sin(4 * lap));
      }
    return {x};
  }
};

TEST(Selection, TwoOfOnePlaceThatAnotherDoesAsWellAsAreThatOne) {
  // Its sensitivity tells nothing of play, so two others of its place are found first, one of which
  // takes along what no model knows.
  const char* other = "effects.X.lost_motion.compliance_nm_per_N";
  Record record = toy::commands(1000, 4);
  PlayBesideFriction replica(record.samples(), {{PlayBesideFriction::kFriction, {1, 0, 0.05}},
                                                {other, {0, 1}},
                                                {PlayBesideFriction::kPlay, {}}});
  read(record, replica, toy::machine({{PlayBesideFriction::kPlay, 3}}), 25);
  std::vector<double>& reading = record.signals.back().value;
  for (std::size_t k = 0; k < reading.size(); ++k)
    reading[k] += 0.15e-6 * std::sin(2 * kPi * 5 * static_cast<double>(k) / 1000);
  std::vector<Candidate> all = replica.candidates();
  const std::string x = "X", y = "Y";
  for (const std::string& place : {x, y}) {
    for (Candidate& c : all) c.family = Family::mechanics, c.place = x;
    all[1].place = place;
    Evidence evidence(record, replica, {});
    DiagnosisOptions options;
    options.share_of_found = 0.005;
    const SelectionResult result = select_effects_of(evidence, {}, all, options, {});
    EXPECT_EQ(result.found.added.size(), place == x ? 1U : 2U) << names(result, all);
    if (place != x) continue;
    EXPECT_NEAR(number_of(result.found.machine, PlayBesideFriction::kPlay), 3, 0.02);
  }
}

TEST(Selection, ManyThatDoALittleEachAreNotTold) {
  const std::vector<const char*> keys{"effects.X.load_play.width_um",
                                      "effects.Y.load_play.width_um",
                                      "effects.Z.load_play.width_um",
                                      "effects.X.lost_motion.compliance_nm_per_N",
                                      "effects.Y.lost_motion.compliance_nm_per_N",
                                      "effects.Z.lost_motion.compliance_nm_per_N",
                                      "effects.X.backlash.gap_um"};
  Record record = toy::commands(1000, 4);
  std::vector<WaveReplica::Wave> waves;
  Machine truth;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    waves.push_back({keys[i], std::vector<double>(i + 1, 0.0)});
    waves.back().harmonics.back() = 1;  // a wave of its own
    move_number(truth, keys[i], 1);
  }
  WaveReplica replica(record.samples(), waves);
  read(record, replica, truth, 15);
  for (const std::size_t few : {1U, 8U}) {
    Evidence evidence(record, replica, {});
    DiagnosisOptions options;
    options.few_effects = few;
    const SelectionResult result =
        select_effects_of(evidence, {}, replica.candidates(), options, {});
    // A pair explains two of seven, the next two of five.
    EXPECT_EQ(result.found.added.size() <= 2, few == 1);
    EXPECT_EQ(result.found.added.size() == 7, few == 8);
  }
}

TEST(FitDeclared, LeavesNoMoreThanTheDeclarationWhateverIsWrong) {
  for (const double wrong : {1e-6, 1e-4, 1e-2}) {
    Record record = toy::commands(500, 4);
    toy::measure(record, Machine(), 14);
    const std::vector<double>& x = record.find(SignalKind::command, 0)->value;
    for (MeasuredSignal& s : record.signals)
      if (is_compared(s.kind))
        for (std::size_t k = 0; k < s.value.size(); ++k)
          s.value[k] += wrong * (s.kind == SignalKind::force ? 1e7 : 1) * std::sin(x[k] / 0.004);
    toy::ToyReplica replica(record);
    const Machine declared;
    Evidence evidence(record, replica, declared);
    const double before =
        evidence.chi2(evidence.residual(evidence.predict(declared)), Role::fitted);
    const FittedMachine fitted = fit_declared(evidence, declared);
    EXPECT_LE(evidence.chi2(fitted.residual, Role::fitted), before) << wrong;
    for (const FreedNumber& n : fitted.nuisances.numbers)
      EXPECT_LE(std::abs(n.pull()), kFarthestPull + 1e-9) << n.number.key;
  }
}

}  // namespace
}  // namespace vcnc::selection_test
