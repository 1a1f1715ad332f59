#include "model/drive/axis_drive.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace vcnc {
namespace {

constexpr double kObserverRatio = 4;        // observer poles over velocity loop crossover
constexpr double kFastestObserver = 5000;   // [rad/s], half of the loop rate
constexpr double kLargestPlantAngle = 0.5;  // resonance [rad/s] times plant step
constexpr double kStandingSpeed = 1e-3;     // [m/s or rad/s]

double observer_bandwidth(const ServoParams& servo) {
  return std::min(kObserverRatio * 2 * kPi * servo.velocity_bandwidth, kFastestObserver);
}

/// How far what lags behind a signal comes in one loop step: of a ramp it is late by the lag,
/// however short that is.
double share_of(double lag) { return kDriveLoopTime / (kDriveLoopTime + lag); }

/// What follows a signal so; without a lag the signal itself, to the bit.
template <class Real>
Real lagged(const Real& before, const Real& signal, const Real& share) {
  return choose(share < Real(1), before + share * (signal - before), signal);
}

}  // namespace

template <class Real>
VelocityObserverOf<Real>::VelocityObserverOf(double bandwidth, double inertia, double position)
    : inverse_inertia_(1 / inertia), position_(position) {
  const double pole = std::exp(-bandwidth * kDriveLoopTime), fade = 1 - pole;
  gain_position_ = 1 - pole * pole * pole;
  gain_velocity_ = 1.5 * fade * fade * (1 + pole) / kDriveLoopTime;
  gain_disturbance_ = fade * fade * fade / (kDriveLoopTime * kDriveLoopTime);
}

template <class Real>
void VelocityObserverOf<Real>::step(Real force, Real position) {
  const Real acceleration = force * inverse_inertia_ + disturbance_;
  position_ += kDriveLoopTime * (velocity_ + 0.5 * kDriveLoopTime * acceleration);
  velocity_ += kDriveLoopTime * acceleration;
  const Real residual = position - position_;
  position_ += gain_position_ * residual;
  velocity_ += gain_velocity_ * residual;
  disturbance_ += gain_disturbance_ * residual;
}

namespace {

Effects on_x(const AxisEffects& effects) {
  Effects all;
  all.axis[kX] = effects;
  return all;
}

}  // namespace

template <class Real>
AxisDriveOf<Real>::AxisDriveOf(const Machine& machine, std::size_t axis, std::uint64_t seed)
    : AxisDriveOf(machine.axes[axis], vcnc::actual(machine).axes[axis], machine.effects, axis,
                  seed) {}

template <class Real>
AxisDriveOf<Real>::AxisDriveOf(const AxisParams& params, const AxisEffects& effects)
    : AxisDriveOf(params, params, on_x(effects), kX, 1) {}

