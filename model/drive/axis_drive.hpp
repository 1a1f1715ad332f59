// One servo axis: cascaded controller, motor, transmission and load, on the load side in SI units
// (m, N, kg for linear axes; rad, N m, kg m^2 for rotary ones).
//
// Set-point: cubic Hermite interpolation between two bus set-points (position and velocity at both
// ends), so that velocity and acceleration feed-forward are smooth.
// Every 100 us (loop step):
//   v_ref = Kv (x_c - x_m) + kvff v_c
//   F_ref = Kp (v_ref - v_m) + (Kp/Ti) int (v_ref - v_m) dt + kaff J a_c,  |F_ref| <= F_max, the integral
//           is held while the force is limited;  Kp = 2 pi f_v J,  J = load + reflected motor inertia
// Every 50 us (plant step), after a first-order lag tau_i of the force:
//   rigid (compliance 0, gap 0):   J x'' = F - F_f(x')
//   two masses:  m_r x_m'' = F - F_s,   m x'' = F_s - F_f(x'),
//     F_s = K g(x_m - x) + D (x_m' - x'), g(z) = z -+ b/2 outside the gap b and 0 inside (D off inside)
//   backlash without compliance: the same with a contact stiffness that puts the resonance at 400 Hz.
// Integration: semi-implicit Euler; friction by an implicit clamp that cannot reverse the motion within a step (static
// law) or by the stable LuGre step (model/drive/friction.hpp).
// Source: Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation; Altintas et al., CIRP Annals
// 60/2 (2011) 779. Not modelled: current ripple, thermal growth, cross-coupling between axes.
#pragma once

#include <array>

#include "model/drive/friction.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// Bus set-point: where the axis shall be at the end of a cycle, and how fast.
struct AxisSetpoint {
  double position = 0, velocity = 0;
};

/// What one cycle of the drive brought about.
struct AxisCycle {
  double measured = 0;      ///< position by the measuring system at the end of the cycle
  double second = 0;        ///< load side minus motor side at the end of the cycle
  double force = 0;         ///< drive force at the end, share of the limit
  double velocity = 0;      ///< measured velocity at the end
  std::array<double, 10> truth{};  ///< true load position at the end of each loop step
};

class AxisDrive {
 public:
  AxisDrive(const AxisParams& params, const AxisEffects& effects);

  /// Follows the set-point through one bus cycle (closed loop).
  AxisCycle follow(const AxisSetpoint& target);
  /// Brakes with `deceleration` [m/s^2 or rad/s^2] along its own ramp through one cycle (quick stop).
  AxisCycle brake(double deceleration);
  /// Holds position with the loop closed (also before the first set-point).
  AxisCycle hold();

  bool standing() const;  ///< commanded and measured velocity are (nearly) zero
  double position() const { return setpoint_.position; }

 private:
  AxisParams params_;
  AxisEffects effects_;
  AxisSetpoint setpoint_;
};

}  // namespace vcnc
