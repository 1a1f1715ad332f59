#include "model/probe/signals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vcnc::signals_test {
namespace {

constexpr double kPeriod = 20e-6, kStep = 100e-6, kNm = 1e-9;

ProbeParams probe(int bits = 16) {
  ProbeParams p;
  p.adc_bits = bits;
  return p;
}

/// One channel with effects on its signals.
SignalChannel channel_with(const ProbeParams& p, const Effects& effects, int component,
                           std::uint64_t seed) {
  return SignalChannel(p, component, machine_chain<AnaloguePort>(effects, seed));
}

// Worst error over a slow sweep of 0.2 mm.
double sweep_error(SignalChannel channel, double from = 0) {
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double x = 1e-8 * i;
    const ChannelSample s = channel.sample(x);
    EXPECT_FALSE(s.slip || s.fault);
    if (x >= from) worst = std::max(worst, std::abs(s.deflection - x));
  }
  return worst;
}

TEST(Adc, CodesOfKnownVoltages) {
  const Adc twelve{12}, sixteen{16};
  EXPECT_EQ(twelve.code(0), 2048);
  EXPECT_EQ(sixteen.code(0), 32768);
  EXPECT_NEAR(twelve.lsb(), 0.806e-3, 1e-6);
  EXPECT_NEAR(sixteen.lsb(), 50.35e-6, 1e-8);
  EXPECT_NEAR(twelve.code(0.5) - twelve.code(-0.5), 3103, 1);  // 2.5 Vpp
  EXPECT_EQ(twelve.code(10), 4095);
  EXPECT_EQ(twelve.code(-10), 0);
  EXPECT_TRUE(twelve.clipped(4095) && twelve.clipped(0) && sixteen.clipped(65535));
  EXPECT_FALSE(sixteen.clipped(4095));
  for (double v = -0.6; v < 0.6; v += 0.0137)
    EXPECT_LE(std::abs(sixteen.signal(sixteen.code(v)) - v), 0.5 * sixteen.lsb() / 2.5 * 1.0001);
}

// Half a step on both signals moves the phase by at most sqrt(2)/2 step over the amplitude in
// steps.
TEST(SignalChannel, ResolutionOfTheConverters) {
  const double sixteen = sweep_error(SignalChannel(probe(16), 0));
  const double twelve = sweep_error(SignalChannel(probe(12), 0));
  EXPECT_LT(sixteen, 0.5 * std::sqrt(2) * kPeriod / (2 * kPi) / 24824 * 1.01);
  EXPECT_GT(sixteen, 0.05 * kNm);
  EXPECT_LT(twelve, 0.5 * std::sqrt(2) * kPeriod / (2 * kPi) / 1551 * 1.01);
  EXPECT_GT(twelve, 1 * kNm);
}

TEST(SignalChannel, ErrorsOfTheSignals) {
  Effects effects;
  effects.get<SignalOffset>().cosine = Vec3(0.01, 0, 0);
  effects.get<SignalGain>().gain = Vec3(0, 0.02, 0);
  effects.get<SignalPhase>().angle = Vec3(0, 0, 0.02);
  EXPECT_NEAR(sweep_error(channel_with(probe(), effects, 0, 1)), 32 * kNm, 1 * kNm);
  EXPECT_NEAR(sweep_error(channel_with(probe(), effects, 1, 1)), 32 * kNm, 1 * kNm);
  EXPECT_NEAR(sweep_error(channel_with(probe(), effects, 2, 1)), 64 * kNm, 1 * kNm);
}

TEST(SignalChannel, HeydemannRemovesThem) {
  Effects effects;
  effects.get<SignalOffset>().cosine = Vec3::Constant(0.03);
  effects.get<SignalOffset>().sine = Vec3::Constant(-0.04);
  effects.get<SignalGain>().gain = Vec3::Constant(-0.08);
  effects.get<SignalPhase>().angle = Vec3::Constant(4 * kDegree);
  ProbeParams p = probe();
  EXPECT_GT(sweep_error(channel_with(p, effects, 0, 1)), 200 * kNm);
  p.correction = ProbeParams::Correction::heydemann;
  EXPECT_LT(sweep_error(channel_with(p, effects, 0, 1), 25e-6), 0.5 * kNm);
}

TEST(SignalChannel, NoiseAveragesToItsPrediction) {
  Effects effects;
  effects.get<AdcNoise>().noise = 2e-3;  // at the converter; 1.25 V amplitude
  SignalChannel channel = channel_with(probe(), effects, 0, 5);
  double sum = 0, sum2 = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    const double e = channel.sample(3e-6).deflection - 3e-6;
    sum += e;
    sum2 += e * e;
  }
  const double expected = 2e-3 / 1.25 * kPeriod / (2 * kPi);
  EXPECT_NEAR(sum / kCount, 0, 5 * expected / std::sqrt(kCount));
  EXPECT_NEAR(std::sqrt(sum2 / kCount), expected, 0.03 * expected);
}

// The jitter acts on the deflection before the converters (DeflectionPort).
class JitteringChannel {
 public:
  explicit JitteringChannel(const Effects& effects)
      : sampling_(machine_chain<DeflectionPort>(effects, 5)),
        channel_(channel_with(probe(), effects, 0, 5)) {}

