#include "diagnosis/quadrature.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "model/math.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::quadrature_test {
namespace {

double normal(std::mt19937& random) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random()) / 4294967296.0;
  return sum;
}

/// An encoder that moves back and forth over 30 periods; signals written out by the formulas of a
/// textbook, not by those under test. `extra` adds a seventh harmonic.
Record encoder(const SignalCurve& truth, unsigned seed, double noise = 1e-3, double extra = 0) {
  std::mt19937 random(seed);
  Record record;
  MeasuredSignal u, w;
  u.kind = SignalKind::cosine;
  w.kind = SignalKind::sine;
  const double r = truth.amplitude;
  for (int k = 0; k < 20000; ++k) {
    const double phi = 60 * kPi * std::sin(2 * kPi * k / 20000.0);
    const auto wave = [&](double x) {
      return std::cos(x) + truth.second * std::cos(2 * x) + truth.third * std::cos(3 * x) +
             extra * std::cos(7 * x);
    };
    const double c = wave(phi), s = wave(phi - kPi / 2);
    u.value.push_back(r * (c + truth.cosine_offset) + noise * normal(random));
    w.value.push_back(
        r * ((1 + truth.gain) * (std::cos(truth.angle) * s - std::sin(truth.angle) * c) +
             truth.sine_offset) +
        noise * normal(random));
  }
  record.signals = {u, w};
  return record;
}

std::map<std::string, FittedNumber> numbers_of(const Diagnosis& d) {
  std::map<std::string, FittedNumber> all;
  for (const FoundEffect& e : d.effects)
    for (const FittedNumber& n : e.numbers) all[n.key] = n;
  return all;
}

TEST(Quadrature, ASoundEncoderIsNotAccused) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Diagnosis d = diagnose_quadrature(encoder({}, seed), Machine{});
    EXPECT_EQ(d.verdict, DiagnosisVerdict::no_deviation) << seed;
    EXPECT_TRUE(d.effects.empty()) << seed << " " << d.effects.front().name;
  }
}

TEST(Quadrature, ASignalThatIsSampledLateIsNoPhase) {
  for (const std::ptrdiff_t lag : {3, -50}) {
    Record record = encoder({}, 3);
    std::vector<double>& sine = record.signals[1].value;
    if (lag > 0)
      std::rotate(sine.begin(), sine.end() - lag, sine.end());
    else
      std::rotate(sine.begin(), sine.begin() - lag, sine.end());
    const Diagnosis d = diagnose_quadrature(record, Machine{});
    EXPECT_EQ(d.verdict, DiagnosisVerdict::not_identifiable);
    EXPECT_TRUE(d.effects.empty());
    ASSERT_EQ(d.warnings.size(), 1u);
    EXPECT_TRUE(d.warnings[0].starts_with(
        lag > 0 ? "channel x: the sine comes 3 samples (3 ms) after the cosine"
                : "channel x: the cosine comes 50 samples (50 ms) after the sine"))
        << d.warnings[0];
  }
  for (const SignalCurve& sound :
       {SignalCurve{.angle = 20 * kDegree}, {.second = 0.1, .third = -0.1}, {.gain = 0.3}})
    EXPECT_NE(diagnose_quadrature(encoder(sound, 4), Machine{}).verdict,
              DiagnosisVerdict::not_identifiable);
}

TEST(Quadrature, FindsEachEffectAloneWithItsNumbers) {
  const std::vector<std::pair<std::string, SignalCurve>> cases{
      {"signal_offset", {.cosine_offset = 0.03, .sine_offset = -0.02}},
      {"signal_gain", {.gain = 0.04}},
      {"signal_phase", {.angle = 2 * kDegree}},
      {"signal_harmonics", {.second = 0.01, .third = -0.015}}};
  for (const auto& [name, truth] : cases) {
    const Diagnosis d = diagnose_quadrature(encoder(truth, 5), Machine{});
    EXPECT_EQ(d.verdict, DiagnosisVerdict::explained) << name;
    ASSERT_EQ(d.effects.size(), 1u) << name;
    EXPECT_EQ(d.effects[0].name, name);
    EXPECT_EQ(d.effects[0].place, "probe");
  }
}

TEST(Quadrature, FindsAllTogetherAndItsIntervalsHoldTheTruth) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  const SignalCurve truth{.amplitude = 0.47,
                          .cosine_offset = 0.03,
                          .sine_offset = -0.02,
                          .gain = 0.05,
                          .angle = 1.5 * kDegree,
                          .second = 0.008,
                          .third = 0.012};
  const std::map<std::string, double> expected{
      {"effects.probe.signal_offset.cosine_percent.x", 3},
      {"effects.probe.signal_offset.sine_percent.x", -2},
      {"effects.probe.signal_gain.gain_percent.x", 5},
      {"effects.probe.signal_phase.angle_deg.x", 1.5},
      {"effects.probe.signal_harmonics.second_percent.x", 0.8},
      {"effects.probe.signal_harmonics.third_percent.x", 1.2}};
  int inside = 0, all = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Diagnosis d = diagnose_quadrature(encoder(truth, seed), Machine{});
    EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
    const auto found = numbers_of(d);
    ASSERT_EQ(found.size(), expected.size());
    for (const auto& [key, value] : expected) {
      const FittedNumber& n = found.at(key);
      EXPECT_NEAR(n.value, value, 0.02) << key;
      ++all;
      inside += n.low <= value && value <= n.high;
    }
  }
  // 95 % of 180 are 171; fewer than 160 or all of them would be no interval of 95 %.
  EXPECT_GE(inside, 160) << all;
  EXPECT_LE(inside, 179) << all;
}

