#include "diagnosis/commission.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "healthy_run.hpp"
#include "model/probe/noise.hpp"
#include "tests/sanitized.hpp"

namespace vcnc::commission_test {
namespace {

/// `declared`: an effect of X that the file has, too.
template <class... Declared>
Commissioning commissioned_x(const Effects& effects, const Declared&... declared) {
  RunOfMachine run = reversals_in_the_air(effects);
  ((run.declared.effects.axis[kX].get<Declared>() = declared), ...);
  MachineReplica replica(run.record, run.declared, run.piece);
  std::vector<Candidate> all = candidates(run.declared);
  std::erase_if(all, [](const Candidate& c) { return c.place != "X"; });
  Commissioning c = commission({run.record, replica, run.declared, all});
  for (const FittedNumber& n : c.numbers)
    EXPECT_NEAR(number_of(c.machine, n.key), n.value, 1e-6 * std::abs(n.value))
        << n.key << ": what is told is in the file";
  return c;
}

/// The whole machine, declared without friction and with a position gain that is too high.
TEST(Commission, RecoversFrictionAndGainOfTheVirtualMachine) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  effects.axis[kX].get<Coulomb>().level = 180;
  effects.axis[kX].get<Viscous>().coefficient = 1500;
  effects.axis[kX].get<KvError>().deviation = -0.06;
  const Commissioning c = commissioned_x(effects);
  EXPECT_NEAR(number_of(c.machine, "effects.X.coulomb.level_N"), 180, 0.02 * 180);
  EXPECT_NEAR(number_of(c.machine, "effects.X.viscous.coefficient_Ns_per_m"), 1500, 0.02 * 1500);
  EXPECT_NEAR(number_of(c.machine, "effects.X.kv_error.deviation_percent"), -6, 0.1);
  ASSERT_FALSE(c.figures.empty());
  ASSERT_FALSE(c.machine.commissioned.empty());
  for (const CommissionedSignal& s : c.machine.commissioned) {
    EXPECT_GE(s.left, 0) << s.signal;
    EXPECT_TRUE(s.signal != "position X" || s.left < 1e-6) << s.left;
    EXPECT_FALSE(s.signal.ends_with(" C")) << s.signal << ", which stands";
  }
  for (const SignalFigure& f : c.figures)
    if (f.channel.kind == SignalKind::position && f.channel.axis == kX) {
      EXPECT_LT(f.after, 0.01 * f.before);
    }
}

/// Of an axis whose compliance is declared and of which both sides are measured: what of its
/// friction is before the compliance twists nothing.
TEST(Commission, TellsFrictionOfTheMotorFromThatOfTheLoad) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  Windup& windup = effects.axis[kX].get<Windup>();
  windup = Windup::nominal(false);
  effects.axis[kX].get<Coulomb>().level = 180;
  effects.axis[kX].get<MotorFriction>().level = 120;
  const Commissioning c = commissioned_x(effects, windup);
  EXPECT_NEAR(number_of(c.machine, "effects.X.coulomb.level_N"), 180, 0.05 * 180);
  EXPECT_NEAR(number_of(c.machine, "effects.X.motor_friction.level_N"), 120, 0.05 * 120);
}

/// A builder knows how hard his motor turns, and not on what bristles it rests.
TEST(Commission, FindsTheBristlesOfADeclaredMotorFriction) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  const Windup windup = Windup::nominal(false);
  effects.axis[kX].get<Windup>() = windup;
  effects.axis[kX].get<Coulomb>().level = 60;
  effects.axis[kX].get<MotorFriction>() = {.level = 180, .viscous = 0, .stiffness = 3e7};
  const Commissioning c = commissioned_x(effects, windup, MotorFriction{.level = 170});
  EXPECT_NEAR(number_of(c.machine, "effects.X.coulomb.level_N"), 60, 0.05 * 60);
  EXPECT_NEAR(number_of(c.machine, "effects.X.motor_friction.level_N"), 180, 0.02 * 180);
  EXPECT_NEAR(number_of(c.machine, "effects.X.motor_friction.stiffness_N_per_um"), 30, 3);
}

