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

AxisDrive::AxisDrive(const Machine& machine, std::size_t axis, std::uint64_t seed)
    : AxisDrive(machine.axes[axis], vcnc::actual(machine).axes[axis], machine.effects, axis, seed) {
}

namespace {
Effects on_x(const AxisEffects& effects) {
  Effects all;
  all.axis[kX] = effects;
  return all;
}
}  // namespace

AxisDrive::AxisDrive(const AxisParams& params, const AxisEffects& effects)
    : AxisDrive(params, params, on_x(effects), kX, 1) {}

AxisDrive::AxisDrive(const AxisParams& declared, const AxisParams& actual, const Effects& effects,
                     std::size_t axis, std::uint64_t seed)
    : axis_(axis),
      feedback_(actual.servo.feedback),
      declared_(declared.mechanics),
      actual_(actual.mechanics),
      setpoint_{actual.limits.start, 0},
      inertia_(declared.mechanics.total_inertia()),
      plant_inertia_(actual.mechanics.total_inertia()),
      motor_inertia_(actual.mechanics.reflected_inertia()),
      servo_{.kv = actual.servo.kv_per_s,
             .velocity_gain = 1,
             .integral_time = actual.servo.integral_time,
             .velocity_ff = actual.servo.velocity_ff,
             .acceleration_ff = actual.servo.acceleration_ff,
             .current_lag = actual.servo.current_lag,
             .force_limit = actual.mechanics.force_limit},
      reception_(axis_chain<ReceptionPort>(effects, axis, seed)),
      shaping_(axis_chain<SetpointPort>(effects, axis, seed)),
      counting_(axis_chain<EncoderPort>(effects, axis, seed)),
      motor_(axis_chain<MotorForcePort>(effects, axis, seed)),
      load_(axis_chain<LoadForcePort>(effects, axis, seed)),
      rubbing_(axis_chain<FrictionPort>(effects, axis, seed)),
      displacing_(axis_chain<DisplacementPort>(effects, axis, seed)),
      laws_(!effects.laws.empty()),
      x_load_(actual.limits.start),
      x_motor_(actual.limits.start),
      last_raw_(setpoint_),
      last_shaped_(setpoint_),
      observer_(observer_bandwidth(declared.servo), inertia_, encoder(actual.limits.start)) {
  axis_chain<ServoPort>(effects, axis, seed).step(servo_, {});
  const double crossover = 2 * kPi * actual.servo.velocity_bandwidth;
  kp_ = actual.servo.velocity_gain > 0 ? actual.servo.velocity_gain : crossover * inertia_;
  kp_ *= servo_.velocity_gain;
  if (actual.servo.controller == ServoParams::Controller::sampled)
    sampled_.emplace(kp_, inertia_, actual.servo.dead_time, encoder(actual.limits.start));
  lag_share_ = servo_.current_lag > 0 ? -std::expm1(-kPlantTime / servo_.current_lag) : 1;
  TransmissionPort::Signal<double> transmission{.damping_ratio = 0.05};
  axis_chain<TransmissionPort>(effects, axis, seed).step(transmission, {});
  couple(transmission);
}

void AxisDrive::couple(const TransmissionPort::Signal<double>& transmission) {
  if (!(transmission.compliance > 0 || transmission.gap > 0)) return;
  two_masses_ = true;
  half_gap_ = 0.5 * transmission.gap;
  const double load = actual_.load;
  if (!(motor_inertia_ > 1e-3 * load))
    throw std::invalid_argument(
        "motor_inertia_kgm2: wind-up and backlash need a motor side of at least a thousandth of "
        "the load");
  const double reduced = load * motor_inertia_ / (load + motor_inertia_);
  double resonance = 2 * kPi * kContactResonance;
  if (transmission.compliance > 0) resonance = std::sqrt(1 / (transmission.compliance * reduced));
  resonance = std::min(resonance, kLargestPlantAngle / kPlantTime);
  stiffness_ = resonance * resonance * reduced;
  damping_ = 2 * transmission.damping_ratio * resonance * reduced;
}

double AxisDrive::encoder(double position) {
  if (encoder_shift_ != 0) position += encoder_shift_;
  if (counting_.empty()) return position;
  EncoderPort::Signal<double> signal{position};
  counting_.step(signal, {});
  return signal.position;
}