template <class Real>
AxisDriveOf<Real>::AxisDriveOf(const AxisParams& declared, const AxisParams& actual,
                               const Effects& effects, std::size_t axis, std::uint64_t seed)
    : axis_(axis),
      feedback_(actual.servo.feedback),
      travel_per_turn_(declared.mechanics.travel_per_turn),
      force_limit_(declared.mechanics.force_limit),
      setpoint_{actual.limits.start, 0.0},
      inertia_(declared.mechanics.total_inertia()),
      motor_inertia_(actual.mechanics.reflected_inertia()),
      load_inertia_(actual.mechanics.load),
      plant_mobility_(kPlantTime / actual.mechanics.total_inertia()),
      motor_mobility_(kPlantTime / motor_inertia_),
      load_mobility_(kPlantTime / load_inertia_),
      laws_(!effects.laws.empty()),
      start_(actual.limits.start),
      x_load_(actual.limits.start),
      x_motor_(actual.limits.start),
      position_told_(actual.limits.start),
      last_raw_(setpoint_),
      last_shaped_(setpoint_) {
  for (std::size_t i = 0; i < kLanesOf<Real>; ++i) {
    reception_.set(i, axis_chain<ReceptionPort>(effects, axis, seed));
    shaping_.set(i, axis_chain<SetpointPort>(effects, axis, seed));
    counting_.set(i, axis_chain<EncoderPort>(effects, axis, seed));
    motor_.set(i, axis_chain<MotorForcePort>(effects, axis, seed));
    load_.set(i, axis_chain<LoadForcePort>(effects, axis, seed));
    rubbing_.set(i, axis_chain<FrictionPort>(effects, axis, seed));
    displacing_.set(i, axis_chain<DisplacementPort>(effects, axis, seed));
  }
  sum_up_constant_friction();
  TransmissionPort::Signal<double> transmission{.damping_ratio = 0.05};
  axis_chain<TransmissionPort>(effects, axis, seed).step(transmission, {});
  couple(transmission, actual.mechanics.load);
  const double start = lane(encoder(ServoParams::Feedback::motor), 0);
  const double inertia = declared.mechanics.total_inertia();
  observer_ = {observer_bandwidth(declared.servo), inertia, start};
  ServoPort::Signal<double> servo{.kv = actual.servo.kv_per_s,
                                  .velocity_gain = 1,
                                  .integral_time = actual.servo.integral_time,
                                  .velocity_ff = actual.servo.velocity_ff,
                                  .acceleration_ff = actual.servo.acceleration_ff,
                                  .current_lag = actual.servo.current_lag,
                                  .force_limit = actual.mechanics.force_limit};
  axis_chain<ServoPort>(effects, axis, seed).step(servo, {});
  servo_ = {servo.kv,          servo.velocity_gain,   servo.integral_time,
            servo.velocity_ff, servo.acceleration_ff, servo.current_lag,
            servo.force_limit};
  const double crossover = 2 * kPi * actual.servo.velocity_bandwidth;
  double kp = actual.servo.velocity_gain > 0 ? actual.servo.velocity_gain : crossover * inertia;
  kp *= servo.velocity_gain;
  kp_ = kp;
  if (actual.servo.controller == ServoParams::Controller::sampled)
    sampled_.emplace_back(kp, inertia, actual.servo.dead_time, lane(encoder(feedback_), 0));
  lag_share_ = servo.current_lag > 0 ? -std::expm1(-kPlantTime / servo.current_lag) : 1;
  position_share_ = share_of(actual.servo.position_lag);
  setpoint_share_ = share_of(actual.servo.setpoint_lag);
  velocity_share_ = share_of(actual.servo.velocity_lag);
  feedforward_share_ = share_of(actual.servo.feedforward_lag);
}

template <class Real>
AxisDriveOf<Real>::AxisDriveOf(std::vector<AxisDriveOf<double>> drives)
    : axis_(drives[0].axis_),
      feedback_(drives[0].feedback_),
      travel_per_turn_(drives[0].travel_per_turn_),
      force_limit_(drives[0].force_limit_),
      two_masses_(drives[0].two_masses_),
      uneven_(std::any_of(drives.begin(), drives.end(), [](const auto& d) { return d.uneven_; })),
      motor_rubs_(
          std::any_of(drives.begin(), drives.end(), [](const auto& d) { return d.motor_rubs_; })),
      laws_(drives[0].laws_),
      start_(drives[0].start_) {
  for (std::size_t i = 0; i < kLanesOf<Real>; ++i) {
    AxisDriveOf<double>& drive = drives[std::min(i, drives.size() - 1)];
    const auto from = drive.numbers();
    auto to = numbers();
    [&]<std::size_t... n>(std::index_sequence<n...>) {
      (set_lane(std::get<n>(to), i, std::get<n>(from)), ...);
    }
    (std::make_index_sequence<std::tuple_size_v<decltype(to)>>());
    sampled_.insert(sampled_.end(), drive.sampled_.begin(), drive.sampled_.end());
    if (i >= drives.size()) continue;
    reception_.set(i, std::move(drive.reception_.chain(0)));
    shaping_.set(i, std::move(drive.shaping_.chain(0)));
    counting_.set(i, std::move(drive.counting_.chain(0)));
    motor_.set(i, std::move(drive.motor_.chain(0)));
    load_.set(i, std::move(drive.load_.chain(0)));
    rubbing_.set(i, std::move(drive.rubbing_.chain(0)));
    displacing_.set(i, std::move(drive.displacing_.chain(0)));
  }
  sum_up_constant_friction();
}