/// One after the other, each side keeps what the other one has got wrong: break-away of 22 N and
/// 172 N at the motor had been found.
TEST(Commission, FitsTheFrictionOfBothSidesAtTheSameTime) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  const Windup windup = Windup::nominal(false);
  effects.axis[kX].get<Windup>() = windup;
  effects.axis[kX].get<Coulomb>().level = 80;
  effects.axis[kX].get<Stribeck>() = {.excess = 30, .velocity = 0.004};
  effects.axis[kX].get<MotorFriction>() = {.level = 180, .viscous = 300, .stiffness = 3e7};
  const Commissioning c = commissioned_x(effects, windup, MotorFriction{.level = 170});
  EXPECT_NEAR(number_of(c.machine, "effects.X.coulomb.level_N"), 80, 0.08 * 80);
  EXPECT_NEAR(number_of(c.machine, "effects.X.stribeck.excess_N"), 30, 0.1 * 30);
  EXPECT_NEAR(number_of(c.machine, "effects.X.motor_friction.level_N"), 180, 0.04 * 180);
}

/// A screw has waves and a motor has ripple when they are healthy, and a hose pulls.
TEST(Commission, RecoversWhatHangsOnWhereAnAxisIs) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  effects.axis[kX].get<Coulomb>().level = 180;
  effects.axis[kX].get<TransmissionError>() = {.amplitude = 2e-6, .period = 0.01, .phase = 0.5};
  effects.axis[kX].get<CableChain>() = {.stiffness = 1500, .cubic = 0, .rest = 0.03};
  const Commissioning c = commissioned_x(effects);
  EXPECT_NEAR(number_of(c.machine, "effects.X.coulomb.level_N"), 180, 0.02 * 180);
  EXPECT_NEAR(number_of(c.machine, "effects.X.transmission_error.amplitude_um"), 2, 0.1);
  EXPECT_NEAR(number_of(c.machine, "effects.X.transmission_error.period_mm"), 10, 0.1);
  EXPECT_NEAR(number_of(c.machine, "effects.X.cable_chain.stiffness_N_per_mm"), 1.5, 0.08);
  EXPECT_NEAR(number_of(c.machine, "effects.X.cable_chain.rest_mm"), 30, 2);
}

TEST(Commission, TakesNoiseForNoWave) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  effects.axis[kX].get<Coulomb>().level = 180;
  RunOfMachine run = reversals_in_the_air(effects);
  for (std::size_t i = 0; i < run.record.signals.size(); ++i) {
    MeasuredSignal& s = run.record.signals[i];
    const double noise = s.kind == SignalKind::position ? 20e-9
                         : s.kind == SignalKind::force  ? 2
                                                        : 0;  // [m], [N]
    for (std::size_t k = 0; k < s.value.size(); ++k)
      s.value[k] += noise * gaussian_noise(5, i, k)[0];
  }
  MachineReplica replica(run.record, run.declared, run.piece);
  std::vector<Candidate> all = candidates(run.declared);
  std::erase_if(all, [](const Candidate& c) { return c.place != "X"; });
  const Commissioning c = commission({run.record, replica, run.declared, all});
  EXPECT_NEAR(number_of(c.machine, "effects.X.coulomb.level_N"), 180, 0.02 * 180);
  for (const FittedNumber& n : c.numbers)
    for (const char* wave : {"ripple", "cogging", "transmission_error", "encoder", "cable_chain"})
      EXPECT_EQ(n.key.find(wave), std::string::npos) << n.key;
}

/// As uncertain as a data sheet is no number that was fitted: a change of it would be none.
TEST(Commission, WhatWasFittedIsNoMoreUncertain) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  effects.axis[kX].get<Coulomb>().level = 180;
  RunOfMachine run = reversals_in_the_air(effects);
  run.declared.effects.axis[kX].get<Coulomb>().level = 150;
  run.declared.uncertainties = {{"effects.X.coulomb.level_N", 40, {}},
                                {"axes.Y.load_kg", 0, {}}};  // exact
  MachineReplica replica(run.record, run.declared, run.piece);
  std::vector<Candidate> all = candidates(run.declared);
  std::erase_if(all, [](const Candidate& c) { return c.place != "X"; });
  const Machine fitted = commission({run.record, replica, run.declared, all}).machine;
  EXPECT_NEAR(number_of(fitted, "effects.X.coulomb.level_N"), 180, 0.02 * 180);
  ASSERT_EQ(fitted.uncertainties.size(), 1U);
  EXPECT_EQ(fitted.uncertainties[0].key, "axes.Y.load_kg");
}