void AxisDrive::tell_commands(const AxisVector& position, const AxisVector& velocity) {
  if (!laws_) return;
  before_position_ = told_ ? told_position_ : position;
  before_velocity_ = told_ ? told_velocity_ : velocity;
  told_ = true;
  told_position_ = position;
  told_velocity_ = velocity;
}

/// The moment of a step within the current loop step.
Moment AxisDrive::moment(double dt, int steps_per_loop, int step) const {
  const std::int64_t count = (cycle_ * kDriveLoopSteps + loop_) * steps_per_loop + step;
  return {static_cast<double>(count) * dt, dt, count};
}

/// Motions of all axes at the begin of the current loop step, or at its end.
void AxisDrive::update_motions(int steps_ahead) {
  const double share = static_cast<double>(loop_ + steps_ahead) / kDriveLoopSteps;
  constexpr double kCycleTime = kDriveLoopSteps * kDriveLoopTime;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double velocity_change = told_velocity_[i] - before_velocity_[i];
    motions_[i] = {before_position_[i] + share * (told_position_[i] - before_position_[i]),
                   before_velocity_[i] + share * velocity_change, velocity_change / kCycleTime};
  }
  motions_[axis_] = {x_load_, v_load_, a_load_};
}

AxisCycle AxisDrive::follow(const AxisSetpoint& sent) {
  constexpr double kCycleTime = kDriveLoopSteps * kDriveLoopTime;
  AxisSetpoint target = sent;
  if (!reception_.empty()) {
    ReceptionPort::Signal<double> signal{sent.position, sent.velocity};
    reception_.step(signal, {{static_cast<double>(cycle_) * kCycleTime, kCycleTime, cycle_}});
    target = {signal.position, signal.velocity};
  }
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

void AxisDrive::follow_up() {
  const double measured = encoder(feedback_ == ServoParams::Feedback::motor ? x_motor_ : x_load_);
  const double told = setpoint_.velocity, seen = observer_.velocity();
  setpoint_ = last_raw_ = last_shaped_ = {measured, std::abs(seen) < std::abs(told) ? seen : told};
}

bool AxisDrive::standing() const {
  return std::abs(setpoint_.velocity) < kStandingSpeed &&
         std::abs(observer_.velocity()) < kStandingSpeed;
}

/// The set-point for the beginning (step 0) or the end (step 1) of the current loop step.
AxisSetpoint AxisDrive::shaped(const AxisSetpoint& setpoint, double acceleration, int step) {
  SetpointPort::Signal<double> signal{setpoint.position, setpoint.velocity};
  shaping_.step(signal,
                {moment(kDriveLoopTime, 1, step), acceleration, laws_ ? &motions_ : nullptr});
  return {signal.position, signal.velocity};
}

AxisCycle AxisDrive::run(const Course& course) {
  AxisCycle cycle;
  const bool shape = !shaping_.empty();
  AxisSetpoint now = course[0];
  loop_ = 0;
  if (shape) {
    constexpr double kRounding = 1e-12;  // v T / T is not always v
    const bool goes_on = cycle_ > 0 && now.position == last_raw_.position &&
                         std::abs(now.velocity - last_raw_.velocity) < kRounding;
    now = goes_on ? last_shaped_ : shaped(now, 0, 0);
  }
  for (std::size_t i = 0; i < kDriveLoopSteps; ++i) {
    loop_ = static_cast<int>(i);
    if (laws_) update_motions(0);
    AxisSetpoint next = course[i + 1];
    if (shape) next = shaped(next, (next.velocity - course[i].velocity) / kDriveLoopTime, 1);
    if (!sampled_) force_ref_ = control(now, next);
    const double velocity_before = v_load_;
    double mean_force = 0;
    for (plant_step_ = 0; plant_step_ < kPlantStepsPerLoop; ++plant_step_) {
      if (sampled_) force_ref_ = force_demanded();
      force_ += lag_share_ * (force_ref_ - force_);
      mean_force += force_ / kPlantStepsPerLoop;
      move_plant();
    }
    observer_.step(mean_force, encoder(x_motor_));
    cycle.truth[i] = displaced(velocity_before);
    now = next;
  }
  setpoint_ = last_raw_ = course.back();
  last_shaped_ = now;
  ++cycle_;
  const double motor = encoder(x_motor_), load = encoder(x_load_);
  cycle.measured = feedback_ == ServoParams::Feedback::motor ? motor : load;
  cycle.second = load - motor;
  if (sampled_) sampled_->sample(servo_, now.position, now.velocity, cycle.measured);
  cycle.force = (sampled_ ? sampled_->demand() : force_) / declared_.force_limit;
  cycle.velocity = observer_.velocity();
  return cycle;
}

double AxisDrive::control(const AxisSetpoint& now, const AxisSetpoint& next) {
  const double measured = encoder(feedback_ == ServoParams::Feedback::motor ? x_motor_ : x_load_);
  const double v_ref = servo_.kv * (now.position - measured) + servo_.velocity_ff * now.velocity;
  const double error = v_ref - observer_.velocity();
  const double a_c = (next.velocity - now.velocity) / kDriveLoopTime;
  const double force = kp_ * error + integral_ + servo_.acceleration_ff * inertia_ * a_c;
  const double limited = std::clamp(force, -servo_.force_limit, servo_.force_limit);
  if (force == limited) integral_ += kp_ / servo_.integral_time * error * kDriveLoopTime;
  return limited;
}

/// What the sampled controller's force is on average over the current plant step.
double AxisDrive::force_demanded() const {
  return sampled_->force(loop_ * kDriveLoopTime + plant_step_ * kPlantTime, kPlantTime);
}

void AxisDrive::move_plant() {
  double force = force_;
  if (!motor_.empty()) {
    MotorForcePort::Signal<double> signal{force};
    motor_.step(signal, {.moment = moment(kPlantTime, kPlantStepsPerLoop, plant_step_),
                         .position = x_motor_,
                         .velocity = v_motor_,
                         .travel_per_turn = declared_.travel_per_turn,
                         .force_limit = declared_.force_limit,
                         .axes = laws_ ? &motions_ : nullptr});
    force = signal.force;
  }
  if (!load_.empty()) {
    LoadForcePort::Signal<double> signal;
    load_.step(signal, {moment(kPlantTime, kPlantStepsPerLoop, plant_step_), x_load_, v_load_,
                        laws_ ? &motions_ : nullptr});
    load_force_ = signal.force;
  }
  if (two_masses_)
    move_two_masses(force, load_force_);
  else
    move_rigid(force, load_force_);
}

/// Velocity after friction has acted for one plant step.
double AxisDrive::rub(double v, double v_free, double inertia) {
  if (rubbing_.empty()) return v_free;
  FrictionTerms terms;
  rubbing_.step(terms, {moment(kPlantTime, kPlantStepsPerLoop, plant_step_), x_load_, v, v_free});
  return friction_.step(terms, v, v_free, kPlantTime, inertia);
}

void AxisDrive::move_rigid(double force, double load_force) {
  const double v = v_load_;
  v_load_ = rub(v, v + kPlantTime * (force + load_force) / plant_inertia_, plant_inertia_);
  x_load_ += 0.5 * kPlantTime * (v + v_load_);
  x_motor_ = x_load_;
  v_motor_ = v_load_;
}

void AxisDrive::move_two_masses(double force, double load_force) {
  const double twist = x_motor_ - x_load_;
  double spring = 0;
  if (std::abs(twist) >= half_gap_)
    spring =
        stiffness_ * (twist - std::copysign(half_gap_, twist)) + damping_ * (v_motor_ - v_load_);
  const double load = actual_.load;
  v_motor_ += kPlantTime * (force - spring) / motor_inertia_;
  v_load_ = rub(v_load_, v_load_ + kPlantTime * (spring + load_force) / load, load);
  x_motor_ += kPlantTime * v_motor_;
  x_load_ += kPlantTime * v_load_;
}

/// Where the tool centre is along the axis at the end of a loop step.
double AxisDrive::displaced(double velocity_before) {
  a_load_ = (v_load_ - velocity_before) / kDriveLoopTime;
  if (displacing_.empty()) return x_load_;
  if (laws_) update_motions(1);
  DisplacementPort::Signal<double> signal;
  displacing_.step(signal, {.moment = moment(kDriveLoopTime, 1, 1),
                            .load = {x_load_, v_load_, a_load_},
                            .force = actual_.load * a_load_ + friction_.force() - load_force_,
                            .axes = laws_ ? &motions_ : nullptr});
  return x_load_ + signal.displacement;
}

}  // namespace vcnc
