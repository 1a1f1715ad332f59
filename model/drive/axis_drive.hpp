// One servo axis: cascaded controller, motor, transmission and load, on the load side in SI units
// (m, N, kg for linear axes; rad, N m, kg m^2 for rotary ones).
//
// Set-point: cubic Hermite interpolation between two bus set-points (position and velocity at both
// ends), so that velocity and acceleration feed-forward are smooth.
//
// Every 100 us (loop step, T), at its instant t:
//   v_ref = Kv e + kvff v_f,   e: x_b - x_m behind a first-order lag tau_x,   x_b: x_c behind tau_b
//   F_ref = Kp (v_ref - v) + (Kp/Ti) int (v_ref - v) dt + kaff J a_f + F_a
//   |F_ref| <= F_max; the integral is held while the force is limited
//   v:    v_m behind a lag tau_v;   v_f, a_f: v_c and a_c behind a lag tau_f
//   Kp    = 2 pi f_v J,  J = load + reflected motor inertia
//   a_c   = (v_c(t + T) - v_c(t)) / T, the acceleration that the coming step needs on average
//   F_a:  what somebody adds to the demand, a straight line over the bus cycle
//   x_m by the measuring system chosen (motor or load); v_m always of the motor side
//
// Velocity v_m: an observer with position, velocity and disturbance (three equal poles at 4 x the
// velocity loop's crossover) is driven by the measured motor position and the drive force. In
// smooth motion it has no lag, because it knows the force, and it keeps the steps of a coarse
// encoder out of the force.
//
// That is the controller "cascade". A "sampled" one closes its loops once per cycle, at its end,
// with a dead time (model/drive/sampled_controller.hpp); the force it reports is the one it
// demands.
//
// Every 50 us (plant step), after a first-order lag tau_i of the force:
//   rigid (compliance 0, gap 0):   J x'' = F - F_f(x')
//   two masses:  m_r x_m'' = F - F_s,   m x'' = F_s - F_f(x')
//                F_s = K g(x_m - x) + D (x_m' - x')
//                g(z) = z -+ b/2 outside the gap b, 0 inside (D off inside)
//   backlash without compliance: the same, the sides of the gap as stiff as K may be
//   friction on the motor's side, F_fm: m_r x_m'' = F - F_s - F_fm; of a rigid axis it is friction
//                of the one mass
//   uneven transmission: the motor is at x_m - u, u = A sin(k x_m + psi) + e (x_m - x_0), which its
//                measuring system counts, and its inertia follows the wave: m_r (x_m - u)'' in
//                place of m_r x_m''; of a rigid axis J x'' - m_r u''
//
// Integration: rigid exactly for a force constant over the step; two masses by the symplectic Euler
// rule, with K limited to a resonance of 1.6 kHz (10 kN then wind the spring up by less than
// 0.3 um on 500 kg). Friction implicitly (model/drive/friction.hpp).
//
// Where the effects of model/effects/ act: set-points as received and as used, gains, force of the
// motor, spring (K, b), further force on the load, friction F_f, the position a measuring system
// counts, and what the tool centre is off the scale (true position = load + displacement). Force on
// the load that is known, a straight line over the bus cycle, comes besides. The controller knows
// the declared masses; the plant has the actual ones.
//
// Several variants of an axis can be stepped side by side (AxisDriveLanes); each comes to the same
// bits as alone.
//
// Valid below about half the loop rate. Not modelled: current ripple, cross-coupling of the plants.
// Source: Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation; Altintas et al., CIRP
// Annals 60/2 (2011) 779; observer gains: the critically damped g-h-k filter of Brookner, Tracking
// and Kalman Filtering Made Easy.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "model/drive/friction.hpp"
#include "model/drive/lanes.hpp"
#include "model/drive/sampled_controller.hpp"
#include "model/effects/chain.hpp"
#include "model/machine.hpp"

