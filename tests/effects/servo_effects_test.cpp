// Every effect of the servo against a closed form, through the drive.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "model/drive/axis_drive.hpp"

namespace vcnc::servo_effects_test {
namespace {

using Complex = std::complex<double>;
constexpr double kCycle = 1e-3, kUm = 1e-6, kNm = 1e-9;

template <class E>
AxisEffects only(const E& effect) {
  AxisEffects effects;
  effects.get<E>() = effect;
  return effects;
}

AxisParams axis(double kv = 40, double velocity_ff = 1, double acceleration_ff = 1) {
  AxisParams p;
  p.servo.kv_per_s = kv;
  p.servo.velocity_ff = velocity_ff;
  p.servo.acceleration_ff = acceleration_ff;
  return p;
}

/// X of a machine as by default, with one effect and a constant or stepping force on the table.
template <class E>
Machine machine_with(const E& effect, double force = 0, double force_from = 0) {
  Machine machine;
  machine.effects.axis[kX].get<E>() = effect;
  if (force != 0)
    machine.effects.laws.push_back({.label = "",
                                    .point = Law::Point::table_force,
                                    .at = {force_from, force_from + 1e-6},
                                    .value = {force_from > 0 ? 0.0 : force, force}});
  return machine;
}

/// Set-point less true position after `seconds` of motion at constant speed.
double ramp_error(const AxisParams& params, const AxisEffects& effects, double v = 0.05,
                  double seconds = 1.5) {
  AxisDrive drive(params, effects);
  const int cycles = static_cast<int>(std::lround(seconds / kCycle));
  double truth = 0;
  for (int k = 1; k <= cycles; ++k) truth = drive.follow({v * kCycle * k, v}).truth.back();
  return v * kCycle * cycles - truth;
}

struct Circle {
  double mean_error = 0, peak_to_peak = 0, angle_of_max = 0;  ///< angle in 0..pi
};

/// Two drives on a circle; radius errors of the true positions in the second turn.
Circle circle(const AxisParams& px, const AxisEffects& ex, const AxisParams& py,
              const AxisEffects& ey, double radius, double feed_mm_min, bool clockwise = false) {
  AxisParams start = px;
  start.limits.start = radius;
  AxisDrive x(start, ex), y(py, ey);
  const double w = feed_mm_min / 60e3 / radius, sign = clockwise ? -1 : 1;
  const int turn = static_cast<int>(std::lround(2 * kPi / w / kCycle));
  double sum = 0, low = 1, high = -1;
  Circle result;
  for (int k = 1; k <= 2 * turn; ++k) {
    const double phi = w * kCycle * k;
    const double cx = x.follow({radius * std::cos(phi), -radius * w * std::sin(phi)}).truth.back();
    const double cy =
        y.follow({sign * radius * std::sin(phi), sign * radius * w * std::cos(phi)}).truth.back();
    if (k <= turn) continue;
    const double error = std::hypot(cx, cy) - radius;
    sum += error;
    low = std::min(low, error);
    if (error > high) {
      high = error;
      result.angle_of_max = std::fmod(std::atan2(cy, cx) + 2 * kPi, kPi);
    }
  }
  result.mean_error = sum / turn;
  result.peak_to_peak = high - low;
  return result;
}

/// Amplitude at `frequency` [Hz] of set-point less true position, over whole periods after the
/// motion x(t), v(t) has settled.
template <class Position, class Velocity>
double error_wave(AxisDrive& drive, double frequency, Position&& x, Velocity&& v) {
  const int period = static_cast<int>(std::lround(1 / (frequency * kCycle)));
  const int first = 2000 / period * period + period, last = first + 4 * period;
  Complex sum = 0;
  for (int k = 1; k <= last; ++k) {
    const double t = kCycle * k;
    const double error = x(t) - drive.follow({x(t), v(t)}).truth.back();
    if (k > first) sum += error * std::polar(1.0, -2 * kPi * frequency * t);
  }
  return 2 * std::abs(sum) / (last - first);
}

double sine_error(const AxisParams& params, const AxisEffects& effects, double amplitude,
                  double frequency) {
  AxisDrive drive(params, effects);
  const double w = 2 * kPi * frequency;
  return error_wave(
      drive, frequency, [&](double t) { return amplitude * (1 - std::cos(w * t)); },
      [&](double t) { return amplitude * w * std::sin(w * t); });
}

/// The velocity loop Kp (1 + 1/(Ti s)).
Complex controller(const AxisParams& p, Complex s) {
  const double kp = 2 * kPi * p.servo.velocity_bandwidth * p.mechanics.total_inertia();
  return kp * (1.0 + 1.0 / (p.servo.integral_time * s));
}

/// The observer does not know an outer force d: its velocity is too low by c s d/J in slow motion.
/// c from the gains of its three equal poles.
double observer_lag(const AxisParams& p) {
  const double pole = std::exp(-4 * 2 * kPi * p.servo.velocity_bandwidth * kDriveLoopTime);
  const double fade = 1 - pole;
  return (1 - pole * pole * pole - 0.75 * fade * fade * (1 + pole)) * kDriveLoopTime *
         kDriveLoopTime / (fade * fade * fade);
}

/// Position over an outer force, slow against the observer.
double compliance(const AxisParams& p, double frequency) {
  const Complex s(0, 2 * kPi * frequency);
  const double inertia = p.mechanics.total_inertia();
  const Complex c = controller(p, s);
  return std::abs((1.0 + c * observer_lag(p) * s / inertia) /
                  (inertia * s * s + c * (p.servo.kv_per_s + s)));
}

// ------------------------------------------------------------------------------------ gains

TEST(KvError, RampAndEllipse) {
  // e = v / (Kv (1 + d)) without feed-forward.
  for (const double d : {-0.5, -0.1, 0.25})
    EXPECT_NEAR(ramp_error(axis(40, 0, 0), only(KvError{d})), 0.05 / (40 * (1 + d)), 0.01 * kNm);
  // domain: Kv 40 and 38 at F3000, 65.79 um peak to peak; the long axis turns with the direction.
  const AxisEffects low = only(KvError{-0.05});
  const Circle ccw = circle(axis(40, 0, 0), {}, axis(40, 0, 0), low, 0.1, 3000);
  const Circle cw = circle(axis(40, 0, 0), {}, axis(40, 0, 0), low, 0.1, 3000, true);
  EXPECT_NEAR(ccw.peak_to_peak, 65.79 * kUm, 0.0005 * 65.79 * kUm);
  EXPECT_NEAR(cw.peak_to_peak, 65.79 * kUm, 0.0005 * 65.79 * kUm);
  EXPECT_NEAR(ccw.angle_of_max / kDegree, 135, 1);
  EXPECT_NEAR(cw.angle_of_max / kDegree, 45, 1);
}

TEST(VelocityFfError, RampAndRadius) {
  for (const double d : {-0.5, -0.01, 0.02})
    EXPECT_NEAR(ramp_error(axis(), only(VelocityFfError{d})), -d * 0.05 / 40, 0.01 * kNm);
  // -(v^2/2R)(1 - kvff^2)/Kv^2: -23.4 um for kvff 0.5, R 100, F6000, Kv 40.
  const AxisEffects half = only(VelocityFfError{-0.5});
  EXPECT_NEAR(circle(axis(40, 1, 0), half, axis(40, 1, 0), half, 0.1, 6000).mean_error, -23.4 * kUm,
              0.002 * 23.4 * kUm);
  // S02: kvff = 1 + d also where nothing is declared.
  EXPECT_NEAR(ramp_error(axis(40, 0), only(VelocityFfError{1})), 0, 0.01 * kNm);
}

TEST(AccelerationFfError, SineErrorIsTheTransferFunction) {
  const AxisParams p = axis();
  const double inertia = p.mechanics.total_inertia();
  for (const double frequency : {1.0, 5.0}) {
    const Complex s(0, 2 * kPi * frequency), inert = inertia * s * s;
    for (const double d : {-0.5, 0.2}) {
      const double expected =
          2e-3 * std::abs(d * inert / (inert + controller(p, s) * (p.servo.kv_per_s + s)));
      EXPECT_NEAR(sine_error(p, only(AccelerationFfError{d}), 2e-3, frequency), expected,
                  0.001 * expected);
    }
  }
}

/// Area under the deviation after a step of the force on the table [m s].
double area_after_step(const Machine& machine) {
  AxisDrive drive(machine, kX, 1);
  double area = 0;
  for (int k = 0; k < 2000; ++k) {
    drive.tell_commands({}, {});
    for (const double x : drive.follow({}).truth) area += x * kDriveLoopTime;
  }
  return area;
}

// The integral must have become -F: int (Kv x + v) dt = F Ti/Kp, and the observer's velocity sums
// up to -c F/J instead of 0.
double expected_area(const AxisParams& p, double force, double ti_factor, double kp_factor) {
  const double inertia = p.mechanics.total_inertia();
  const double kp = 2 * kPi * p.servo.velocity_bandwidth * inertia * kp_factor;
  return force / p.servo.kv_per_s *
         (p.servo.integral_time * ti_factor / kp + observer_lag(p) / inertia);
}

TEST(IntegralTimeError, AreaAfterAStepOfForce) {
  const double force = 1000;
  for (const double d : {-0.5, 0.0, 1.0, 9.0}) {
    const double expected = expected_area(Machine().axes[kX], force, 1 + d, 1);
    EXPECT_NEAR(area_after_step(machine_with(IntegralTimeError{d}, force, 0.1)), expected,
                1e-7 * expected)
        << d;
  }
}

TEST(VelocityGainError, AreaAfterAStepOfForce) {
  const double force = 1000;
  for (const double d : {-0.6, 0.5}) {
    const double expected = expected_area(Machine().axes[kX], force, 1, 1 + d);
    EXPECT_NEAR(area_after_step(machine_with(VelocityGainError{d}, force, 0.1)), expected,
                1e-7 * expected)
        << d;
  }
}

TEST(CurrentLag, SineErrorIsTheTransferFunction) {
  const AxisParams p = axis();
  const double inertia = p.mechanics.total_inertia();
  const Complex s(0, 2 * kPi * 10), inert = inertia * s * s;
  const double lag = 1e-3, amplitude = 1e-3;
  // A discrete lag in steps of h delays slow forces by h/(exp(h/lag) - 1).
  const double delay = kPlantTime / std::expm1(kPlantTime / lag);
  const double expected =
      amplitude *
      std::abs(delay * s * inert / ((1.0 + delay * s) * inert + controller(p, s) * (40.0 + s)));
  EXPECT_NEAR(sine_error(p, only(CurrentLag{lag}), amplitude, 10), expected, 0.005 * expected);
  // It adds to the declared one.
  AxisParams lagging = p;
  lagging.servo.current_lag = lag / 2;
  EXPECT_NEAR(sine_error(lagging, only(CurrentLag{lag / 2}), amplitude, 10),
              sine_error(p, only(CurrentLag{lag}), amplitude, 10), 1e-6 * kNm);
}

TEST(TorqueLimit, LargestAccelerationIsTheLimitOverTheInertia) {
  for (const double d : {0.0, 0.8, 0.95}) {
    const AxisParams p = axis();
    AxisDrive drive(p, only(TorqueLimit{d}));
    const double a = p.mechanics.force_limit * (1 - d) / p.mechanics.total_inertia();
    for (int k = 0; k < 5; ++k) drive.follow({1, 0});
    for (int k = 0; k < 50; ++k) {
      const AxisCycle cycle = drive.follow({1, 0});
      EXPECT_NEAR(cycle.force, 1 - d, 1e-12);
      for (std::size_t i = 2; i < cycle.truth.size(); ++i)
        EXPECT_NEAR((cycle.truth[i] - 2 * cycle.truth[i - 1] + cycle.truth[i - 2]) / 1e-8, a,
                    1e-6 * a);
    }
  }
}

// ------------------------------------------------------------------------------------ delay

TEST(CommandDelay, WholeCyclesShiftTheMotion) {
  AxisDrive plain(axis(), {}), late(axis(), only(CommandDelay{3e-3}));
  const auto target = [](int k) {
    const double t = kCycle * std::max(k, 0), w = 2 * kPi * 4;
    return AxisSetpoint{0.02 * (1 - std::cos(w * t)), 0.02 * w * std::sin(w * t)};
  };
  for (int k = 1; k <= 3; ++k) {
    const AxisCycle waiting = late.follow(target(k));
    EXPECT_EQ(waiting.truth.back(), 0);
  }
  for (int k = 1; k <= 500; ++k) {
    const AxisCycle a = plain.follow(target(k)), b = late.follow(target(k + 3));
    // Rounding of the velocity at the seams between cycles: v T / T is not always v.
    for (std::size_t i = 0; i < a.truth.size(); ++i)
      ASSERT_NEAR(a.truth[i], b.truth[i], 1e-14) << k;
    ASSERT_NEAR(a.force, b.force, 1e-9) << k;
  }
}

TEST(CommandDelay, PartsOfALoopStepShiftACubicExactly) {
  const double jerk = 0.05;
  for (const double delay : {0.137e-3, 1.25e-3, 4.99e-3}) {
    AxisDrive plain(axis(), {}), late(axis(), only(CommandDelay{delay}));
    const auto target = [&](double t) {
      return AxisSetpoint{jerk * t * t * t / 6, jerk * t * t / 2};
    };
    double worst = 0, off = 0;
    for (int k = 1; k <= 1500; ++k) {
      const double t = kCycle * k;
      const AxisCycle b = late.follow(target(t)),
                      a = plain.follow(target(std::max(0.0, t - delay)));
      if (k < 1000) continue;
      for (std::size_t i = 0; i < a.truth.size(); ++i)
        worst = std::max(worst, std::abs(a.truth[i] - b.truth[i]));
      off = std::max(off, std::abs(b.truth.back() - target(t - delay).position));
    }
    EXPECT_LT(worst, 1e-12);
    EXPECT_LT(off, 0.1 * kNm);
  }
}

TEST(CommandDelay, RampAndEllipse) {
  for (const double delay : {0.02e-3, 0.5e-3, 5e-3})
    EXPECT_NEAR(ramp_error(axis(), only(CommandDelay{delay})), 0.05 * delay, 0.001 * kNm);
  // v td = 10 um peak to peak at 45 deg; it turns with the direction.
  const AxisEffects late = only(CommandDelay{0.2e-3});
  const Circle ccw = circle(axis(), {}, axis(), late, 0.1, 3000);
  const Circle cw = circle(axis(), {}, axis(), late, 0.1, 3000, true);
  EXPECT_NEAR(ccw.peak_to_peak, 10 * kUm, 0.001 * 10 * kUm);
  EXPECT_NEAR(cw.peak_to_peak, 10 * kUm, 0.001 * 10 * kUm);
  EXPECT_NEAR(ccw.angle_of_max / kDegree, 135, 1);
  EXPECT_NEAR(cw.angle_of_max / kDegree, 45, 1);
}

TEST(CommandDelay, HoldEndsWhereItWasTold) {
  AxisDrive drive(axis(), only(CommandDelay{1.23e-3}));
  AxisSetpoint target;
  for (int k = 1; k <= 500; ++k) drive.follow(target = {0.02 * kCycle * k, 0.02});
  AxisCycle cycle;
  for (int k = 0; k < 1000; ++k) cycle = drive.hold();
  EXPECT_NEAR(cycle.truth.back(), target.position, 0.001 * kNm);
  for (int k = 1; k <= 1000; ++k) cycle = drive.follow({target.position - 1e-6 * k, -1e-3});
  EXPECT_NEAR(cycle.truth.back(), target.position - 1e-3 + 1e-3 * 1.23e-3, 0.01 * kNm);
}

// --------------------------------------------------------------------------- measuring system

TEST(EncoderSubdivision, TheTableIsOffByMinusTheError) {
  const EncoderSubdivision effect{.amplitude = 150 * kNm, .period = 20 * kUm, .phase = 1.1};
  AxisDrive drive(axis(), only(effect));
  const double v = 20 * kUm;  // one wave per second
  for (int k = 1; k <= 3000; ++k) {
    const double x = v * kCycle * k;
    const AxisCycle cycle = drive.follow({x, v});
    if (k < 1000) continue;
    const double table = cycle.truth.back(), angle = 2 * kPi / effect.period * table + effect.phase;
    ASSERT_NEAR(cycle.measured, table + effect.amplitude * std::sin(angle), 1e-15);
    // The loop follows 1 Hz to one part in ten thousand.
    ASSERT_NEAR(table - x, -effect.amplitude * std::sin(angle), 3e-4 * effect.amplitude);
  }
}

TEST(EncoderSubdivision, FastWavesPassAsTheClosedLoopLets) {
  // Measured x + n: the observer (poles w) takes s n w^2 (3 s + w)/(s + w)^3 for velocity, so
  //   x/n = -C (Kv + s w^2 (3 s + w)/(s + w)^3) / (J s^2 + C (Kv + s)).
  const AxisParams p = axis();
  for (const double frequency : {4.0, 50.0, 200.0}) {
    const Complex s(0, 2 * kPi * frequency), c = controller(p, s);
    const double w = 4 * 2 * kPi * p.servo.velocity_bandwidth, kv = p.servo.kv_per_s;
    const double expected =
        std::abs(c * (kv + s * w * w * (3.0 * s + w) / ((s + w) * (s + w) * (s + w))) /
                 (p.mechanics.total_inertia() * s * s + c * (kv + s)));
    AxisDrive drive(p, only(EncoderSubdivision{.amplitude = 50 * kNm, .period = 20 * kUm}));
    const double v = frequency * 20 * kUm;
    const double wave = error_wave(
        drive, frequency, [&](double t) { return v * t; }, [&](double) { return v; });
    // Continuous formula against a loop at 10 kHz.
    EXPECT_NEAR(wave / (50 * kNm), expected, frequency < 100 ? 0.01 * expected : 0.04 * expected);
  }
}

/// One wave per second; calls at(cycle, command, wave, what of it a position loop follows) when the
/// loop has settled.
template <class Effect, class At>
void pass_waves(ServoParams::Feedback feedback, const Effect& effect, At&& at) {
  AxisParams p = axis();
  p.servo.feedback = feedback;
  AxisDrive drive(p, only(effect));
  const double v = effect.period, w = 2 * kPi, kv = p.servo.kv_per_s;
  for (int k = 1; k <= 3000; ++k) {
    const double x = v * kCycle * k;
    const AxisCycle cycle = drive.follow({x, v});
    if (k < 1000) continue;
    const double angle = w / effect.period * cycle.truth.back() + effect.phase;
    ASSERT_NEAR(cycle.second, effect.amplitude * std::sin(angle), 4e-4 * effect.amplitude);
    const double followed =
        std::sin(angle - std::atan(w / kv)) / std::hypot(1, w / kv);  // Kv/(s + Kv)
    at(cycle, x, effect.amplitude * std::sin(angle), effect.amplitude * followed);
  }
}

TEST(TransmissionError, MovesTheLoadIfTheLoopIsClosedOnTheMotor) {
  const TransmissionError effect{.amplitude = 1 * kUm, .period = 20e-3, .phase = 1.1};
  const double within = 5e-3 * effect.amplitude;
  const MechanicsParams m = axis().mechanics;
  const double w2 = 4 * kPi * kPi, force = 0.02 * w2 * m.total_inertia() * effect.amplitude;
  pass_waves(ServoParams::Feedback::motor, effect,
             [&](const AxisCycle& cycle, double x, double wave, double) {
               ASSERT_NEAR(cycle.truth.back() - x, wave, within);
               ASSERT_NEAR(cycle.measured, x, within);
               // The load alone is accelerated by the wave.
               ASSERT_NEAR(cycle.force * m.force_limit, -w2 * m.load * wave, force);
             });
  pass_waves(ServoParams::Feedback::load, effect,
             [&](const AxisCycle& cycle, double x, double wave, double followed) {
               ASSERT_NEAR(cycle.truth.back() - x, wave - followed, within);  // s/(s + Kv)
               ASSERT_NEAR(cycle.force * m.force_limit,
                           -w2 * (m.load * (wave - followed) - m.reflected_inertia() * followed),
                           force);
               ASSERT_EQ(cycle.measured, cycle.truth.back());
             });
}

/// With the loop closed on the motor the load is off by e q; closed on the load the motor alone is.
TEST(LeadError, IsOneOfTheScaleOnlyIfTheLoopIsClosedOnTheMotor) {
  const LeadError effect{.error = 80e-6};
  for (const auto side : {ServoParams::Feedback::motor, ServoParams::Feedback::load}) {
    AxisParams params = axis();
    params.servo.feedback = side;
    params.limits.start = 0.03;
    AxisEffects effects;
    effects.get<LeadError>() = effect;
    AxisDrive drive(params, effects), even(params);
    double x = 0.03;
    for (int k = 1; k <= 2000; ++k) {
      x = 0.03 + 0.05 * kCycle * k;
      const AxisCycle cycle = drive.follow({x, 0.05});
      const double off = cycle.truth.back() - even.follow({x, 0.05}).truth.back();
      const double travelled = effect.error * (x - 0.03);
      if (k < 500) continue;
      ASSERT_NEAR(cycle.second, travelled, 1e-9 + 0.002 * travelled);
      ASSERT_NEAR(off, side == ServoParams::Feedback::motor ? travelled : 0, 0.2 * kUm);
    }
    EXPECT_GT(effect.error * (x - 0.03), 7 * kUm);
  }
}

/// Of two masses at constant speed: the force of the drive, and the twist that it winds up.
std::pair<double, double> drawn(const AxisEffects& effects, double v) {
  AxisDrive drive(axis(), effects);
  AxisCycle cycle;
  double force = 0, twist = 0;
  for (int k = 1; k <= 2000; ++k) {
    cycle = drive.follow({v * kCycle * k, v});
    if (k > 1000) force += cycle.force / 1000, twist += cycle.second / 1000;
  }
  return {force * axis().mechanics.force_limit, twist};
}

TEST(MotorFriction, TakesForceThatTheTransmissionDoesNotCarry) {
  const double level = 100, viscous = 500, compliance = 10e-9;
  for (const double v : {0.05, -0.1}) {
    AxisEffects effects;
    effects.get<Windup>().compliance = compliance;
    AxisEffects of_load = effects;
    effects.get<MotorFriction>() = {level, viscous};
    of_load.get<Coulomb>().level = level;
    of_load.get<Viscous>().coefficient = viscous;
    const double expected = std::copysign(level, v) + viscous * v;
    const auto [force, twist] = drawn(effects, v);
    EXPECT_NEAR(force, expected, 1e-3 * level);
    EXPECT_NEAR(twist, 0, 0.001 * kNm);
    const auto [load_force, load_twist] = drawn(of_load, v);
    EXPECT_NEAR(load_force, expected, 1e-3 * level);
    EXPECT_NEAR(load_twist, -compliance * expected, 0.001 * kNm);
  }
}

// Bristles of stiffness s bend by x before they slip: F = F_c (1 - exp(-s x / F_c)) (Dahl), while
// the load, which the transmission does not push, stays behind by its own inertia alone.
TEST(MotorFriction, BristlesBendBeforeTheySlip) {
  const double level = 100, stiffness = 2e7, v = 20e-6;  // [N], [N/m], [m/s]
  AxisEffects effects;
  effects.get<Windup>().compliance = 10e-9;
  effects.get<MotorFriction>() = {.level = level, .stiffness = stiffness};
  AxisDrive drive(axis(), effects);
  for (int k = 1; k <= 1000; ++k) {
    const AxisCycle cycle = drive.follow({v * kCycle * k, v});
    const double x = cycle.measured;
    if (k % 50 != 0) continue;
    EXPECT_NEAR(cycle.force * axis().mechanics.force_limit,
                level * (1 - std::exp(-stiffness * x / level)), 0.02 * level)
        << k;
  }
}

TEST(MotorFriction, OfOneMassIsThatOfTheLoad) {
  AxisEffects of_load;
  of_load.get<Coulomb>().level = 100;
  of_load.get<Viscous>().coefficient = 500;
  AxisDrive motor(axis(), only(MotorFriction{100, 500})), load(axis(), of_load);
  for (int k = 1; k <= 2000; ++k) {
    const double w = 2 * kPi, t = kCycle * k;
    const AxisSetpoint target{0.01 * std::sin(w * t), 0.01 * w * std::cos(w * t)};
    const AxisCycle a = motor.follow(target), b = load.follow(target);
    ASSERT_EQ(a.truth, b.truth) << k;
    ASSERT_EQ(a.force, b.force) << k;
  }
}

/// What is counted late is where the load was. A loop closed on it goes ahead until
/// Kv (x_c - x + t_d x') + x_c' = x': by t_d x_c'/(1 + b s), b = 1/Kv - t_d.
TEST(LoadEncoderLatency, CountsWhereTheLoadWas) {
  constexpr std::size_t kSteps = 8;
  const double latency = kSteps * kDriveLoopTime, w = 2 * kPi, amplitude = 0.05;
  for (const auto side : {ServoParams::Feedback::motor, ServoParams::Feedback::load}) {
    AxisParams params = axis();
    params.servo.feedback = side;
    AxisDrive drive(params, only(LoadEncoderLatency{latency})), even(params);
    for (int k = 1; k <= 3000; ++k) {
      const double t = k * kCycle;
      const AxisSetpoint target{amplitude * (1 - std::cos(w * t)), amplitude * w * std::sin(w * t)};
      const AxisCycle cycle = drive.follow(target), without = even.follow(target);
      if (k < 1000) continue;
      const double load = cycle.truth.back();
      const double way = cycle.truth[kDriveLoopSteps - 1 - kSteps] - load;
      const double next_term = std::pow(latency * w, 3) / 6 * amplitude;
      ASSERT_NEAR(cycle.second, way, 1.1 * next_term + 0.01 * kUm);
      const bool closed_on_it = side == ServoParams::Feedback::load;
      ASSERT_NEAR(cycle.measured, closed_on_it ? load + cycle.second : load, 1e-12);
      const double b = 1 / params.servo.kv_per_s - latency, most = latency * amplitude * w;
      const double ahead = most * std::sin(w * t - std::atan(w * b)) / std::hypot(1, w * b);
      ASSERT_NEAR(load - without.truth.back(), closed_on_it ? ahead : 0, 0.03 * most);
    }
  }
}

TEST(LoadEncoderError, MovesTheLoadIfTheLoopIsClosedOnIt) {
  const LoadEncoderError effect{.amplitude = 1 * kUm, .period = 20e-3, .phase = 1.1};
  const double within = 5e-3 * effect.amplitude;
  pass_waves(ServoParams::Feedback::load, effect,
             [&](const AxisCycle& cycle, double x, double wave, double followed) {
               ASSERT_NEAR(cycle.truth.back() - x, -followed, within);
               ASSERT_NEAR(cycle.measured, cycle.truth.back() + wave, 1e-12);
             });
  pass_waves(ServoParams::Feedback::motor, effect,
             [&](const AxisCycle& cycle, double x, double, double) {
               ASSERT_NEAR(cycle.truth.back(), x, within);
               ASSERT_EQ(cycle.measured, cycle.truth.back());
             });
}

TEST(EncoderEccentricity, TheAxisIsOffByMinusTheError) {
  Machine machine;
  // Graduation of 100 mm diameter, 2 um off its centre: 412 e/D = 8.24 arcsec (Heidenhain).
  const double amplitude = 412 * 2.0 / 100 * unit::arcsec.to_si, phase = -0.7;
  EXPECT_NEAR(amplitude, 2 * 2e-6 / 0.1, 0.002 * amplitude);
  machine.effects.axis[kC].get<EncoderEccentricity>() = {amplitude, phase};
  AxisDrive drive(machine, kC, 1);
  const double w = 0.5;
  for (int k = 1; k <= 14000; ++k) {
    const double q = w * kCycle * k, truth = drive.follow({q, w}).truth.back();
    if (k < 1000) continue;
    ASSERT_NEAR(truth - q, -amplitude * std::sin(truth + phase), 1e-4 * amplitude);
  }
}

// -------------------------------------------------------------------------------- motor force

/// Amplitude of the table's error at `frequency` while X moves at constant speed.
double wave_at_speed(const Machine& machine, double v, double frequency) {
  AxisDrive drive(machine, kX, 1);
  drive.tell_commands({}, {});
  return error_wave(
      drive, frequency, [&](double t) { return v * t; }, [&](double) { return v; });
}

TEST(Cogging, TheTableMovesByTheComplianceOfTheLoop) {
  const AxisParams p = Machine().axes[kX];
  for (const double frequency : {1.0, 2.0, 5.0}) {
    const double expected = 50 * compliance(p, frequency);
    EXPECT_NEAR(wave_at_speed(machine_with(Cogging{50, 4e-3, 0.3}), 4e-3 * frequency, frequency),
                expected, 0.004 * expected);
  }
}

TEST(Cogging, TheForceCarriesTheWaveAtCreepFeed) {
  const Cogging effect{50, 1e-3, 0.3};
  AxisDrive drive(axis(), only(effect));
  const double limit = axis().mechanics.force_limit, v = 0.2e-3;
  for (int k = 1; k <= 8000; ++k) {
    const AxisCycle cycle = drive.follow({v * kCycle * k, v});
    if (k < 2000) continue;
    const double angle = 2 * kPi * cycle.truth.back() / effect.pitch + effect.phase;
    ASSERT_NEAR(cycle.force * limit, -50 * std::sin(angle), 1.0);  // 0.2 Hz through the loop's lag
  }
}

TEST(TorqueRipple, WavesPerTurnWithAndWithoutLoad) {
  const AxisParams p = Machine().axes[kX];
  // 12 mm per turn, order 6: 2 mm; at 4 mm/s 2 Hz.
  const double wave = compliance(p, 2);
  EXPECT_NEAR(wave_at_speed(machine_with(TorqueRipple{.amplitude = 40}), 4e-3, 2), 40 * wave,
              0.004 * 40 * wave);
  // A weight of 2000 N is carried: 3 % of it in addition. The loop's answer to the ripple ripples
  // too, by less than a hundredth of it.
  const double both = (40 + 0.03 * 2000) * wave;
  EXPECT_NEAR(
      wave_at_speed(machine_with(TorqueRipple{.amplitude = 40, .share = 0.03}, -2000), 4e-3, 2),
      both, 0.01 * both);
  // Order 12 at half the speed is the same frequency.
  EXPECT_NEAR(wave_at_speed(machine_with(TorqueRipple{.amplitude = 40, .order = 12}), 2e-3, 2),
              40 * wave, 0.004 * 40 * wave);
}

TEST(TorqueConstantError, TheReportedForceIsTheTrueOneDivided) {
  for (const double d : {-0.2, 0.15}) {
    const AxisParams p = axis();
    AxisDrive drive(p, only(TorqueConstantError{d}));
    const double a = 0.5;
    AxisCycle cycle;
    for (int k = 1; k <= 1500; ++k) {
      const double t = kCycle * k;
      cycle = drive.follow({a * t * t / 2, a * t});
    }
    const double force = p.mechanics.total_inertia() * a;
    EXPECT_NEAR(cycle.force * p.mechanics.force_limit * (1 + d), force, 1e-6 * force);
    EXPECT_NEAR(cycle.truth.back(), a * 1.5 * 1.5 / 2, kNm);
  }
}

}  // namespace
}  // namespace vcnc::servo_effects_test
