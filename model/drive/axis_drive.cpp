#include "model/drive/axis_drive.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vcnc {
namespace {

constexpr double kObserverRatio = 4;        // observer poles over velocity loop crossover
constexpr double kFastestObserver = 5000;   // [rad/s], half of the loop rate
constexpr double kContactResonance = 400;   // [Hz] of a gap without compliance
constexpr double kLargestPlantAngle = 0.5;  // resonance [rad/s] times plant step
constexpr double kStandingSpeed = 1e-3;     // [m/s or rad/s]

double observer_bandwidth(const ServoParams& servo) {
  return std::min(kObserverRatio * 2 * kPi * servo.velocity_bandwidth, kFastestObserver);
}

}  // namespace

VelocityObserver::VelocityObserver(double bandwidth, double inertia, double position)
    : inverse_inertia_(1 / inertia), position_(position) {
  const double pole = std::exp(-bandwidth * kDriveLoopTime), fade = 1 - pole;
  gain_position_ = 1 - pole * pole * pole;
  gain_velocity_ = 1.5 * fade * fade * (1 + pole) / kDriveLoopTime;
  gain_disturbance_ = fade * fade * fade / (kDriveLoopTime * kDriveLoopTime);
}

void VelocityObserver::step(double force, double position) {
  const double acceleration = force * inverse_inertia_ + disturbance_;
  position_ += kDriveLoopTime * (velocity_ + 0.5 * kDriveLoopTime * acceleration);
  velocity_ += kDriveLoopTime * acceleration;
  const double residual = position - position_;
  position_ += gain_position_ * residual;
  velocity_ += gain_velocity_ * residual;
  disturbance_ += gain_disturbance_ * residual;
}

AxisDrive::AxisDrive(const AxisParams& params, const AxisEffects& effects)
    : params_(params),
      effects_(effects),
      setpoint_{params.limits.start, 0},
      inertia_(params.mechanics.total_inertia()),
      motor_inertia_(params.mechanics.reflected_inertia()),
      kp_(2 * kPi * params.servo.velocity_bandwidth * inertia_),
      lag_share_(params.servo.current_lag > 0 ? -std::expm1(-kPlantTime / params.servo.current_lag)
                                              : 1),
      two_masses_(effects.windup.compliance > 0 || effects.backlash.gap > 0),
      x_load_(params.limits.start),
      x_motor_(params.limits.start),
      friction_(effects.friction),
      observer_(observer_bandwidth(params.servo), inertia_, encoder(params.limits.start)) {
  if (!two_masses_) return;
  const double load = params.mechanics.load;
  if (!(motor_inertia_ > 1e-3 * load))
    throw std::invalid_argument(
        "motor_inertia_kgm2: wind-up and backlash need a motor side of at least a thousandth of "
        "the load");
  const double reduced = load * motor_inertia_ / (load + motor_inertia_);
  double resonance = 2 * kPi * kContactResonance;
  if (effects.windup.compliance > 0)
    resonance = std::sqrt(1 / (effects.windup.compliance * reduced));
  resonance = std::min(resonance, kLargestPlantAngle / kPlantTime);
  stiffness_ = resonance * resonance * reduced;
  damping_ = 2 * effects.windup.damping_ratio * resonance * reduced;
}

double AxisDrive::encoder(double position) const {
  const double quantum = effects_.encoder.quantum;
  return quantum > 0 ? quantum * std::round(position / quantum) : position;
}

AxisCycle AxisDrive::follow(const AxisSetpoint& target) {
  constexpr double kCycleTime = kDriveLoopSteps * kDriveLoopTime;
  // Cubic in s = 0..1 over the cycle: x = a + s (b + s (c + s d)).
  const double b = setpoint_.velocity * kCycleTime, b_end = target.velocity * kCycleTime;
  const double way = target.position - setpoint_.position;
  const double c = 3 * way - 2 * b - b_end, d = b + b_end - 2 * way;
  Course course;
  for (int i = 0; i < kDriveLoopSteps; ++i) {
    const double s = static_cast<double>(i) / kDriveLoopSteps;
    course[static_cast<std::size_t>(i)] = {setpoint_.position + s * (b + s * (c + s * d)),
                                           (b + s * (2 * c + s * 3 * d)) / kCycleTime};
  }
  course.back() = target;
  return run(course);
}