TEST(Commission, StopsInTheMidstOfAFit) {
  Effects effects;
  effects.axis[kX].get<Coulomb>().level = 180;
  const RunOfMachine run = reversals_in_the_air(effects);
  MachineReplica replica(run.record, run.declared, run.piece);
  int asked = 0;
  const Commissioning c = commission({run.record, replica, run.declared, candidates(run.declared)},
                                     {}, [&](const DiagnosisProgress&) { return ++asked < 5; });
  EXPECT_EQ(asked, 5);
  EXPECT_TRUE(c.numbers.empty());
}

/// Declared without friction, and without the filter of the measured velocity.
TEST(Commission, RecoversALagOfTheVirtualMachine) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  effects.axis[kX].get<Coulomb>().level = 180;
  effects.deviations.push_back({"axes.X.velocity_lag_us", 250});
  const Commissioning c = commissioned_x(effects);
  EXPECT_NEAR(number_of(c.machine, "effects.X.coulomb.level_N"), 180, 0.02 * 180);
  EXPECT_NEAR(number_of(c.machine, "axes.X.velocity_lag_us"), 250, 10);
  EXPECT_NEAR(number_of(c.machine, "axes.X.position_lag_us"), 0, 10);
  // Its controller knows nothing of that.
  EXPECT_EQ(c.machine.axes[kX].servo.velocity_lag, 0);
  EXPECT_TRUE(std::any_of(c.machine.effects.deviations.begin(), c.machine.effects.deviations.end(),
                          [](const Deviation& d) { return d.key == "axes.X.velocity_lag_us"; }));
}

/// Declared without friction, and as if its drive had what it is told at once: without the delay of
/// the command among them, three gains far off make up for it.
TEST(Commission, RecoversADelayOfTheCommandAndMovesNoGain) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  effects.axis[kX].get<Coulomb>().level = 180;
  effects.axis[kX].get<CommandDelay>().delay = 0.6e-3;
  const Commissioning c = commissioned_x(effects);
  EXPECT_NEAR(number_of(c.machine, "effects.X.command_delay.delay_ms"), 0.6, 0.01);
  for (const std::string gain : {"kv_error", "velocity_ff_error", "acceleration_ff_error",
                                 "velocity_gain_error", "integral_time_error"})
    EXPECT_EQ(number_of(c.machine, "effects.X." + gain + ".deviation_percent"), 0) << gain;
}

/// Declared with another damping of the probe, without friction of the ball and without squareness.
TEST(Commission, RecoversTheProbeAndTheGeometryOfTheVirtualMachine) {
  if (kSanitized) GTEST_SKIP() << "takes minutes under a sanitizer";
  Effects effects;
  effects.get<SurfaceFriction>().coefficient = 0.12;
  effects.get<Squareness>().xy = 40e-6;
  effects.deviations.push_back({"probe.damping_ratio", 0.5});
  const RunOfMachine run = circles_in_a_ring(effects);
  MachineReplica replica(run.record, run.declared, run.piece);
  std::vector<Candidate> all = candidates(run.declared);
  std::erase_if(all, [](const Candidate& c) { return c.place.size() == 1; });
  const Commissioning c = commission({run.record, replica, run.declared, all});
  EXPECT_NEAR(number_of(c.machine, "effects.probe.surface_friction.coefficient"), 0.12, 0.002);
  EXPECT_NEAR(number_of(c.machine, "effects.geometry.squareness.xy_urad"), 40, 1);
  EXPECT_NEAR(number_of(c.machine, "probe.damping_ratio"), 0.5, 0.02);
  EXPECT_EQ(number_of(c.machine, "effects.probe.sample_latency.latency_us"), 0);
}

}  // namespace
}  // namespace vcnc::commission_test
