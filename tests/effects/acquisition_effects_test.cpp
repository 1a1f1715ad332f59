// Sampling, signals and messages of the probe module, through SignalChannel and the probe node.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/effects/probe_bench.hpp"

namespace vcnc::acquisition_effects_test {
namespace {

constexpr double kNm = 1e-9, kPeriod = 20e-6;

/// Readings of x on a wall whose depth is a function of time, from kApproach on.
template <class Depth>
std::vector<double> readings_of(const Machine& machine, int cycles, Depth&& depth,
                                std::uint64_t seed = 1) {
  const auto readings = wall_readings(
      machine, Vec3::UnitX(), cycles,
      [&](double t) {
        return ball_at({3e-3 - depth(t), 0, 0});
      },
      seed);
  std::vector<double> x;
  for (const ProbeSample& r : readings) x.push_back(r.deflection[0]);
  return x;
}

// ---------------------------------------------------------------------------- sampling

TEST(SampleLatency, ReadsTheDeflectionOfBefore) {
  const double w = 2 * kPi * 5, A = 0.2e-3;
  const auto depth = [&](double t) { return 0.5e-3 + A * std::sin(w * t); };
  for (const double latency : {300e-6, 1e-3, 1.25e-3, 5e-3}) {
    Machine machine;
    machine.effects.get<SampleLatency>() = {latency};
    const auto x = readings_of(machine, 500, depth);
    // Between samples: h^2/8 A w^2, 0.25 nm.
    const double linear = 1e-8 / 8 * A * w * w;
    for (std::size_t k = kApproach + 5; k < x.size(); ++k)
      ASSERT_NEAR(x[k], depth(1e-3 * static_cast<double>(k) - latency), kReadingError + linear);
  }
}

TEST(ClockDrift, FallsBackInProportionToTheTime) {
  Machine machine;
  machine.effects.get<ClockDrift>() = {1e-3};
  const double speed = 0.1e-3;
  const auto ramp = [&](double t) { return 0.1e-3 + speed * t; };
  const auto x = readings_of(machine, 2000, ramp);
  for (std::size_t k = kApproach + 1; k < x.size(); ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    ASSERT_NEAR(x[k], ramp(t - 1e-3 * t), kReadingError);
  }
  // The lag ends at 25 ms.
  machine.effects.get<ClockDrift>() = {0.05};
  const auto late = readings_of(machine, 1000, ramp);
  EXPECT_NEAR(late[400], ramp(0.4 - 0.02), kReadingError);
  EXPECT_NEAR(late[1000], ramp(1.0 - 0.025), kReadingError);
}

// rms = speed times jitter; nothing at rest.
TEST(SampleJitter, CostsSpeedTimesTime) {
  Machine machine;
  machine.effects.get<SampleJitter>() = {20e-6};
  constexpr int kCycles = 6000;
  const double speed = 0.2e-3;
  const auto ramp = [&](double t) { return 0.1e-3 + speed * t; };
  const auto x = readings_of(machine, kApproach + kCycles, ramp);
  double sum = 0, sum2 = 0;
  for (std::size_t k = kApproach + 1; k < x.size(); ++k) {
    const double e = x[k] - ramp(1e-3 * static_cast<double>(k));
    sum += e;
    sum2 += e * e;
  }
  const double rms = speed * 20e-6;  // 4 nm, against 0.05 nm of the converter
  EXPECT_NEAR(std::sqrt(sum2 / kCycles), rms, 4 / std::sqrt(2.0 * kCycles) * rms);  // 4 sigma
  EXPECT_NEAR(sum / kCycles, 0, 4 * rms / std::sqrt(kCycles));
  const auto rest = readings_of(machine, 200, [](double) { return 0.5e-3; });
  for (std::size_t k = kApproach + 1; k < rest.size(); ++k)
    EXPECT_NEAR(rest[k], 0.5e-3, kReadingError);
}

// A share P of the cycles repeats the value before, exactly; the others are exact.
TEST(DroppedSamples, RepeatTheLastValue) {
  constexpr int kCycles = 10000;
  const double share = 0.05, speed = 0.1e-3;
  Machine machine;
  machine.effects.get<DroppedSamples>() = {share};
  const auto ramp = [&](double t) { return 0.1e-3 + speed * t; };
  const auto x = readings_of(machine, kApproach + kCycles, ramp);
  int dropped = 0, twice = 0;
  bool before = false;
  for (std::size_t k = kApproach + 1; k < x.size(); ++k) {
    const bool repeated = x[k] == x[k - 1];
    dropped += repeated;
    twice += repeated && before;
    before = repeated;
    if (!repeated) {
      ASSERT_NEAR(x[k], ramp(1e-3 * static_cast<double>(k)), kReadingError);
    }
  }
  // Binomial: 4 sigma.
  EXPECT_NEAR(dropped, share * kCycles, 4 * std::sqrt(share * (1 - share) * kCycles));
  EXPECT_NEAR(twice, share * share * kCycles, 4 * share * std::sqrt(1.0 * kCycles));
  EXPECT_GT(twice, 0);  // bursts of two
  EXPECT_NE(readings_of(machine, 200, ramp, 2), std::vector<double>(x.begin(), x.begin() + 201));
}

TEST(DroppedSamples, AllDroppedHoldsTheFirst) {
  Machine machine;
  machine.effects.get<DroppedSamples>() = {1};
  for (const double x : readings_of(machine, 200, [](double t) { return 0.3e-3 + 1e-3 * t; }))
    EXPECT_NEAR(x, 0, kReadingError);  // of the free probe
}

TEST(PeriodSlip, StepsByWholePeriodsOnce) {
  Machine machine;
  machine.effects.get<PeriodSlip>() = {.periods = -3, .channel = 0, .start = 0.2};
  const auto depth = [](double t) { return 0.5e-3 + 1e-4 * std::sin(20 * t); };
  const auto x = readings_of(machine, 300, depth);
  for (std::size_t k = kApproach; k < x.size(); ++k) {
    const double expected = depth(1e-3 * static_cast<double>(k)) - (k >= 200 ? 3 * kPeriod : 0);
    ASSERT_NEAR(x[k], expected, kReadingError) << k;
  }
  machine.effects.get<PeriodSlip>().channel = 2;
  const auto y = readings_of(machine, 300, depth);
  EXPECT_NEAR(y[250], depth(0.25), kReadingError);
}

// ---------------------------------------------------------------------------- signals

/// Errors of the reading over one signal period of channel 1, slowly swept.
template <class Error>
void expect_error_over_a_period(const Effects& effects, Error&& error) {
  SignalChannel channel({}, 1, machine_chain<AnaloguePort>(effects, 1));
  for (int i = 0; i < 2000; ++i) {
    const double x = i * 1e-8, phi = 2 * kPi * x / kPeriod;
    const ChannelSample sample = channel.sample(x);
    ASSERT_FALSE(sample.slip || sample.fault);
    // The converters alone: 0.5 sqrt(2) steps of 1/24824 rad, 0.09 nm.
    ASSERT_NEAR(sample.deflection - x, kPeriod / (2 * kPi) * error(phi), 0.1 * kNm) << phi;
  }
}

/// Phase of a distorted pair against phi, exactly.
double phase_error(double u, double w, double phi) {
  return std::atan2(w * std::cos(phi) - u * std::sin(phi), u * std::cos(phi) + w * std::sin(phi));
}

TEST(SignalHarmonics, ThirdHarmonicMakesFourPeriods) {
  Effects effects;
  effects.get<SignalHarmonics>().third = Vec3(0, 0.01, 0);
  expect_error_over_a_period(effects, [](double phi) {
    const double u = std::cos(phi) + 0.01 * std::cos(3 * phi);
    const double w = std::sin(phi) - 0.01 * std::sin(3 * phi);
    const double exact = phase_error(u, w, phi);
    EXPECT_NEAR(exact, -0.01 * std::sin(4 * phi), 0.6e-4);  // as its text says, to h3^2/2
    return exact;
  });
}

TEST(SignalHarmonics, SecondHarmonicMakesOneAndThreePeriods) {
  Effects effects;
  effects.get<SignalHarmonics>().second = Vec3(0, 0.01, 0);
  double worst = 0;
  expect_error_over_a_period(effects, [&](double phi) {
    const double u = std::cos(phi) + 0.01 * std::cos(2 * phi);
    const double w = std::sin(phi) - 0.01 * std::cos(2 * phi);
    const double exact = phase_error(u, w, phi);
    EXPECT_NEAR(exact, -0.01 * (std::cos(phi) + std::sin(phi)) * std::cos(2 * phi), 1.2e-4);
    worst = std::max(worst, std::abs(exact));
    return exact;
  });
  EXPECT_NEAR(worst, 1.0887 * 0.01, 1e-4);  // sqrt(2) 4/(3 sqrt 3)
}

TEST(SignalPhase, MakesHalfConstantAndTwoPeriods) {
  Effects effects;
  effects.get<SignalPhase>().angle = Vec3(0, 0.02, 0);
  // The first sample is the reading's zero in phase, not in count: nothing to take off.
  expect_error_over_a_period(effects, [](double phi) {
    const double exact = phase_error(std::cos(phi), std::sin(phi - 0.02), phi);
    EXPECT_NEAR(exact, -0.02 * std::pow(std::cos(phi), 2), 2.7e-4);  // 0.65 alpha^2
    return exact;
  });
}

TEST(SignalGain, MakesTwoPeriods) {
  Effects effects;
  effects.get<SignalGain>().gain = Vec3(0, 0.02, 0);
  expect_error_over_a_period(effects, [](double phi) {
    const double exact = phase_error(std::cos(phi), 1.02 * std::sin(phi), phi);
    EXPECT_NEAR(exact, 0.01 * std::sin(2 * phi), 1.4e-4);  // g^2/3
    return exact;
  });
}

TEST(SignalOffset, MakesOnePeriod) {
  Effects effects;
  effects.get<SignalOffset>().cosine = Vec3(0, 0.01, 0);
  effects.get<SignalOffset>().sine = Vec3(0, -0.02, 0);
  expect_error_over_a_period(effects, [](double phi) {
    const double exact = phase_error(std::cos(phi) + 0.01, std::sin(phi) - 0.02, phi);
    EXPECT_NEAR(exact, -0.02 * std::cos(phi) - 0.01 * std::sin(phi), 2.6e-4);  // p^2 + q^2 over 2
    return exact;
  });
}

// rms = period/2pi s/R at rest, s the noise at the converter over the gain of the front end.
TEST(AdcNoise, ScattersByItsPrediction) {
  Effects effects;
  effects.get<AdcNoise>() = {2e-3};
  constexpr int kCount = 20000;
  const double expected = kPeriod / (2 * kPi) * (2e-3 / 2.5) / 0.5;
  for (const double x : {0.0, 3e-6, 7e-6}) {
    SignalChannel channel({}, 0, machine_chain<AnaloguePort>(effects, 5));
    double sum = 0, sum2 = 0;
    for (int i = 0; i < kCount; ++i) {
      const double e = channel.sample(x).deflection - x;
      sum += e;
      sum2 += e * e;
    }
    EXPECT_NEAR(sum / kCount, 0, 4 * expected / std::sqrt(kCount));
    EXPECT_NEAR(std::sqrt(sum2 / kCount), expected, 4 / std::sqrt(2.0 * kCount) * expected);
  }
}

// A line at f of period/2pi a/R (cos phi - sin phi): largest at phi = -45 deg, none at 45 deg.
TEST(MainsHum, DependsOnThePhaseOfTheSignals) {
  Effects effects;
  const double a = 5e-3, f = 50;
  effects.get<MainsHum>() = {a, f};
  for (const double share : {0.0, 0.125, 0.25, 0.375}) {
    SignalChannel channel({}, 2, machine_chain<AnaloguePort>(effects, 1));
    const double phi = 2 * kPi * share;
    double c = 0, s = 0;
    constexpr int kCount = 2000;  // ten periods of the mains
    for (int i = 0; i < kCount; ++i) {
      const double e = channel.sample(share * kPeriod).deflection - share * kPeriod;
      c += 2 * e * std::cos(2 * kPi * f * 1e-4 * i) / kCount;
      s += 2 * e * std::sin(2 * kPi * f * 1e-4 * i) / kCount;
    }
    const double expected = kPeriod / (2 * kPi) * a / 0.5 * (std::cos(phi) - std::sin(phi));
    EXPECT_NEAR(c, 0, 0.02 * kNm);
    EXPECT_NEAR(s, expected, 0.02 * kNm) << "at " << share;  // up to 45 nm
  }
}

// Hum and vibration look alike at one depth; a quarter of a period deeper the hum has changed sign.
TEST(MainsHum, IsToldFromVibrationByAShiftOfTheDeflection) {
  const auto line = [](const Machine& machine, double depth) {
    const auto x = readings_of(machine, 500, [&](double) { return depth; });
    double s = 0;
    for (std::size_t k = 100; k < 500; ++k)
      s += 2 * x[k] * std::sin(2 * kPi * 50 * 1e-3 * static_cast<double>(k)) / 400;
    return s;
  };
  Machine hum, vibration;
  hum.effects.get<MainsHum>() = {5e-3, 50};
  const double size = kPeriod / (2 * kPi) * 0.01;
  vibration.effects.get<FrameVibration>() = {.amplitude = Vec3(-size, 0, 0)};
  EXPECT_NEAR(line(hum, 0.5e-3), size, 0.1 * kNm);
  EXPECT_NEAR(line(vibration, 0.5e-3), size, 0.1 * kNm);
  EXPECT_NEAR(line(hum, 0.505e-3), -size, 0.1 * kNm);
  EXPECT_NEAR(line(vibration, 0.505e-3), size, 0.1 * kNm);
}

}  // namespace
}  // namespace vcnc::acquisition_effects_test