template <class Real>
bool AxisDriveOf<Real>::suits(const AxisDriveOf& other) const {
  return axis_ == other.axis_ && feedback_ == other.feedback_ &&
         travel_per_turn_ == other.travel_per_turn_ && force_limit_ == other.force_limit_ &&
         start_ == other.start_ && two_masses_ == other.two_masses_ && laws_ == other.laws_ &&
         sampled_.empty() == other.sampled_.empty();
}

template <class Real>
void AxisDriveOf<Real>::couple(const TransmissionPort::Signal<double>& transmission, double load) {
  if (transmission.wave != 0) {
    uneven_ = true;
    wave_ = transmission.wave;
    wave_number_ = 2 * kPi / transmission.wave_period;
    wave_phase_ = transmission.wave_phase;
  }
  if (transmission.lead != 0) {
    uneven_ = true;
    lead_ = transmission.lead;
  }
  motor_rubs_ = transmission.motor_dry > 0 || transmission.motor_viscous > 0;
  motor_dry_ = transmission.motor_dry;
  motor_viscous_ = transmission.motor_viscous;
  motor_stiffness_ = transmission.motor_stiffness;
  if (!(transmission.compliance > 0 || transmission.gap > 0)) return;
  two_masses_ = true;
  half_gap_ = 0.5 * transmission.gap;
  const double motor = lane(motor_inertia_, 0);
  if (!(motor > 1e-3 * load))
    throw std::invalid_argument(
        "motor_inertia_kgm2: wind-up and backlash need a motor side of at least a thousandth of "
        "the load");
  const double reduced = load * motor / (load + motor);
  double resonance = kLargestPlantAngle / kPlantTime;
  if (transmission.compliance > 0)
    resonance = std::min(resonance, std::sqrt(1 / (transmission.compliance * reduced)));
  stiffness_ = resonance * resonance * reduced;
  damping_ = 2 * transmission.damping_ratio * resonance * reduced;
}

template <class Real>
Real AxisDriveOf<Real>::unevenness() const {
  if (!uneven_) return Real{};
  Real ahead = lead_ * (x_motor_ - Real(start_));
  for (std::size_t i = 0; i < kLanesOf<Real>; ++i)
    if (const double wave = lane(wave_, i); wave != 0)
      set_lane(ahead, i,
               lane(ahead, i) + wave * std::sin(lane(wave_number_, i) * lane(x_motor_, i) +
                                                lane(wave_phase_, i)));
  return ahead;
}

/// x_motor_ is where the motor would be with an even transmission; it is at x_motor_ - u(x_motor_),
/// so that  m_r x_motor'' = F - F_s + m_r u'',  u = A sin(k x + psi),  u'' = u' a - k^2 u v^2. The
/// acceleration is that of the loop step before; |u'| << 1.
template <class Real>
Real AxisDriveOf<Real>::force_of_unevenness() const {
  Real change{};
  for (std::size_t i = 0; i < kLanesOf<Real>; ++i) {
    const double wave = lane(wave_, i), k = lane(wave_number_, i), v = lane(v_motor_, i);
    if (wave == 0) continue;
    const double angle = k * lane(x_motor_, i) + lane(wave_phase_, i);
    set_lane(change, i,
             wave * k * (std::cos(angle) * lane(a_load_, i) - k * std::sin(angle) * v * v));
  }
  return motor_inertia_ * change;
}

template <class Real>
Real AxisDriveOf<Real>::encoder(ServoParams::Feedback side) {
  const bool of_load = side == ServoParams::Feedback::load;
  Real position = of_load ? x_load_ : x_motor_ - unevenness();
  if (encoder_shift_ != 0) position += encoder_shift_;
  counting_.each_active([&](Chain<EncoderPort>& chain, std::size_t i) {
    EncoderPort::Signal<double> signal{lane(position, i)};
    chain.step(signal, {of_load, lane(v_load_, i), lane(a_load_, i)});
    set_lane(position, i, signal.position);
  });
  return position;
}

