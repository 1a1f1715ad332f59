#include "model/drive/axis_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <vector>

namespace vcnc::axis_drive_test {
namespace {

constexpr double kCycle = 1e-3, kUm = 1e-6;
using Feedback = ServoParams::Feedback;

AxisParams axis(double kv = 40, double velocity_ff = 0, double acceleration_ff = 0) {
  AxisParams p;
  p.servo.kv_per_s = kv;
  p.servo.velocity_ff = velocity_ff;
  p.servo.acceleration_ff = acceleration_ff;
  p.servo.feedback = Feedback::motor;
  return p;
}

AxisEffects friction() {
  AxisEffects effects;
  effects.get<Coulomb>().level = 250;
  effects.get<Stribeck>().excess = 100;  // breaks away at 350 N
  effects.get<Viscous>().coefficient = 1000;
  return effects;
}

TEST(AxisDrive, RampFollowingError) {
  for (const double kvff : {0.0, 0.5, 0.9}) {
    AxisDrive drive(axis(40, kvff), {});
    const double v = 0.05;
    AxisCycle cycle;
    for (int k = 1; k <= 1500; ++k) cycle = drive.follow({v * kCycle * k, v});
    EXPECT_NEAR(v * kCycle * 1500 - cycle.measured, v * (1 - kvff) / 40, 1e-3 * kUm);
    EXPECT_NEAR(cycle.velocity, v, 1e-9);
  }
}

// Largest error at the cycle ends while following x(t) = amplitude * (1 - cos(2 pi f t)).
double sine_error(AxisDrive& drive, double amplitude, double frequency) {
  const double w = 2 * kPi * frequency;
  double worst = 0;
  for (int k = 1; k <= 3000; ++k) {
    const double t = kCycle * k;
    const double x = amplitude * (1 - std::cos(w * t));
    const AxisCycle cycle = drive.follow({x, amplitude * w * std::sin(w * t)});
    if (k > 500) worst = std::max(worst, std::abs(cycle.truth.back() - x));
  }
  return worst;
}

TEST(AxisDrive, FullFeedForwardFollowsExactly) {
  AxisParams params = axis(40, 1, 1);
  AxisDrive linear(params, {});
  EXPECT_LT(sine_error(linear, 2e-3, 5), 0.1 * kUm);
  params.servo.feedback = Feedback::load;
  AxisDrive by_load(params, {});
  EXPECT_LT(sine_error(by_load, 0.5e-3, 4), 0.01 * kUm);
  AxisDrive rotary(Machine().axes[kC], {});
  EXPECT_LT(sine_error(rotary, 0.05, 3), 1e-7);
}

TEST(AxisDrive, SPieceLikeMotionFollowsWithin0_1um) {
  AxisDrive drive(axis(40, 1, 1), {});
  // Acceleration as a triangle wave of 0.3 m/s^2 with a jerk of 10 m/s^3.
  double a = 0, v = 0, x = 0, jerk = 10, worst = 0;
  for (int k = 1; k <= 4000; ++k) {
    if (std::abs(a + jerk * kCycle) > 0.3) jerk = -jerk;
    x += kCycle * (v + kCycle * (a / 2 + kCycle * jerk / 6));
    v += kCycle * (a + kCycle * jerk / 2);
    a += kCycle * jerk;
    worst = std::max(worst, std::abs(drive.follow({x, v}).truth.back() - x));
  }
  EXPECT_LT(worst, 0.1 * kUm);
}

struct Circle {
  double mean_error = 0, peak_to_peak = 0, angle_of_max = 0;
};

// Two drives on a circle, after one turn to settle; radius errors of the true positions.
Circle circle(const AxisParams& px, const AxisParams& py, double radius, double feed_mm_min,
              bool clockwise = false) {
  AxisParams start = px;
  start.limits.start = radius;
  AxisDrive x(start, {}), y(py, {});
  const double w = feed_mm_min / 60e3 / radius, turn = 2 * kPi / w;
  const double sign = clockwise ? -1 : 1;
  const int turn_cycles = static_cast<int>(std::lround(turn / kCycle));
  double sum = 0, low = 1, high = -1;
  Circle result;
  for (int k = 1; k <= 2 * turn_cycles; ++k) {
    const double phi = w * kCycle * k;
    const double cx = x.follow({radius * std::cos(phi), -radius * w * std::sin(phi)}).truth.back();
    const double cy =
        y.follow({sign * radius * std::sin(phi), sign * radius * w * std::cos(phi)}).truth.back();
    if (k <= turn_cycles) continue;
    const double error = std::hypot(cx, cy) - radius;
    sum += error;
    low = std::min(low, error);
    if (error > high) {
      high = error;
      result.angle_of_max = std::atan2(cy, cx);
    }
  }
  result.mean_error = sum / turn_cycles;
  result.peak_to_peak = high - low;
  return result;
}

TEST(AxisDrive, CircleRadiusError) {
  EXPECT_NEAR(circle(axis(), axis(), 0.1, 3000).mean_error, -7.81 * kUm, 0.02 * 7.81 * kUm);
  EXPECT_NEAR(circle(axis(), axis(), 0.025, 3000).mean_error, -31.2 * kUm, 0.02 * 31.2 * kUm);
  const AxisParams half = axis(40, 0.5);
  EXPECT_NEAR(circle(half, half, 0.1, 6000).mean_error, -23.4 * kUm, 0.02 * 23.4 * kUm);
  const AxisParams full = axis(40, 1, 1);
  EXPECT_NEAR(circle(full, full, 0.1, 6000).mean_error, 0, 1e-3 * kUm);
}

TEST(AxisDrive, GainMismatchMakesAnEllipseThatTurnsWithTheDirection) {
  const Circle ccw = circle(axis(40), axis(38), 0.1, 3000);
  const Circle cw = circle(axis(40), axis(38), 0.1, 3000, true);
  EXPECT_NEAR(ccw.peak_to_peak, 65.79 * kUm, 0.02 * 65.79 * kUm);
  EXPECT_NEAR(cw.peak_to_peak, 65.79 * kUm, 0.02 * 65.79 * kUm);
  // Long axis at 135 / -45 deg counter-clockwise, at 45 / -135 deg clockwise.
  const auto axis_angle = [](double a) { return a - kPi * std::floor(a / kPi); };
  EXPECT_NEAR(axis_angle(ccw.angle_of_max) / kDegree, 135, 3);
  EXPECT_NEAR(axis_angle(cw.angle_of_max) / kDegree, 45, 3);
  EXPECT_NEAR(circle(axis(50), axis(48), 0.15, 2000).peak_to_peak, 27.78 * kUm, 0.02 * 27.78 * kUm);
}

// Out and back smoothly (slower than friction alone brakes the load), with a pause on each end;
// load positions where both pass the middle, and the error of the load at rest on each end.
struct Reversal {
  double lost_motion = 0, error_out = 0, error_home = 0;
};
Reversal reversal(const AxisParams& params, const AxisEffects& effects) {
  AxisDrive drive(params, effects);
  const auto go = [&](double from, double to) {
    constexpr int kCycles = 1000;
    const double half = (to - from) / 2, w = kPi / (kCycles * kCycle);
    double at_middle = 0;
    AxisCycle cycle;
    for (int k = 1; k <= kCycles; ++k) {
      const double phi = w * kCycle * k;
      const double v = k == kCycles ? 0 : half * w * std::sin(phi);
      cycle = drive.follow({from + half * (1 - std::cos(phi)), v});
      if (k == kCycles / 2) at_middle = cycle.truth.back();
    }
    for (int k = 0; k < 800; ++k) cycle = drive.follow({to, 0});
    return std::pair{at_middle, cycle.truth.back() - to};
  };
  go(0, 0.02);
  go(0.02, 0);
  const auto [out, error_out] = go(0, 0.02);
  const auto [back, error_home] = go(0.02, 0);
  return {back - out, error_out, error_home};
}

TEST(AxisDrive, BacklashIsLostMotionWithMotorFeedback) {
  AxisEffects effects = friction();
  effects.get<Backlash>().gap = 10 * kUm;
  const Reversal r = reversal(axis(40, 1, 1), effects);
  EXPECT_NEAR(r.lost_motion, 10 * kUm, 0.3 * kUm);
  EXPECT_NEAR(r.error_home - r.error_out, 10 * kUm, 0.5 * kUm);
}

TEST(AxisDrive, BacklashIsGoneAtRestWithLoadFeedback) {
  AxisEffects effects = friction();
  effects.get<Backlash>().gap = 10 * kUm;
  AxisParams params = axis(40, 1, 1);
  params.servo.feedback = Feedback::load;
  const Reversal r = reversal(params, effects);
  EXPECT_NEAR(r.error_out, 0, 0.5 * kUm);
  EXPECT_NEAR(r.error_home, 0, 0.5 * kUm);
}

TEST(AxisDrive, NullEffectsLoseNothing) {
  EXPECT_NEAR(reversal(axis(40, 1, 1), {}).lost_motion, 0, 1e-3 * kUm);
}

// Free resonance sqrt(K (1/m + 1/m_r)) / 2 pi = 95 Hz of the twist after a step, with the velocity
// loop opened as far as the parameters allow.
TEST(AxisDrive, FreeResonanceOfTwoMasses) {
  AxisParams params = axis(0.1);
  params.servo.velocity_bandwidth = 1;
  params.servo.integral_time = 10;
  params.servo.feedback = Feedback::motor;
  AxisEffects effects;
  effects.get<Windup>().compliance = 1 / 1.5e8;
  effects.get<Windup>().damping_ratio = 0;
  AxisDrive drive(params, effects);
  // 1 mm of step: the force jumps and the spring rings.
  std::vector<double> twist;
  for (int k = 0; k < 1000; ++k) twist.push_back(drive.follow({0.1, 0}).second);
  double mean = 0;
  for (const double t : twist) mean += t / static_cast<double>(twist.size());
  std::vector<double> crossings;
  for (std::size_t i = 1; i < twist.size(); ++i) {
    const double a = twist[i - 1] - mean, b = twist[i] - mean;
    if (a < 0 && b >= 0) crossings.push_back((static_cast<double>(i) - b / (b - a)) * kCycle);
  }
  ASSERT_GT(crossings.size(), 50u);
  const double frequency =
      static_cast<double>(crossings.size() - 1) / (crossings.back() - crossings.front());
  const double m = 500, m_r = params.mechanics.reflected_inertia();
  EXPECT_NEAR(m_r, 2742, 1);
  const double expected = std::sqrt(1.5e8 * (1 / m + 1 / m_r)) / (2 * kPi);
  EXPECT_NEAR(expected, 95, 0.5);
  EXPECT_NEAR(frequency, expected, 0.03 * expected);
}

// With a fast velocity loop the position follows  tau s^2 + s + Kv = 0: damping 1/(2 sqrt(Kv tau)),
// here 0.707, so that a step overshoots by exp(-pi) = 4.3 %; the velocity loop adds 0.7 %.
TEST(AxisDrive, PositionLagTakesTheDampingOfThePositionLoop) {
  AxisParams params = axis(100, 0, 0);
  params.servo.velocity_bandwidth = 500;
  params.servo.integral_time = 10;
  const auto overshoot = [&] {
    AxisDrive drive(params);
    double most = 0;
    for (int k = 0; k < 200; ++k) most = std::max(most, drive.follow({10 * kUm, 0}).truth.back());
    return most / (10 * kUm) - 1;
  };
  EXPECT_LT(overshoot(), 0.001);
  params.servo.position_lag = 0.005;
  EXPECT_NEAR(overshoot(), std::exp(-kPi) + 0.007, 0.004);
}

// At an acceleration a the velocity that is fed back is a tau behind, as if the reference were that
// much higher: without an integral part the axis is a tau / Kv ahead of where it was without a lag.
TEST(AxisDrive, VelocityLagPutsTheAxisAheadWhileItAccelerates) {
  AxisParams params = axis(40, 1, 1);
  params.servo.integral_time = 1e3;
  const double a = 2;
  const auto ahead = [&] {
    AxisDrive drive(params);
    double error = 0;
    for (int k = 1; k <= 400; ++k) {
      const double t = k * kCycle, x = 0.5 * a * t * t;
      error = drive.follow({x, a * t}).truth.back() - x;
    }
    return error;
  };
  const double without = ahead();
  params.servo.velocity_lag = 0.0005;
  EXPECT_NEAR(ahead() - without, a * 0.0005 / 40, 0.02 * a * 0.0005 / 40);
  // Feed-forward that is as late takes that back, and alone puts the axis behind by as much.
  params.servo.feedforward_lag = 0.0005;
  EXPECT_NEAR(ahead() - without, 0, 0.02 * a * 0.0005 / 40);
  params.servo.velocity_lag = 0;
  EXPECT_NEAR(ahead() - without, -a * 0.0005 / 40, 0.02 * a * 0.0005 / 40);
}

// A set-point that is v tau behind is held, the axis with it, and the feed-forward passes by.
TEST(AxisDrive, ASetPointLagPutsTheAxisBehindByTheWayOfThatTime) {
  AxisParams params = axis(40, 1, 1);
  const auto behind = [&] {
    AxisDrive drive(params);
    const double v = 0.2;
    double error = 0;
    for (int k = 1; k <= 600; ++k) {
      const double x = v * k * kCycle;
      error = x - drive.follow({x, v}).truth.back();
    }
    return error / v;
  };
  const double without = behind();
  params.servo.setpoint_lag = 0.0008;
  EXPECT_NEAR(behind() - without, 0.0008, 1e-6);
}

TEST(AxisDrive, AFeedForwardLagChangesNothingAtConstantSpeed) {
  AxisParams params = axis(40, 1, 1);
  const auto behind = [&] {
    AxisDrive drive(params);
    AxisCycle cycle;
    for (int k = 1; k <= 1000; ++k) cycle = drive.follow({0.1 * kCycle * k, 0.1});
    return 0.1 * kCycle * 1000 - cycle.truth.back();
  };
  params.servo.feedforward_lag = 0.001;
  EXPECT_NEAR(behind(), 0, 1e-9);
}

// At constant speed against viscous friction the spring carries F = B v and winds up by F / K.
TEST(AxisDrive, WindupIsForceOverStiffness) {
  AxisEffects effects;
  effects.get<Windup>().compliance = 1 / 1.5e8;
  effects.get<Viscous>().coefficient = 4000;
  AxisDrive drive(axis(40, 1, 1), effects);
  AxisCycle cycle;
  const double v = 0.1;
  for (int k = 1; k <= 3000; ++k) cycle = drive.follow({v * kCycle * k, v});
  EXPECT_NEAR(cycle.second, -400 / 1.5e8, 1e-3 * 400 / 1.5e8);
  EXPECT_NEAR(cycle.force * AxisParams().mechanics.force_limit, 400, 0.1);
  EXPECT_NEAR(cycle.truth.back() - cycle.measured, cycle.second, 1e-12);
}

TEST(AxisDrive, ForceCarriesTheFriction) {
  AxisEffects effects = friction();
  AxisDrive drive(axis(40, 1, 1), effects);
  AxisCycle cycle;
  const double v = 0.05;
  for (int k = 1; k <= 3000; ++k) cycle = drive.follow({v * kCycle * k, v});
  EXPECT_NEAR(cycle.force * AxisParams().mechanics.force_limit, 250 + 1000 * v, 0.01);
  EXPECT_NEAR(cycle.truth.back(), v * 3, 1e-3 * kUm);  // the integral part removes its error
}

// Friction peaks at a reversal: outward after the quadrant, of a plausible size, then it decays.
TEST(AxisDrive, QuadrantGlitch) {
  AxisEffects effects = friction();
  effects.get<Viscous>().coefficient = 0;
  AxisDrive drive(axis(40, 1, 1), effects);
  const double radius = 0.1, w = 0.05 / radius;
  double peak = 0;
  for (int k = 1; k <= 3500; ++k) {
    const double phi = w * kCycle * k;
    const double x = radius * std::sin(phi);
    const double error = drive.follow({x, radius * w * std::cos(phi)}).truth.back() - x;
    if (k > 3142) peak = std::max(peak, error);  // sin turns at 3.142 s, towards minus
  }
  EXPECT_GT(peak, 0.5 * kUm);
  EXPECT_LT(peak, 20 * kUm);
}

TEST(AxisDrive, CoarseEncoderStaysQuiet) {
  for (const double quantum : {0.01 * kUm, 0.1 * kUm, 1 * kUm}) {
    AxisEffects effects;
    effects.get<EncoderQuantisation>().quantum = quantum;
    AxisDrive drive(axis(40, 1, 1), effects);
    double worst = 0, force = 0;
    const double v = 0.033;
    for (int k = 1; k <= 3000; ++k) {
      const double x = v * kCycle * k;
      const AxisCycle cycle = drive.follow({x, v});
      if (k <= 500) continue;
      worst = std::max(worst, std::abs(cycle.truth.back() - x));
      force = std::max(force, std::abs(cycle.force));
      ASSERT_LE(std::abs(cycle.measured - cycle.truth.back()), 0.5 * quantum * 1.0001);
    }
    EXPECT_LT(worst, quantum) << quantum;
    EXPECT_LT(force, 0.25 * quantum / kUm) << quantum;
  }
}

TEST(AxisDrive, QuickStopBrakesWithTheGivenDeceleration) {
  AxisDrive drive(axis(40, 1, 1), {});
  const double v = 0.1, a = 2;
  for (int k = 1; k <= 1000; ++k) drive.follow({v * kCycle * k, v});
  EXPECT_FALSE(drive.standing());
  const double from = drive.position();
  int cycles = 0;
  AxisCycle cycle;
  while (!drive.standing() && cycles < 1000) {
    cycle = drive.brake(a);
    ++cycles;
    const double t = kCycle * cycles;
    if (t < v / a) {
      ASSERT_NEAR(cycle.velocity, v - a * t, 1e-3);
    }
  }
  EXPECT_NEAR(cycles * kCycle, v / a, 2 * kCycle);
  EXPECT_NEAR(drive.position() - from, v * v / (2 * a), 1e-12);
  for (int k = 0; k < 300; ++k) cycle = drive.brake(a);
  EXPECT_NEAR(cycle.truth.back() - from, v * v / (2 * a), 0.1 * kUm);
}

TEST(AxisDrive, HoldsWhereItStands) {
  AxisParams params = axis(40, 1, 1);
  params.limits.start = 0.123;
  AxisEffects effects = friction();
  AxisDrive drive(params, effects);
  EXPECT_EQ(drive.position(), 0.123);
  for (int k = 0; k < 100; ++k) {
    const AxisCycle cycle = drive.hold();
    EXPECT_EQ(cycle.measured, 0.123);
    EXPECT_EQ(cycle.truth.back(), 0.123);
  }
  EXPECT_TRUE(drive.standing());
}

TEST(AxisDrive, ForceStaysWithinItsLimitAndTheIntegralDoesNotWindUp) {
  AxisParams params = axis(40, 1, 1);
  params.mechanics.force_limit = 1e4;  // 3.1 m/s^2; a step of 2 mm asks for forty times as much
  AxisDrive drive(params, {});
  double overshoot = 0;
  bool limited = false;
  for (int k = 0; k < 1000; ++k) {
    const AxisCycle cycle = drive.follow({2e-3, 0});
    ASSERT_LE(std::abs(cycle.force), 1.0);
    limited = limited || std::abs(cycle.force) == 1;
    overshoot = std::max(overshoot, cycle.truth.back() - 2e-3);
  }
  EXPECT_TRUE(limited);
  EXPECT_LT(overshoot, 0.8e-3);
  EXPECT_NEAR(drive.follow({2e-3, 0}).truth.back(), 2e-3, kUm);
}

TEST(AxisDrive, DefaultLoopsAreStableWithEveryMechanicalEffect) {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    for (const Feedback feedback : {Feedback::motor, Feedback::load}) {
      Machine machine;
      machine.axes[i].servo.feedback = feedback;
      AxisEffects& effects = machine.effects.axis[i];
      effects.get<Coulomb>().level = is_rotary(i) ? 4 : 250;
      effects.get<Stribeck>().excess = is_rotary(i) ? 2 : 100;
      effects.get<Windup>().compliance = is_rotary(i) ? 5e-7 : 1 / 1.5e8;
      effects.get<Backlash>().gap = is_rotary(i) ? 2e-5 : 5 * kUm;
      AxisDrive drive(machine, i, 1);
      const double amplitude = is_rotary(i) ? 0.3 : 0.05;
      for (int k = 1; k <= 4000; ++k) {
        const double phi = 2 * kPi * 0.5 * kCycle * k;
        const double x = amplitude * (1 - std::cos(phi));
        const AxisCycle cycle = drive.follow({x, amplitude * kPi * std::sin(phi)});
        ASSERT_NEAR(cycle.truth.back(), x, is_rotary(i) ? 1e-3 : 50 * kUm)
            << kAxisNames[i] << " by " << static_cast<int>(feedback) << " at " << k;
      }
    }
}

TEST(AxisDrive, BacklashWithoutAMotorSideIsRefused) {
  AxisParams params;
  params.mechanics.motor_inertia = 0;
  AxisEffects effects;
  effects.get<Backlash>().gap = 1e-6;
  EXPECT_THROW(AxisDrive(params, effects), std::invalid_argument);
  EXPECT_NO_THROW(AxisDrive(params, {}));
}

TEST(AxisDrive, SameInputsSameBits) {
  AxisEffects effects = friction();
  effects.get<Backlash>().gap = 5 * kUm;
  effects.get<EncoderQuantisation>().quantum = 0.1 * kUm;
  AxisDrive a(axis(), effects), b(axis(), effects);
  for (int k = 1; k <= 500; ++k) {
    const AxisSetpoint target{1e-5 * k * k, 2e-2 * k};
    EXPECT_EQ(a.follow(target).truth, b.follow(target).truth);
  }
}

// Variants of one axis side by side, with and without bristles, with and without effects at every
// port of the drive, under a known force; `sampled` ones with other dead times.
void expect_lanes_as_alone(bool two_masses, bool sampled) {
  std::vector<AxisEffects> effects(kLanes);
  std::vector<AxisParams> params;
  for (std::size_t i = 0; i < kLanes; ++i) {
    params.push_back(axis(40 + static_cast<double>(i), 1, 0.9));
    if (i > 0) effects[i] = friction();
    if (two_masses) effects[i].get<Windup>().compliance = 1e-9 * static_cast<double>(i + 1);
  }
  effects[2].get<Presliding>().stiffness = 2e7;
  effects[3].get<Cogging>().amplitude = 20;
  effects[4].get<PitchPeriodic>().amplitude = 1e-6;
  effects[5].get<CommandDelay>() = CommandDelay::nominal(false);
  effects[6].get<EncoderSubdivision>() = EncoderSubdivision::nominal(false);
  effects[7].get<CableChain>() = CableChain::nominal(false);
  params[1].mechanics.load *= 1.1;
  for (std::size_t i = 0; sampled && i < kLanes; ++i) {
    params[i].servo.controller = ServoParams::Controller::sampled;
    params[i].servo.velocity_bandwidth = 20;
    params[i].servo.dead_time = 0.13e-3 * static_cast<double>(i);
  }
  const auto drive = [&](std::size_t i) { return AxisDrive(params[i], effects[i]); };
  const std::size_t used = two_masses ? kLanes : kLanes - 1;  // not all need be used
  std::vector<AxisDrive> alone, together;
  for (std::size_t i = 0; i < used; ++i) {
    alone.push_back(drive(i));
    together.push_back(drive(i));
  }
  AxisDriveLanes lanes(std::move(together));
  const auto load_force = [](std::size_t i, int k) {
    return 10 * std::sin(0.03 * k + static_cast<double>(i));
  };
  const auto of_lanes = [](auto&& f) {
    Lanes all(0);
    for (std::size_t i = 0; i < kLanes; ++i) set_lane(all, i, f(i));
    return all;
  };
  for (int k = 1; k <= 1000; ++k) {
    const double angle = 2 * kPi * k / 400;
    const double x = 2e-3 * (1 - std::cos(angle)), v = 2e-3 * 2 * kPi / 0.4 * std::sin(angle);
    const KnownForce known{.added = 30 * std::sin(0.05 * k), .applied = k % 100 < 50 ? 20.0 : 0};
    lanes.tell_force(known);
    lanes.tell_load_force(of_lanes([&](std::size_t i) { return load_force(i, k); }));
    const AxisDriveLanes::Cycle cycles = lanes.follow({x, v});
    for (std::size_t i = 0; i < used; ++i) {
      alone[i].tell_force(known);
      alone[i].tell_load_force(load_force(i, k));
      const AxisCycle cycle = alone[i].follow({x, v});
      ASSERT_EQ(lane(cycles.measured, i), cycle.measured) << "lane " << i << ", cycle " << k;
      ASSERT_EQ(lane(cycles.second, i), cycle.second) << "lane " << i << ", cycle " << k;
      ASSERT_EQ(lane(cycles.force, i), cycle.force) << "lane " << i << ", cycle " << k;
      for (std::size_t j = 0; j < cycle.truth.size(); ++j)
        ASSERT_EQ(lane(cycles.truth[j], i), cycle.truth[j]) << "lane " << i << ", cycle " << k;
    }
  }
}

TEST(AxisDriveLanes, ComeToTheSameBitsAsAlone) {
  for (const bool two_masses : {false, true})
    for (const bool sampled : {false, true}) expect_lanes_as_alone(two_masses, sampled);
}

// A sine of force from outside moves a rigid axis with a cascade as its transfer function says.
// With C = Kp (1 + 1 / (Ti s)), and a velocity that the observer, three poles at -p, tells less by
// s (s + 3 p) / (s + p)^3 F / J because it does not know of F, the loops being continuous:
//   x / F = (1 + C s (s + 3 p) / (J (s + p)^3)) / (J s^2 + C (s + Kv))
TEST(AxisDrive, AnswersAForceFromOutsideAsItsTransferFunctionSays) {
  AxisParams params;
  params.servo.current_lag = 0;
  const double kp = 2 * kPi * params.servo.velocity_bandwidth * params.mechanics.total_inertia(),
               kv = params.servo.kv_per_s, ti = params.servo.integral_time,
               inertia = params.mechanics.total_inertia(), p = 4 * kp / inertia;
  for (const double f : {1.0, 4.0}) {
    const std::complex<double> s(0, 2 * kPi * f);
    const std::complex<double> c = kp * (1.0 + 1.0 / (ti * s)),
                               unseen = s * (s + 3 * p) / (inertia * std::pow(s + p, 3)),
                               answer = (1.0 + c * unseen) / (inertia * s * s + c * (s + kv));
    AxisDrive drive(params);
    std::complex<double> seen = 0;
    const int cycles = 4000, from = 2000;  // whole periods
    for (int k = 1; k <= cycles; ++k) {
      const double phase = 2 * kPi * f * k * 1e-3;
      drive.tell_force({.applied = 100 * std::sin(phase)});
      const double moved = drive.hold().measured;
      if (k > from) seen += moved * std::polar(1.0, -phase);
    }
    seen *= std::complex<double>(0, 2.0 / (cycles - from)) / 100.0;  // of a sine
    EXPECT_NEAR(std::abs(seen / answer), 1, 0.01) << f;
    EXPECT_NEAR(std::arg(seen / answer), 0, 0.01) << f;
  }
}

TEST(AxisDrive, IsMovedByALoadForceAsByAnAppliedOne) {
  AxisDrive a{AxisParams{}}, b{AxisParams{}};
  double farthest = 0;
  for (int k = 1; k <= 500; ++k) {
    const double force = 100 * std::sin(0.05 * k);
    a.tell_force({.applied = force});
    b.tell_load_force(force);
    const double moved = a.hold().measured;
    EXPECT_NEAR(b.hold().measured, moved, 1e-15);
    farthest = std::max(farthest, std::abs(moved));
  }
  EXPECT_GT(farthest, 1e-7);
}

TEST(AxisDrive, TakesBackWhatIsAddedToItsForce) {
  AxisDrive drive{AxisParams{}};
  AxisCycle cycle;
  double farthest = 0;
  for (int k = 0; k < 3000; ++k) {
    drive.tell_force({.added = k < 10 ? 0.0 : 200});
    cycle = drive.hold();
    farthest = std::max(farthest, cycle.measured);
  }
  EXPECT_GT(farthest, 1e-7);
  EXPECT_NEAR(cycle.measured, 0, 1e-12);  // the integrator holds against it
  EXPECT_NEAR(cycle.force, 0, 1e-9);
}

}  // namespace
}  // namespace vcnc::axis_drive_test
