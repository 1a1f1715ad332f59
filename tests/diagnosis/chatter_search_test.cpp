#include "diagnosis/beforehand/chatter_search.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/healthy/differential.hpp"
#include "diagnosis/report/diagnosis_text.hpp"
#include "model/math.hpp"
#include "toy_machine.hpp"

namespace vcnc::chatter_search_test {
namespace {

constexpr double kHertz = 31.7;  // no whole number of periods in a lap of a second

/// Adds a vibration of X that goes on through all laps: position [m], force [N].
void vibrate(std::vector<double>& position, std::vector<double>& force, double hertz, double um) {
  for (std::size_t k = 0; k < position.size(); ++k) {
    const double wave = std::sin(2 * kPi * hertz * 1e-3 * static_cast<double>(k));
    position[k] += 1e-6 * um * wave;
    force[k] += 2 * um * wave;
  }
}

/// What play makes of position and force: here it vibrates, whatever its width.
void vibrate_by_play(std::vector<double>& position, std::vector<double>& force, double) {
  vibrate(position, force, 0.9 * kHertz, 12);
}

/// Here it rattles over all frequencies, the more the wider it is [m].
void rattle_by_play(std::vector<double>& position, std::vector<double>& force, double width) {
  for (std::size_t k = 0; k < position.size(); ++k) {
    position[k] += 0.05 * width * gaussian_noise(77, 0, k)[0];
    force[k] += 5e6 * width * gaussian_noise(77, 1, k)[0];
  }
}

/// The toy machine, whose X trembles in one of these ways as soon as it has play.
template <auto tremble>
class TremblingReplica : public toy::ToyReplica {
 public:
  using ToyReplica::ToyReplica;
  Prediction predict(const Machine& m) const override {
    const Prediction quiet = ToyReplica::predict(m);
    std::vector<std::vector<double>> all(quiet.begin(), quiet.end());
    const double width = m.effects.axis[0].get<LoadPlay>().width;
    if (width > 1e-6) tremble(all[0], all[1], width);
    return {all.begin(), all.end()};
  }
};
using VibratingReplica = TremblingReplica<vibrate_by_play>;
using RattlingReplica = TremblingReplica<rattle_by_play>;

std::vector<Candidate> drive_candidates() {
  std::vector<Candidate> all = toy::candidates();
  for (Candidate& c : all)
    if (c.place == "X") c.family = c.effect == "load_play" ? Family::mechanics : Family::friction;
  return all;
}

Record vibrating(double hertz, double um, std::uint64_t seed) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, {}, seed);
  std::vector<double>*position = nullptr, *force = nullptr;
  for (MeasuredSignal& s : record.signals) {
    if (s.kind == SignalKind::position) position = &s.value;
    if (s.kind == SignalKind::force) force = &s.value;
  }
  vibrate(*position, *force, hertz, um);
  return record;
}

Diagnosis diagnosed(const Record& record) {
  VibratingReplica replica(record);
  return diagnose({record, replica, {}, drive_candidates()});
}

TEST(ChatterSearch, NamesWhatMakesTheModelVibrateAsStrongly) {
  const Diagnosis d = diagnosed(vibrating(kHertz, 10, 1));
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "load_play");
  // All of the sizes that were tried and are more than a micrometre do so: 2 to 32 um, and what is
  // next to them.
  const FittedNumber& width = d.effects[0].numbers.at(0);
  EXPECT_NEAR(width.low, 1, 1e-9);
  EXPECT_NEAR(width.high, 64, 1e-9);
  EXPECT_NEAR(width.value, 8, 1e-9);
  EXPECT_EQ(number_of(d.found, width.key), width.value);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
}