template <class Real>
void AxisDriveOf<Real>::tell_commands(const AxisVector& position, const AxisVector& velocity) {
  if (!laws_) return;
  before_position_ = told_ ? told_position_ : position;
  before_velocity_ = told_ ? told_velocity_ : velocity;
  told_ = true;
  told_position_ = position;
  told_velocity_ = velocity;
}

/// The moment of a step within the current loop step.
template <class Real>
Moment AxisDriveOf<Real>::moment(double dt, int steps_per_loop, int step) const {
  const std::int64_t count = (cycle_ * kDriveLoopSteps + loop_) * steps_per_loop + step;
  return {static_cast<double>(count) * dt, dt, count};
}

/// Motions of all axes at the begin of the current loop step, or at its end.
template <class Real>
void AxisDriveOf<Real>::update_motions(int steps_ahead) {
  const double share = static_cast<double>(loop_ + steps_ahead) / kDriveLoopSteps;
  constexpr double kCycleTime = kDriveLoopSteps * kDriveLoopTime;
  for (std::size_t n = 0; n < motions_.size(); ++n) {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const double velocity_change = told_velocity_[i] - before_velocity_[i];
      motions_[n][i] = {before_position_[i] + share * (told_position_[i] - before_position_[i]),
                        before_velocity_[i] + share * velocity_change,
                        velocity_change / kCycleTime};
    }
    motions_[n][axis_] = {lane(x_load_, n), lane(v_load_, n), lane(a_load_, n)};
  }
}

template <class Real>
AxisCycleOf<Real> AxisDriveOf<Real>::follow(const Setpoint& sent) {
  constexpr double kCycleTime = kDriveLoopSteps * kDriveLoopTime;
  Setpoint target = sent;
  reception_.each_active([&](Chain<ReceptionPort>& chain, std::size_t i) {
    ReceptionPort::Signal<double> signal{lane(sent.position, i), lane(sent.velocity, i)};
    chain.step(signal, {{static_cast<double>(cycle_) * kCycleTime, kCycleTime, cycle_}});
    set_lane(target.position, i, signal.position);
    set_lane(target.velocity, i, signal.velocity);
  });
  // Cubic in s = 0..1 over the cycle: x = a + s (b + s (c + s d)).
  const Real b = setpoint_.velocity * kCycleTime, b_end = target.velocity * kCycleTime;
  const Real way = target.position - setpoint_.position;
  const Real c = 3.0 * way - 2.0 * b - b_end, d = b + b_end - 2.0 * way;
  Course course;
  for (int i = 0; i < kDriveLoopSteps; ++i) {
    const double s = static_cast<double>(i) / kDriveLoopSteps;
    course[static_cast<std::size_t>(i)] = {setpoint_.position + s * (b + s * (c + s * d)),
                                           (b + s * (2.0 * c + s * 3 * d)) / kCycleTime};
  }
  course.back() = target;
  return run(course);
}

template <class Real>
AxisCycleOf<Real> AxisDriveOf<Real>::brake(double deceleration) {
  using std::abs, std::copysign, std::min;
  Course course;
  course[0] = setpoint_;
  for (std::size_t i = 1; i < course.size(); ++i) {
    const Setpoint& from = course[i - 1];
    const Real speed = abs(from.velocity);
    const Real time = min(Real(kDriveLoopTime), speed / deceleration);
    const Real end = choose(time < Real(kDriveLoopTime), Real(0), speed - deceleration * time);
    course[i] = {from.position + copysign(0.5 * (speed + end) * time, from.velocity),
                 copysign(end, from.velocity)};
  }
  return run(course);
}

template <class Real>
AxisCycleOf<Real> AxisDriveOf<Real>::hold() {
  Course course;
  course.fill({setpoint_.position, Real(0)});
  return run(course);
}

template <class Real>
void AxisDriveOf<Real>::follow_up() {
  using std::abs;
  const Real measured = encoder(feedback_);
  const Real told = setpoint_.velocity, seen = observer_.velocity();
  setpoint_ = last_raw_ = last_shaped_ = {measured, choose(abs(seen) < abs(told), seen, told)};
  position_told_ = measured;
  position_error_ = acceleration_told_ = 0.0;
  velocity_told_ = setpoint_.velocity;
}