  ChannelSample sample(double true_deflection) {
    DeflectionPort::Signal<double> signal{Vec3(true_deflection, 0, 0)};
    sampling_.step(signal, {{static_cast<double>(count_) * kStep, kStep, count_}, 1324});
    ++count_;
    return channel_.sample(signal.deflection.x());
  }

 private:
  Chain<DeflectionPort> sampling_;
  SignalChannel channel_;
  std::int64_t count_ = 0;
};

TEST(SignalChannel, JitterCostsSpeedTimesTime) {
  Effects effects;
  effects.get<SampleJitter>().jitter = 2e-6;
  JitteringChannel channel(effects);
  double sum2 = 0;
  constexpr int kCount = 10000;
  const double v = 0.02;
  for (int i = 0; i < kCount; ++i) {
    const double x = v * kStep * i;
    const double e = channel.sample(x).deflection - x;
    sum2 += e * e;
  }
  EXPECT_NEAR(std::sqrt(sum2 / kCount), v * 2e-6, 0.03 * v * 2e-6);
  JitteringChannel at_rest(effects);
  for (int i = 0; i < 100; ++i) EXPECT_LT(std::abs(at_rest.sample(0).deflection), 0.1 * kNm);
}

TEST(SignalChannel, ChannelsHaveNoiseOfTheirOwnButOneClock) {
  Effects effects;
  effects.get<AdcNoise>().noise = 2e-3;
  SignalChannel x = channel_with(probe(), effects, 0, 5), y = channel_with(probe(), effects, 1, 5),
                again = channel_with(probe(), effects, 0, 5);
  int same = 0;
  for (int i = 0; i < 100; ++i) {
    const double a = x.sample(0).deflection;
    same += a == y.sample(0).deflection;
    EXPECT_EQ(a, again.sample(0).deflection);
  }
  EXPECT_LT(same, 3);
}

// Runs at constant speed after a gentle start; true and estimated way.
struct Way {
  double true_way, way;
  bool slip;
};
Way travel(double speed) {
  SignalChannel channel(probe(), 0);
  double x = 0, v = 0;
  ChannelSample s;
  for (int i = 0; i < 5000; ++i) {
    v = std::min(v + 5 * kStep, speed);
    x += v * kStep;
    s = channel.sample(x);
  }
  return {x, s.deflection, s.slip};
}

TEST(SignalChannel, CountsUpToTheLimitAndFlagsASlipBeyond) {
  const Way design = travel(0.05);  // p f / 4
  EXPECT_NEAR(design.way, design.true_way, 1 * kNm);
  EXPECT_FALSE(design.slip);
  const Way warned = travel(0.09);  // still right, but too near to the limit to believe
  EXPECT_NEAR(warned.way, warned.true_way, 1 * kNm);
  EXPECT_TRUE(warned.slip);
  const Way beyond = travel(0.12);  // beyond p f / 2 = 100 mm/s: counts backwards
  EXPECT_GT(std::abs(beyond.way - beyond.true_way), 1e-3);
  EXPECT_TRUE(beyond.slip);
  const double periods = (beyond.way - beyond.true_way) / kPeriod;
  EXPECT_NEAR(periods, std::round(periods), 1e-3);  // off by whole periods, not repaired
}

TEST(SignalChannel, AJumpOfAThirdOfAPeriodIsFlagged) {
  SignalChannel channel(probe(), 0);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(channel.sample(0).slip);
  EXPECT_TRUE(channel.sample(7e-6).slip);
  EXPECT_TRUE(channel.sample(7e-6).slip);  // and stays flagged
  channel.set_zero();
  EXPECT_FALSE(channel.sample(0).slip);
}

TEST(SignalChannel, ZeroCheckFindsAWholePeriod) {
  SignalChannel channel(probe(), 0);
  channel.sample(0);
  EXPECT_EQ(channel.check_zero(), 0);
  for (int i = 0; i <= 400; ++i) channel.sample(1e-7 * i);
  for (int i = 0; i < 3; ++i) channel.sample(40e-6);
  EXPECT_EQ(channel.check_zero(), 2);  // claimed free, but reads 40 um
  EXPECT_TRUE(channel.sample(40e-6).slip);
}

TEST(SignalChannel, BadAmplitudeIsAFault) {
  Effects effects;
  effects.get<SignalOffset>().cosine = Vec3::Constant(0.5);
  SignalChannel channel = channel_with(probe(), effects, 0, 1);
  bool fault = false, fine = false;
  for (int i = 0; i < 200; ++i) {
    const ChannelSample s = channel.sample(1e-7 * i);
    (s.fault ? fault : fine) = true;
  }
  EXPECT_TRUE(fault);
  EXPECT_TRUE(fine);
  EXPECT_TRUE(channel.sample(0).slip);
}

TEST(Unwrapper, FollowsALongWay) {
  Unwrapper unwrapper;
  double phi = 0;
  for (int i = 0; i < 100000; ++i) {
    phi = 300 * std::sin(1e-3 * i) + 0.4;
    unwrapper.step(std::remainder(phi, 2 * kPi));
  }
  EXPECT_NEAR(unwrapper.total(), phi, 1e-9);
  EXPECT_FALSE(unwrapper.slipped());
}

}  // namespace
}  // namespace vcnc::signals_test