TEST(ChatterSearch, OnlyHintsAtWhatVibratesOtherwise) {
  for (const auto& [hertz, um] : {std::pair{kHertz, 100.0}, std::pair{171.3, 10.0}}) {
    const Diagnosis d = diagnosed(vibrating(hertz, um, 2));
    EXPECT_TRUE(d.effects.empty());
    EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
    EXPECT_EQ(verdict_sentence(d), fmt::format("X vibrates by itself at {:.0f} Hz", hertz));
    ASSERT_EQ(d.notes.size(), 1U);
    EXPECT_EQ(d.notes[0].find("X vibrates by itself: position X"), 0U) << d.notes[0];
    EXPECT_EQ(d.notes[0].find("X.load_play") != std::string::npos, hertz == kHertz) << d.notes[0];
  }
}

TEST(ChatterSearch, TellsAVibrationOfTheDeclaredMachineAlone) {
  const Machine declared = toy::machine({{"effects.X.load_play.width_um", 8}});
  Record record = toy::commands(1000, 4);
  toy::measure(record, {}, 7);
  VibratingReplica replica(record);
  const Diagnosis d = diagnose({record, replica, declared, drive_candidates()});
  EXPECT_TRUE(d.effects.empty());
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  EXPECT_TRUE(std::any_of(d.notes.begin(), d.notes.end(), [](const std::string& n) {
    return n.starts_with("The declared machine lets X vibrate by itself (position X");
  }));
}

TEST(ChatterSearch, WhatVibratedBeforeIsNoNews) {
  const Record now = vibrating(kHertz, 10, 3), healthy = vibrating(kHertz, 10, 4);
  VibratingReplica replica(now), of_healthy(healthy);
  const Machine declared;
  const DifferentialRecord difference =
      less_healthy(now, healthy_run(healthy, of_healthy, declared));
  EXPECT_FALSE(difference.noise.lines.empty());
  const Diagnosis d = diagnose({now, replica, declared, drive_candidates()}, difference);
  EXPECT_TRUE(d.effects.empty());
  EXPECT_TRUE(std::none_of(d.notes.begin(), d.notes.end(), [](const std::string& n) {
    return n.find("by itself") != std::string::npos;
  }));
}

/// A record of a machine that trembles by play as this replica does, and shows nothing else of it.
template <class Trembling>
Record trembling(Record record, double width_um, std::uint64_t seed) {
  toy::measure(record, {}, seed);
  const Machine play = toy::machine({{"effects.X.load_play.width_um", width_um}});
  const Prediction trembles = Trembling(record).predict(play),
                   still = toy::ToyReplica(record).predict(play);
  for (MeasuredSignal& s : record.signals) {
    if (s.kind != SignalKind::position && s.kind != SignalKind::force) continue;
    const std::size_t c = s.kind == SignalKind::position ? 0 : 1;
    for (std::size_t k = 0; k < s.value.size(); ++k) s.value[k] += trembles[c][k] - still[c][k];
  }
  return record;
}

void expect_play(const Diagnosis& d, double width_um) {
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "load_play");
  EXPECT_LT(d.effects[0].numbers[0].low, width_um);
  EXPECT_GT(d.effects[0].numbers[0].high, width_um);
}

template <class Trembling>
Diagnosis diagnosed_against(const Record& now, const Record& healthy) {
  Trembling replica(now), of_healthy(healthy);
  return diagnose({now, replica, {}, drive_candidates()},
                  less_healthy(now, healthy_run(healthy, of_healthy, {})));
}

TEST(ChatterSearch, NamesWhatMakesLapsDifferAsMuchAsTheyDo) {
  const auto measured = [](double width_um, std::uint64_t seed) {
    return trembling<RattlingReplica>(toy::commands(1000, 4), width_um, seed);
  };
  const auto diagnosed = [healthy = measured(0, 6)](const Record& now) {
    return diagnosed_against<RattlingReplica>(now, healthy);
  };
  const Diagnosis d = diagnosed(measured(8, 7));
  expect_play(d, 8);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  EXPECT_TRUE(diagnosed(measured(0, 8)).effects.empty());
  // No size that is tried rattles as much as this: the drive is told to be restless, no more.
  const Diagnosis more = diagnosed(measured(800, 9));
  EXPECT_TRUE(more.effects.empty());
  ASSERT_FALSE(more.notes.empty());
  EXPECT_EQ(more.notes[0].find("X is restless"), 0U) << more.notes[0];
  EXPECT_EQ(more.verdict, DiagnosisVerdict::unexplained);
  EXPECT_EQ(verdict_sentence(more), "X is restless");
}