template <class Real>
bool AxisDriveOf<Real>::standing() const {
  using std::abs;
  return all(abs(setpoint_.velocity) < Real(kStandingSpeed)) &&
         all(abs(observer_.velocity()) < Real(kStandingSpeed));
}

/// Makes of a set-point the one that is used, for the beginning (step 0) or the end (step 1) of the
/// current loop step.
template <class Real>
void AxisDriveOf<Real>::shape(Setpoint& setpoint, Real acceleration, int step) {
  shaping_.each_active([&](Chain<SetpointPort>& chain, std::size_t i) {
    SetpointPort::Signal<double> signal{lane(setpoint.position, i), lane(setpoint.velocity, i)};
    if (step == 0) {
      constexpr double kRounding = 1e-12;  // v T / T is not always v
      const bool goes_on = cycle_ > 0 && signal.position == lane(last_raw_.position, i) &&
                           std::abs(signal.velocity - lane(last_raw_.velocity, i)) < kRounding;
      if (goes_on) {
        set_lane(setpoint.position, i, lane(last_shaped_.position, i));
        set_lane(setpoint.velocity, i, lane(last_shaped_.velocity, i));
        return;
      }
    }
    chain.step(signal, {moment(kDriveLoopTime, 1, step), lane(acceleration, i), motions(i)});
    set_lane(setpoint.position, i, signal.position);
    set_lane(setpoint.velocity, i, signal.velocity);
  });
}

template <class Real>
AxisCycleOf<Real> AxisDriveOf<Real>::run(const Course& course) {
  Cycle cycle;
  const bool shaped = shaping_.some_active();
  Setpoint now = course[0];
  loop_ = 0;
  if (shaped) shape(now, 0.0, 0);
  for (std::size_t i = 0; i < kDriveLoopSteps; ++i) {
    loop_ = static_cast<int>(i);
    if (laws_) update_motions(0);
    Setpoint next = course[i + 1];
    if (shaped) shape(next, (next.velocity - course[i].velocity) / kDriveLoopTime, 1);
    if (sampled_.empty()) force_ref_ = control(now, next);
    const Real velocity_before = v_load_;
    Real mean_force{};
    for (plant_step_ = 0; plant_step_ < kPlantStepsPerLoop; ++plant_step_) {
      if (!sampled_.empty())  // what its force is on average over the plant step
        force_ref_ = of_sampled([&](const SampledController& c) {
          return c.force(loop_ * kDriveLoopTime + plant_step_ * kPlantTime, kPlantTime);
        });
      force_ += lag_share_ * (force_ref_ - force_);
      mean_force += force_ / kPlantStepsPerLoop;
      move_plant();
    }
    observer_.step(mean_force, encoder(ServoParams::Feedback::motor));
    cycle.truth[i] = displaced(velocity_before);
    now = next;
  }
  setpoint_ = last_raw_ = course.back();
  last_shaped_ = now;
  ++cycle_;
  const Real motor = encoder(ServoParams::Feedback::motor),
             load = encoder(ServoParams::Feedback::load);
  cycle.measured = feedback_ == ServoParams::Feedback::motor ? motor : load;
  cycle.second = load - motor;
  cycle.force = force_ / force_limit_;
  if (!sampled_.empty()) {
    sample(now, cycle.measured);
    cycle.force = of_sampled([](const SampledController& c) { return c.demand(); }) / force_limit_;
  }
  cycle.velocity = observer_.velocity();
  return cycle;
}