AxisCycle AxisDrive::brake(double deceleration) {
  Course course;
  course[0] = setpoint_;
  for (std::size_t i = 1; i < course.size(); ++i) {
    const AxisSetpoint& from = course[i - 1];
    const double speed = std::abs(from.velocity);
    const double time = std::min(kDriveLoopTime, speed / deceleration);
    const double end = time < kDriveLoopTime ? 0 : speed - deceleration * time;
    course[i] = {from.position + std::copysign(0.5 * (speed + end) * time, from.velocity),
                 std::copysign(end, from.velocity)};
  }
  return run(course);
}

AxisCycle AxisDrive::hold() {
  Course course;
  course.fill({setpoint_.position, 0});
  return run(course);
}

bool AxisDrive::standing() const {
  return std::abs(setpoint_.velocity) < kStandingSpeed &&
         std::abs(observer_.velocity()) < kStandingSpeed;
}

AxisCycle AxisDrive::run(const Course& course) {
  AxisCycle cycle;
  for (std::size_t i = 0; i < kDriveLoopSteps; ++i) {
    force_ref_ = control(course[i], course[i + 1]);
    double mean_force = 0;
    for (int j = 0; j < kPlantStepsPerLoop; ++j) {
      force_ += lag_share_ * (force_ref_ - force_);
      mean_force += force_ / kPlantStepsPerLoop;
      move_plant();
    }
    observer_.step(mean_force, encoder(x_motor_));
    cycle.truth[i] = x_load_;
  }
  setpoint_ = course.back();
  const double motor = encoder(x_motor_), load = encoder(x_load_);
  cycle.measured = params_.servo.feedback == ServoParams::Feedback::motor ? motor : load;
  cycle.second = load - motor;
  cycle.force = force_ / params_.mechanics.force_limit;
  cycle.velocity = observer_.velocity();
  return cycle;
}

double AxisDrive::control(const AxisSetpoint& now, const AxisSetpoint& next) {
  const ServoParams& servo = params_.servo;
  const double measured =
      encoder(servo.feedback == ServoParams::Feedback::motor ? x_motor_ : x_load_);
  const double v_ref =
      servo.kv_per_s * (now.position - measured) + servo.velocity_ff * now.velocity;
  const double error = v_ref - observer_.velocity();
  const double a_c = (next.velocity - now.velocity) / kDriveLoopTime;
  const double force = kp_ * error + integral_ + servo.acceleration_ff * inertia_ * a_c;
  const double limited =
      std::clamp(force, -params_.mechanics.force_limit, params_.mechanics.force_limit);
  if (force == limited) integral_ += kp_ / servo.integral_time * error * kDriveLoopTime;
  return limited;
}

void AxisDrive::move_plant() {
  if (two_masses_) {
    move_two_masses();
    return;
  }
  const double v = v_load_;
  v_load_ = friction_.step(v, v + kPlantTime * force_ / inertia_, kPlantTime, inertia_);
  x_load_ += 0.5 * kPlantTime * (v + v_load_);
  x_motor_ = x_load_;
}

void AxisDrive::move_two_masses() {
  const double twist = x_motor_ - x_load_, half_gap = 0.5 * effects_.backlash.gap;
  double spring = 0;
  if (std::abs(twist) >= half_gap)
    spring =
        stiffness_ * (twist - std::copysign(half_gap, twist)) + damping_ * (v_motor_ - v_load_);
  const double load = params_.mechanics.load;
  v_motor_ += kPlantTime * (force_ - spring) / motor_inertia_;
  v_load_ = friction_.step(v_load_, v_load_ + kPlantTime * spring / load, kPlantTime, load);
  x_motor_ += kPlantTime * v_motor_;
  x_load_ += kPlantTime * v_load_;
}

}  // namespace vcnc