namespace vcnc {

inline constexpr int kDriveLoopSteps = 10;        ///< per bus cycle
inline constexpr double kDriveLoopTime = 100e-6;  ///< [s]
inline constexpr int kPlantStepsPerLoop = 2;
inline constexpr double kPlantTime = kDriveLoopTime / kPlantStepsPerLoop;

/// Bus set-point: where the axis shall be at the end of a cycle, and how fast.
template <class Real>
struct AxisSetpointOf {
  Real position{}, velocity{};
};
using AxisSetpoint = AxisSetpointOf<double>;

/// Forces of which an axis is told, at the end of a cycle [N or N m].
struct KnownForce {
  double added = 0;    ///< by the controller to its demand: part of the force it reports
  double applied = 0;  ///< to the load from outside
};

/// What one cycle of the drive brought about.
template <class Real>
struct AxisCycleOf {
  Real measured{};  ///< position by the measuring system at the end of the cycle
  Real second{};    ///< load side minus motor side at the end of the cycle
  Real force{};     ///< drive force at the end (sampled: demanded), share of the limit
  Real velocity{};  ///< measured velocity at the end
  std::array<Real, kDriveLoopSteps> truth{};  ///< true load position at the end of each loop step
};
using AxisCycle = AxisCycleOf<double>;

/// What displaces the tool centre depends on: DisplacementPort at the end of a loop step.
struct LoadMotion {
  Motion<double> load;
  double force = 0;
};

/// Estimates the motor's velocity from its position and the drive force.
template <class Real>
class VelocityObserverOf {
 public:
  VelocityObserverOf() = default;
  VelocityObserverOf(double bandwidth, double inertia, double position);
  /// One loop step: `force` acted during it, `position` was measured at its end.
  void step(Real force, Real position);
  Real velocity() const { return velocity_; }

  /// All numbers, to be gathered in lanes.
  auto numbers() {
    return std::tie(inverse_inertia_, gain_position_, gain_velocity_, gain_disturbance_, position_,
                    velocity_, disturbance_);
  }

 private:
  Real inverse_inertia_{}, gain_position_{}, gain_velocity_{}, gain_disturbance_{};
  Real position_{}, velocity_{}, disturbance_{};
};
using VelocityObserver = VelocityObserverOf<double>;

/// The chain of every lane at a port.
template <class Real, class Port>
class ChainsOf {
 public:
  void set(std::size_t lane, Chain<Port> chain) {
    some_active_ = some_active_ || !chain.empty();
    remembers_[lane] = chain.remembers();
    some_vary_ = some_vary_ || chain.varies();
    chains_[lane] = std::move(chain);
  }
  Chain<Port>& chain(std::size_t lane) { return chains_[lane]; }
  bool some_active() const { return some_active_; }
  /// Whether some do more than to add constants.
  bool some_vary() const { return some_vary_; }
  /// Whether its effects depend on what was before.
  bool remembers(std::size_t lane) const { return remembers_[lane]; }
  /// Calls f(chain, lane) for those that have effects.
  template <class F>
  void each_active(F&& f) {
    if (!some_active_) return;
    for (std::size_t i = 0; i < chains_.size(); ++i)
      if (!chains_[i].empty()) f(chains_[i], i);
  }

 private:
  PerLane<Real, Chain<Port>> chains_;
  PerLane<Real, bool> remembers_{};
  bool some_active_ = false, some_vary_ = false;
};

/// Real: double, or Lanes for several axes at a time.
template <class Real>
class AxisDriveOf {
 public:
  using Setpoint = AxisSetpointOf<Real>;
  using Cycle = AxisCycleOf<Real>;

  /// One axis of a machine with its effects, laws and deviations; `seed` of all noise.
  /// Throws std::invalid_argument naming the key when wind-up or backlash lack a motor inertia.
  AxisDriveOf(const Machine& machine, std::size_t axis, std::uint64_t seed);
  /// A linear axis on its own, as declared.
  explicit AxisDriveOf(const AxisParams& params, const AxisEffects& effects = {});
  /// Drives that have not moved yet and that suit each other, one per lane; where there are fewer,
  /// the further lanes go without effects. At least one.
  explicit AxisDriveOf(std::vector<AxisDriveOf<double>> drives);

  /// Whether two drives of one axis can be stepped side by side.
  bool suits(const AxisDriveOf& other) const;