template <class Real>
Real AxisDriveOf<Real>::control(const Setpoint& now, const Setpoint& next) {
  using std::max, std::min;
  const Real measured = encoder(feedback_);
  position_told_ = lagged(position_told_, now.position, setpoint_share_);
  position_error_ = lagged(position_error_, position_told_ - measured, position_share_);
  velocity_told_ = lagged(velocity_told_, now.velocity, feedforward_share_);
  const Real v_ref = servo_.kv * position_error_ + servo_.velocity_ff * velocity_told_;
  velocity_ = lagged(velocity_, observer_.velocity(), velocity_share_);
  const Real error = v_ref - velocity_;
  const Real a_c = (next.velocity - now.velocity) / kDriveLoopTime;
  acceleration_told_ = lagged(acceleration_told_, a_c, feedforward_share_);
  Real force = kp_ * error + integral_ + servo_.acceleration_ff * inertia_ * acceleration_told_;
  if (force_known_) force += known(&KnownForce::added, loop_);
  const Real limited = min(max(force, -servo_.force_limit), servo_.force_limit);
  integral_ = choose(force == limited,
                     integral_ + kp_ / servo_.integral_time * error * kDriveLoopTime, integral_);
  return limited;
}

template <class Real>
void AxisDriveOf<Real>::sample(const Setpoint& now, Real measured) {
  for (std::size_t i = 0; i < sampled_.size(); ++i)
    sampled_[i].sample({.kv = lane(servo_.kv, i),
                        .velocity_ff = lane(servo_.velocity_ff, i),
                        .acceleration_ff = lane(servo_.acceleration_ff, i),
                        .force_limit = lane(servo_.force_limit, i)},
                       lane(now.position, i), lane(now.velocity, i), lane(measured, i),
                       force_told_.added);
}

/// At a time within the current cycle [loop steps].
template <class Real>
double AxisDriveOf<Real>::known(double KnownForce::*force, double loop) const {
  return std::lerp(force_before_.*force, force_told_.*force, loop / kDriveLoopSteps);
}

/// On the load, in the middle of a plant step.
template <class Real>
Real AxisDriveOf<Real>::told_load_force() const {
  const double loop = loop_ + (plant_step_ + 0.5) / kPlantStepsPerLoop;
  Real force = load_told_before_ + loop / kDriveLoopSteps * (load_told_ - load_told_before_);
  if (force_known_) force += known(&KnownForce::applied, loop);
  return force;
}

template <class Real>
void AxisDriveOf<Real>::move_plant() {
  Real force = force_;
  motor_.each_active([&](Chain<MotorForcePort>& chain, std::size_t i) {
    MotorForcePort::Signal<double> signal{lane(force, i)};
    chain.step(signal, {.moment = moment(kPlantTime, kPlantStepsPerLoop, plant_step_),
                        .position = lane(x_motor_, i),
                        .velocity = lane(v_motor_, i),
                        .travel_per_turn = travel_per_turn_,
                        .force_limit = force_limit_,
                        .axes = motions(i)});
    set_lane(force, i, signal.force);
  });
  if (uneven_) force += force_of_unevenness();
  const bool told = force_known_ || load_told_of_;
  if (told) load_force_ = told_load_force();
  load_.each_active([&](Chain<LoadForcePort>& chain, std::size_t i) {
    LoadForcePort::Signal<double> signal{told ? lane(load_force_, i) : 0};
    chain.step(signal, {moment(kPlantTime, kPlantStepsPerLoop, plant_step_), lane(x_load_, i),
                        lane(v_load_, i), motions(i)});
    set_lane(load_force_, i, signal.force);
  });
  if (two_masses_)
    move_two_masses(force, load_force_);
  else
    move_rigid(force, load_force_);
}

namespace {

template <class Real>
FrictionPort::Signal<Real> as_one(const PerLane<Real, FrictionTerms>& each) {
  return {packed(each, &FrictionTerms::dry), packed(each, &FrictionTerms::skew),
          packed(each, &FrictionTerms::viscous), packed(each, &FrictionTerms::stiffness),
          packed(each, &FrictionTerms::damping)};
}

}  // namespace

template <class Real>
void AxisDriveOf<Real>::sum_up_constant_friction() {
  for (std::size_t i = 0; i < kLanesOf<Real>; ++i)
    constant_of_each_[i] = rubbing_.chain(i).constant();
  constant_ = as_one<Real>(constant_of_each_);
}