/// Laps of a second of motion and a second of rest.
Record with_rests() {
  Record record;
  record.source = "toy";
  std::vector<double> x;
  for (int lap = 0; lap < 6; ++lap) {
    const std::size_t begin = x.size();
    for (int k = 0; k < 2000; ++k)
      x.push_back(0.01 * (1 - std::cos(2 * kPi * std::min(k, 1000) / 1000.0)));
    record.stretches.push_back({begin, x.size(), 0, lap, ""});
  }
  record.signals.push_back({SignalKind::command, 0, "qx", x, 0});
  record.signals.push_back({SignalKind::command, 1, "qy", std::vector<double>(x.size()), 0});
  return record;
}

/// The toy machine, whose X trembles within its play while it stands.
class HuntingReplica : public toy::ToyReplica {
 public:
  explicit HuntingReplica(const Record& r)
      : ToyReplica(r), x_(r.find(SignalKind::command, 0)->value) {}
  Prediction predict(const Machine& m) const override {
    const Prediction quiet = ToyReplica::predict(m);
    std::vector<std::vector<double>> all(quiet.begin(), quiet.end());
    const double width = m.effects.axis[0].get<LoadPlay>().width;
    for (std::size_t k = 1; width > 1e-6 && k < x_.size(); ++k) {
      if (x_[k] != x_[k - 1]) continue;
      all[0][k] += 0.3 * width * gaussian_noise(78, 0, k)[0];
      all[1][k] += 2e7 * width * gaussian_noise(78, 1, k)[0];
    }
    return {all.begin(), all.end()};
  }

 private:
  const std::vector<double>& x_;
};

TEST(ChatterSearch, NamesWhatMakesAnAxisTrembleAtRest) {
  const auto measured = [](double width_um, std::uint64_t seed) {
    return trembling<HuntingReplica>(with_rests(), width_um, seed);
  };
  const auto diagnosed = [healthy = measured(0, 10)](const Record& now) {
    return diagnosed_against<HuntingReplica>(now, healthy);
  };
  const Diagnosis d = diagnosed(measured(8, 11));
  expect_play(d, 8);
  ASSERT_FALSE(d.notes.empty());
  EXPECT_NE(d.notes[0].find("trembles at rest"), std::string::npos) << d.notes[0];
  const Diagnosis clean = diagnosed(measured(0, 12));
  EXPECT_TRUE(clean.effects.empty());
  EXPECT_EQ(clean.verdict, DiagnosisVerdict::no_deviation);
}

/// A hum of the force of a healthy machine is not what its position does now.
TEST(ChatterSearch, AHumThatWasInTheForceHidesNoChatterOfThePosition) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, {}, 5);
  std::vector<double> nothing(record.samples());
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::position) vibrate(s.value, nothing, kHertz, 5);
  toy::ToyReplica replica(record);
  const Evidence evidence(record, replica, {});
  HealthyNoise healthy;
  healthy.lines.push_back({{SignalKind::force, 0}, 50, 400, 2.0});
  const auto found = [&] { return find_chatter(evidence, {}, {}, healthy); };
  ASSERT_EQ(found().size(), 1U);
  EXPECT_NEAR(found()[0].line.frequency, kHertz, 0.5);
  healthy.lines.push_back({{SignalKind::position, 0}, 30, 400, 4e-6});
  EXPECT_TRUE(found().empty());  // as before
}

TEST(ChatterSearch, AQuietMachineIsNotSimulated) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, {}, 5);
  VibratingReplica replica(record);
  const Evidence evidence(record, replica, {});
  EXPECT_TRUE(find_chatter(evidence, {}, drive_candidates(), {}).empty());
}

}  // namespace
}  // namespace vcnc::chatter_search_test