TEST(Quadrature, WhatTheLibraryDoesNotKnowIsNotExplained) {
  const Diagnosis d = diagnose_quadrature(encoder({}, 3, 1e-3, 0.02), Machine{});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  const Diagnosis both = diagnose_quadrature(encoder({.gain = 0.05}, 3, 1e-3, 0.02), Machine{});
  EXPECT_EQ(both.verdict, DiagnosisVerdict::partly);
  EXPECT_LT(both.explained_share, 1);
}

TEST(Quadrature, AnEncoderThatDoesNotMoveCannotBeJudged) {
  std::mt19937 random(1);
  Record rest = encoder({}, 1), shaken = rest;
  for (std::size_t k = 0; k < rest.samples(); ++k) {
    const double phi = 0.3 * std::sin(0.01 * static_cast<double>(k));
    for (const std::size_t i : {0u, 1u}) {
      rest.signals[i].value[k] = 0.3 + 1e-3 * normal(random);
      shaken.signals[i].value[k] =
          0.5 * (i == 0 ? std::cos(phi) : std::sin(phi)) + 1e-3 * normal(random);
    }
  }
  EXPECT_EQ(diagnose_quadrature(rest, Machine{}).verdict, DiagnosisVerdict::not_identifiable);
  EXPECT_EQ(diagnose_quadrature(shaken, Machine{}).verdict, DiagnosisVerdict::not_identifiable);
  Record brief = encoder({}, 1);
  for (MeasuredSignal& s : brief.signals) s.value.resize(100);
  EXPECT_EQ(diagnose_quadrature(brief, Machine{}).verdict, DiagnosisVerdict::not_identifiable);
}

/// Half a wave of amplitude, and a few samples from elsewhere.
TEST(Quadrature, AnAmplitudeThatChangesAndOutliersHideNothing) {
  const SignalCurve truth{
      .cosine_offset = 0.03, .sine_offset = -0.02, .gain = 0.05, .angle = 2 * kDegree};
  Record record = encoder(truth, 6);
  for (MeasuredSignal& s : record.signals)
    for (std::size_t k = 0; k < s.value.size(); ++k)
      s.value[k] *= 1 + 0.05 * std::sin(4e-4 * static_cast<double>(k));
  for (const std::size_t k : {3000U, 3001U, 9000U, 15000U}) record.signals[0].value[k] = 4;
  const Diagnosis d = diagnose_quadrature(record, Machine{});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  const auto numbers = numbers_of(d);
  const auto off = [&](const char* key, double expected) {
    return std::abs(numbers.at(std::string("effects.probe.") + key + ".x").value - expected);
  };
  ASSERT_EQ(d.effects.size(), 3U);
  EXPECT_LT(off("signal_offset.cosine_percent", 3), 0.02);
  EXPECT_LT(off("signal_offset.sine_percent", -2), 0.02);
  EXPECT_LT(off("signal_gain.gain_percent", 5), 0.02);
  EXPECT_LT(off("signal_phase.angle_deg", 2), 0.02);
  ASSERT_EQ(d.warnings.size(), 1U);
  EXPECT_NE(d.warnings[0].find("4 samples lie far off"), std::string::npos) << d.warnings[0];
  EXPECT_NE(d.notes[0].find("amplitude changes by +-5"), std::string::npos) << d.notes[0];
}

TEST(Quadrature, SignalsThatCannotBeThoseOfAnEncoderAreToldWhy) {
  Record same = encoder({}, 1), counts = same;
  same.signals[1].value = same.signals[0].value;
  for (MeasuredSignal& s : counts.signals)
    for (double& v : s.value) v = std::round(2048 + 2000 * v);
  for (const auto& [record, why] :
       {std::pair(&same, "do not draw a circle"), {&counts, "not about zero; give their offset"}}) {
    const Diagnosis d = diagnose_quadrature(*record, Machine{});
    EXPECT_EQ(d.verdict, DiagnosisVerdict::not_identifiable) << why;
    ASSERT_EQ(d.warnings.size(), 1U) << why;
    EXPECT_NE(d.warnings[0].find(why), std::string::npos) << d.warnings[0];
  }
}

TEST(Quadrature, TheFoundMachineHasTheEffects) {
  const Diagnosis d = diagnose_quadrature(encoder({.gain = 0.05}, 2), Machine{});
  EXPECT_NEAR(d.found.effects.get<SignalGain>().gain.x(), 0.05, 5e-4);
  EXPECT_TRUE(d.declared.effects.get<SignalGain>().null());
  ASSERT_FALSE(d.figures.empty());
  EXPECT_LT(d.figures[0].after, 0.15 * d.figures[0].before);
}

}  // namespace
}  // namespace vcnc::quadrature_test