template <class Real>
FrictionPort::Signal<Real> AxisDriveOf<Real>::friction_terms(Real v, Real v_free) {
  if (!rubbing_.some_vary()) return constant_;
  PerLane<Real, FrictionTerms> each = constant_of_each_;
  FrictionPort::Context<double> context{.moment =
                                            moment(kPlantTime, kPlantStepsPerLoop, plant_step_)};
  rubbing_.each_active([&](Chain<FrictionPort>& chain, std::size_t i) {
    context.position = lane(x_load_, i);
    context.velocity = lane(v, i);
    context.free_velocity = lane(v_free, i);
    chain.vary(each[i], context);
  });
  return as_one<Real>(each);
}

/// Velocity after friction has acted for one plant step.
template <class Real>
Real AxisDriveOf<Real>::rub(Real v, Real v_free, Real mobility) {
  const bool one_mass = motor_rubs_ && !two_masses_;
  if (!rubbing_.some_active() && !one_mass) return v_free;
  FrictionPort::Signal<Real> terms = friction_terms(v, v_free);
  if (one_mass) terms.dry += motor_dry_, terms.viscous += motor_viscous_;
  return friction_.step(terms, v, v_free, kPlantTime, mobility);
}

template <class Real>
Real AxisDriveOf<Real>::rub_motor(Real v_free) {
  if (!motor_rubs_) return v_free;
  FrictionPort::Signal<Real> terms;
  terms.dry = motor_dry_;
  terms.viscous = motor_viscous_;
  terms.stiffness = motor_stiffness_;
  return motor_friction_.step(terms, v_motor_, v_free, kPlantTime, motor_mobility_);
}

template <class Real>
void AxisDriveOf<Real>::move_rigid(Real force, Real load_force) {
  const Real v = v_load_;
  v_load_ = rub(v, v + plant_mobility_ * (force + load_force), plant_mobility_);
  x_load_ += 0.5 * kPlantTime * (v + v_load_);
  x_motor_ = x_load_;
  v_motor_ = v_load_;
}

template <class Real>
void AxisDriveOf<Real>::move_two_masses(Real force, Real load_force) {
  using std::abs, std::copysign;
  const Real twist = x_motor_ - x_load_;
  Real spring{};
  if (const auto taut = abs(twist) >= half_gap_; any(taut))
    spring = choose(
        taut, stiffness_ * (twist - copysign(half_gap_, twist)) + damping_ * (v_motor_ - v_load_),
        Real(0));
  v_motor_ = rub_motor(v_motor_ + motor_mobility_ * (force - spring));
  v_load_ = rub(v_load_, v_load_ + load_mobility_ * (spring + load_force), load_mobility_);
  x_motor_ += kPlantTime * v_motor_;
  x_load_ += kPlantTime * v_load_;
}

/// Where the tool centre is along the axis at the end of a loop step.
template <class Real>
Real AxisDriveOf<Real>::displaced(Real velocity_before) {
  a_load_ = (v_load_ - velocity_before) / kDriveLoopTime;
  if constexpr (kLanesOf<Real> == 1) {
    if (watched_)
      (*watched_)[static_cast<std::size_t>(loop_)] = {
          {x_load_, v_load_, a_load_}, load_inertia_ * a_load_ + friction_.force() - load_force_};
  }
  if (!displacing_.some_active()) return x_load_;
  if (laws_) update_motions(1);
  Real truth = x_load_;
  const Real force = load_inertia_ * a_load_ + friction_.force() - load_force_;
  displacing_.each_active([&](Chain<DisplacementPort>& chain, std::size_t i) {
    if (loop_ < first_truth_ && !displacing_.remembers(i)) return;
    DisplacementPort::Signal<double> signal;
    chain.step(signal, {.moment = moment(kDriveLoopTime, 1, 1),
                        .load = {lane(x_load_, i), lane(v_load_, i), lane(a_load_, i)},
                        .force = lane(force, i),
                        .axes = motions(i)});
    set_lane(truth, i, lane(x_load_, i) + signal.displacement);
  });
  return truth;
}

template class VelocityObserverOf<double>;
template class VelocityObserverOf<Lanes>;
template class AxisDriveOf<double>;
template class AxisDriveOf<Lanes>;

}  // namespace vcnc
