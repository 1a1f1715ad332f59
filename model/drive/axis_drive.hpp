// One servo axis: cascaded controller, motor, transmission and load, on the load side in SI units
// (m, N, kg for linear axes; rad, N m, kg m^2 for rotary ones).
//
// Set-point: cubic Hermite interpolation between two bus set-points (position and velocity at both
// ends), so that velocity and acceleration feed-forward are smooth.
//
// Every 100 us (loop step, T), at its instant t:
//   v_ref = Kv (x_c - x_m) + kvff v_c
//   F_ref = Kp (v_ref - v_m) + (Kp/Ti) int (v_ref - v_m) dt + kaff J a_c
//   |F_ref| <= F_max; the integral is held while the force is limited
//   Kp    = 2 pi f_v J,  J = load + reflected motor inertia
//   a_c   = (v_c(t + T) - v_c(t)) / T, the acceleration that the coming step needs on average
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
//   backlash without compliance: the same with a contact stiffness of 400 Hz resonance
//
// Integration: rigid exactly for a force constant over the step; two masses by the symplectic Euler
// rule, with K limited to a resonance of 1.6 kHz (10 kN then wind the spring up by less than
// 0.3 um on 500 kg). Friction implicitly (model/drive/friction.hpp).
//
// Where the effects of model/effects/ act: set-points as received and as used, gains, force of the
// motor, spring (K, b), further force on the load, friction F_f, the position a measuring system
// counts, and what the tool centre is off the scale (true position = load + displacement). The
// controller knows the declared masses; the plant has the actual ones.
//
// Valid below about half the loop rate. Not modelled: current ripple, cross-coupling of the plants.
// Source: Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation; Altintas et al., CIRP
// Annals 60/2 (2011) 779; observer gains: the critically damped g-h-k filter of Brookner, Tracking
// and Kalman Filtering Made Easy.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "model/drive/friction.hpp"
#include "model/drive/sampled_controller.hpp"
#include "model/effects/chain.hpp"
#include "model/machine.hpp"

namespace vcnc {

inline constexpr int kDriveLoopSteps = 10;        ///< per bus cycle
inline constexpr double kDriveLoopTime = 100e-6;  ///< [s]
inline constexpr int kPlantStepsPerLoop = 2;
inline constexpr double kPlantTime = kDriveLoopTime / kPlantStepsPerLoop;

/// Bus set-point: where the axis shall be at the end of a cycle, and how fast.
struct AxisSetpoint {
  double position = 0, velocity = 0;
};

/// What one cycle of the drive brought about.
struct AxisCycle {
  double measured = 0;  ///< position by the measuring system at the end of the cycle
  double second = 0;    ///< load side minus motor side at the end of the cycle
  double force = 0;     ///< drive force at the end (sampled: demanded), share of the limit
  double velocity = 0;  ///< measured velocity at the end
  std::array<double, kDriveLoopSteps> truth{};  ///< true load position at the end of each loop step
};

/// Estimates the motor's velocity from its position and the drive force.
class VelocityObserver {
 public:
  VelocityObserver(double bandwidth, double inertia, double position);
  /// One loop step: `force` acted during it, `position` was measured at its end.
  void step(double force, double position);
  double velocity() const { return velocity_; }

 private:
  double inverse_inertia_, gain_position_, gain_velocity_, gain_disturbance_;
  double position_, velocity_ = 0, disturbance_ = 0;
};

class AxisDrive {
 public:
  /// One axis of a machine with its effects, laws and deviations; `seed` of all noise.
  /// Throws std::invalid_argument naming the key when wind-up or backlash lack a motor inertia.
  AxisDrive(const Machine& machine, std::size_t axis, std::uint64_t seed);
  /// A linear axis on its own, as declared.
  explicit AxisDrive(const AxisParams& params, const AxisEffects& effects = {});

  /// Follows the set-point through one bus cycle (closed loop).
  AxisCycle follow(const AxisSetpoint& target);
  /// Quick stop: brakes with `deceleration` [m/s^2 or rad/s^2] along its own ramp for one cycle.
  AxisCycle brake(double deceleration);
  /// Holds the last commanded position with the loop closed (also before the first set-point); a
  /// commanded velocity drops to zero at once.
  AxisCycle hold();

  /// Commanded positions and velocities of all axes for the end of the coming cycle: what a law of
  /// this axis may know of the others. Call it before follow().
  void tell_commands(const AxisVector& position, const AxisVector& velocity);

  /// Takes what is measured for the set-point: braking after a following error starts where the
  /// axis is, not where it was told to be.
  void follow_up();
  /// From now on both measuring systems count this much more [m or rad] (0: right): an encoder that
  /// has jumped.
  void shift_encoder(double by) { encoder_shift_ = by; }

  bool standing() const;  ///< commanded and measured velocity are (nearly) zero
  double position() const { return setpoint_.position; }

 private:
  /// Set-points at the loop instants of a cycle, its beginning and its end included.
  using Course = std::array<AxisSetpoint, kDriveLoopSteps + 1>;

  AxisDrive(const AxisParams& declared, const AxisParams& actual, const Effects& effects,
            std::size_t axis, std::uint64_t seed);
  void couple(const TransmissionPort::Signal<double>& transmission);
  AxisCycle run(const Course& course);
  AxisSetpoint shaped(const AxisSetpoint& setpoint, double acceleration, int step);
  double control(const AxisSetpoint& now, const AxisSetpoint& next);
  double force_demanded() const;
  void move_plant();
  void move_rigid(double force, double load_force);
  void move_two_masses(double force, double load_force);
  double rub(double v, double v_free, double inertia);
  double displaced(double velocity_before);
  double encoder(double position);
  Moment moment(double dt, int steps_per_loop, int step) const;
  void update_motions(int steps_ahead);

  std::size_t axis_;
  ServoParams::Feedback feedback_;
  MechanicsParams declared_, actual_;
  AxisSetpoint setpoint_;

  // Constants of the loops and the plant.
  double inertia_;  ///< what the controller takes it to be
  double plant_inertia_, motor_inertia_;
  ServoPort::Signal<double> servo_;
  double kp_, lag_share_;
  bool two_masses_ = false;
  double stiffness_ = 0, damping_ = 0, half_gap_ = 0;

  // Effects.
  Chain<ReceptionPort> reception_;
  Chain<SetpointPort> shaping_;
  Chain<EncoderPort> counting_;
  Chain<MotorForcePort> motor_;
  Chain<LoadForcePort> load_;
  Chain<FrictionPort> rubbing_;
  Chain<DisplacementPort> displacing_;
  bool laws_;          ///< some law needs motions_
  bool told_ = false;  ///< tell_commands() was called

  // State.
  std::int64_t cycle_ = 0;
  int loop_ = 0;  ///< within the cycle
  int plant_step_ = 0;
  double encoder_shift_ = 0;
  double x_load_, v_load_ = 0, a_load_ = 0, x_motor_, v_motor_ = 0;
  double force_ref_ = 0, force_ = 0, integral_ = 0, load_force_ = 0;
  AxisSetpoint last_raw_, last_shaped_;
  AxisVector told_position_{}, told_velocity_{}, before_position_{}, before_velocity_{};
  Motions<double> motions_{};
  Friction friction_;
  VelocityObserver observer_;
  std::optional<SampledController> sampled_;  ///< in place of the cascade
};

}  // namespace vcnc
