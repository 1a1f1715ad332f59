#include "diagnosis/search/chatter_search.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/report/diagnosis_text.hpp"
#include "diagnosis/search/differential.hpp"
#include "model/math.hpp"
#include "toy_machine.hpp"

namespace vcnc {
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

/// The toy machine, whose X vibrates as soon as it has play.
class VibratingReplica : public toy::ToyReplica {
 public:
  using ToyReplica::ToyReplica;
  Prediction predict(const Machine& m) const override {
    const Prediction quiet = ToyReplica::predict(m);
    std::vector<std::vector<double>> all(quiet.begin(), quiet.end());
    if (m.effects.axis[0].get<LoadPlay>().width > 1e-6) vibrate(all[0], all[1], 0.9 * kHertz, 12);
    return {all.begin(), all.end()};
  }
};

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
  // All of the three sizes that were tried do so: 2 to 32 um and what is next to them.
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

TEST(ChatterSearch, WhatVibratedBeforeIsNoNews) {
  const Record now = vibrating(kHertz, 10, 3), healthy = vibrating(kHertz, 10, 4);
  VibratingReplica replica(now), of_healthy(healthy);
  const Machine declared;
  const DifferentialRecord difference = less_healthy(now, healthy, of_healthy, declared);
  EXPECT_FALSE(difference.lines.empty());
  const Diagnosis d = diagnose({now, replica, declared, drive_candidates()}, difference);
  EXPECT_TRUE(d.effects.empty());
  EXPECT_TRUE(std::none_of(d.notes.begin(), d.notes.end(), [](const std::string& n) {
    return n.find("by itself") != std::string::npos;
  }));
}

TEST(ChatterSearch, AQuietMachineIsNotSimulated) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, {}, 5);
  VibratingReplica replica(record);
  const Evidence evidence(record, replica, {});
  EXPECT_TRUE(find_chatter(evidence, {}, drive_candidates(), {}).empty());
}

}  // namespace
}  // namespace vcnc