  /// Leaves out what displaces the tool centre in the first loop steps of every cycle, where that
  /// changes nothing later: their truth is where the load is.
  void skip_early_truth(int steps) { first_truth_ = steps; }

  /// Tells the motion of the load at the end of every loop step of a cycle, from now on (of one
  /// axis alone).
  void watch(std::array<LoadMotion, kDriveLoopSteps>& load) { watched_ = &load; }

  /// Follows the set-point through one bus cycle (closed loop).
  Cycle follow(const Setpoint& target);
  /// Quick stop: brakes with `deceleration` [m/s^2 or rad/s^2] along its own ramp for one cycle.
  Cycle brake(double deceleration);
  /// Holds the last commanded position with the loop closed (also before the first set-point); a
  /// commanded velocity drops to zero at once.
  Cycle hold();

  /// Whether what it does while its set-point stands depends on nothing but its own state and, at
  /// the tool centre, on slow functions of time: then a drive that has come to rest stays so. One
  /// with a gap may begin to hunt.
  bool can_rest() const {
    return !laws_ && sampled_.empty() && !reception_.some_active() && !shaping_.some_active() &&
           all(half_gap_ == Real(0));
  }
  /// A cycle at rest: nothing changes but the time.
  void rest() { ++cycle_; }

  /// Commanded positions and velocities of all axes for the end of the coming cycle: what a law of
  /// this axis may know of the others. Call it before follow().
  void tell_commands(const AxisVector& position, const AxisVector& velocity);

  /// Known forces at the end of the coming cycle; call it before every follow(), or never.
  void tell_force(const KnownForce& force) {
    force_before_ = force_known_ ? force_told_ : force;
    force_told_ = force;
    force_known_ = true;
  }

  /// A further force on the load at the end of the coming cycle, another one for every lane; as
  /// above.
  void tell_load_force(const Real& force) {
    load_told_before_ = load_told_of_ ? load_told_ : force;
    load_told_ = force;
    load_told_of_ = true;
  }

  /// Takes what is measured for the set-point: braking after a following error starts where the
  /// axis is, not where it was told to be.
  void follow_up();
  /// From now on both measuring systems count this much more [m or rad] (0: right): an encoder that
  /// has jumped.
  void shift_encoder(double by) { encoder_shift_ = by; }

  bool standing() const;  ///< commanded and measured velocity are (nearly) zero
  Real position() const { return setpoint_.position; }

 private:
  template <class Other>
  friend class AxisDriveOf;
  /// Set-points at the loop instants of a cycle, its beginning and its end included.
  using Course = std::array<Setpoint, kDriveLoopSteps + 1>;
  template <class Port>
  using Chains = ChainsOf<Real, Port>;

  AxisDriveOf(const AxisParams& declared, const AxisParams& actual, const Effects& effects,
              std::size_t axis, std::uint64_t seed);
  void couple(const TransmissionPort::Signal<double>& transmission, double load);
  Cycle run(const Course& course);
  void shape(Setpoint& setpoint, Real acceleration, int step);
  Real control(const Setpoint& now, const Setpoint& next);
  double known(double KnownForce::*force, double loop) const;
  Real told_load_force() const;
  void sample(const Setpoint& now, Real measured);
  /// One number of the sampled controllers.
  template <class F>
  Real of_sampled(F&& f) const {
    Real all{};
    for (std::size_t i = 0; i < sampled_.size(); ++i) set_lane(all, i, f(sampled_[i]));
    return all;
  }
  void move_plant();
  void move_rigid(Real force, Real load_force);
  void move_two_masses(Real force, Real load_force);
  Real rub(Real v, Real v_free, Real mobility);
  FrictionPort::Signal<Real> friction_terms(Real v, Real v_free);
  void sum_up_constant_friction();
  Real rub_motor(Real v_free);
  Real displaced(Real velocity_before);
  /// How far the load is ahead of the motor by an uneven transmission, and what force the motor's
  /// inertia adds when it is moved by that.
  Real unevenness() const;
  Real force_of_unevenness() const;
  /// What the measuring system of that side counts.
  Real encoder(ServoParams::Feedback side);
  Moment moment(double dt, int steps_per_loop, int step) const;
  void update_motions(int steps_ahead);
  const Motions<double>* motions(std::size_t lane) const {
    return laws_ ? &motions_[lane] : nullptr;
  }

  std::size_t axis_;
  ServoParams::Feedback feedback_;
  double travel_per_turn_, force_limit_;  ///< declared
  Setpoint setpoint_;

  // Constants of the loops and the plant.
  Real inertia_;  ///< what the controller takes it to be
  Real motor_inertia_, load_inertia_;
  Real plant_mobility_, motor_mobility_, load_mobility_;  ///< plant step / inertia
  ServoPort::Signal<Real> servo_;
  Real kp_{}, lag_share_{}, position_share_{}, setpoint_share_{}, velocity_share_{},
      feedforward_share_{};
  bool two_masses_ = false;
  Real stiffness_{}, damping_{}, half_gap_{};
  bool uneven_ = false;
  Real lead_{}, wave_{}, wave_number_{}, wave_phase_{};  ///< of an uneven transmission
  bool motor_rubs_ = false;
  Real motor_dry_{}, motor_viscous_{}, motor_stiffness_{};

  // Effects.
  Chains<ReceptionPort> reception_;
  Chains<SetpointPort> shaping_;
  Chains<EncoderPort> counting_;
  Chains<MotorForcePort> motor_;
  Chains<LoadForcePort> load_;
  Chains<FrictionPort> rubbing_;
  PerLane<Real, FrictionTerms> constant_of_each_{};  ///< friction
  FrictionPort::Signal<Real> constant_;              ///< the same
  Chains<DisplacementPort> displacing_;
  bool laws_;          ///< some law needs motions_
  bool told_ = false;  ///< tell_commands() was called
  double start_;       ///< where the axis was first

  // State.
  std::int64_t cycle_ = 0;
  std::array<LoadMotion, kDriveLoopSteps>* watched_ = nullptr;
  int first_truth_ = 0;  ///< loop step whose truth is wanted in full
  int loop_ = 0;         ///< within the cycle
  int plant_step_ = 0;
  double encoder_shift_ = 0;
  Real x_load_, v_load_{}, a_load_{}, x_motor_, v_motor_{};
  Real position_told_{}, position_error_{}, velocity_{}, velocity_told_{}, acceleration_told_{},
      force_ref_{}, force_{}, integral_{}, load_force_{};
  Setpoint last_raw_, last_shaped_;
  AxisVector told_position_{}, told_velocity_{}, before_position_{}, before_velocity_{};
  bool force_known_ = false;  ///< tell_force() was called
  KnownForce force_told_, force_before_;
  bool load_told_of_ = false;  ///< tell_load_force() was called
  Real load_told_{}, load_told_before_{};
  PerLane<Real, Motions<double>> motions_{};
  FrictionOf<Real> friction_, motor_friction_;
  VelocityObserverOf<Real> observer_;
  std::vector<SampledController> sampled_;  ///< one per lane, in place of the cascade, or none

  auto numbers() {
    return std::tuple_cat(
        std::tie(setpoint_.position, setpoint_.velocity, inertia_, motor_inertia_, load_inertia_,
                 plant_mobility_, motor_mobility_, load_mobility_, servo_.kv, servo_.velocity_gain,
                 servo_.integral_time, servo_.velocity_ff, servo_.acceleration_ff,
                 servo_.current_lag, servo_.force_limit, kp_, lag_share_, position_share_,
                 setpoint_share_, velocity_share_, feedforward_share_, stiffness_, damping_,
                 half_gap_, lead_, wave_, wave_number_, wave_phase_, motor_dry_, motor_viscous_,
                 motor_stiffness_, x_load_, x_motor_, last_raw_.position, last_raw_.velocity,
                 last_shaped_.position, last_shaped_.velocity, position_told_),
        observer_.numbers());
  }
};

using AxisDrive = AxisDriveOf<double>;
using AxisDriveLanes = AxisDriveOf<Lanes>;

extern template class AxisDriveOf<double>;
extern template class AxisDriveOf<Lanes>;

}  // namespace vcnc
