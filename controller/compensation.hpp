// Compensation: what the NC unit adds to the planned set-points so that a machine with known errors
// goes where it was planned to go. It stands between the interpolator and the command frame, once
// per cycle T; planned positions are those of the program, commanded ones those of the encoders.
//
//   lead        q' = q + v l + a l^2/2,  v' = v + a l,  a = (v(t) - v(t - T)) / T,  l: lead
//   errors      c_i = s_i b_i/2 - e_i (q'_i - q0_i) - squareness_i
//                     - sum over its tables: (f(q'_o) + r(q'_o))/2 + s_o (f(q'_o) - r(q'_o))/2
//               squareness_X = S_xy y + S_xz z,  squareness_Y = S_yz z
//   friction    Kff p' + Kv p = u,  u: pulse of velocity (model/compensation.hpp)
//   command     q'_i + w c_i + p_i, within the travel of the axis; velocities are the derivatives
//
//   b: backlash, e, q0: scale, f, r: table forward and in reverse (of axis o), Kv, Kff: gains of
//   the drive. s_i is the direction of the axis, -1 or +1 (0 before it has moved), and w the switch
//   from 0 to 1 at the start; both pass through three moving averages of n cycles each. A step of
//   them is then a quadratic B-spline of velocity over 3 n T, with the peaks that
//   shortest_transition() in model/compensation.hpp names; n is the declared transition or the
//   shortest that takes half of the velocity, acceleration and jerk limits. A gap is crossed in the
//   meantime, so a shorter one is more accurate; it is refused only where it would break the
//   velocity or acceleration limit.
//
// Friction is answered by a pulse that the velocity controller shall feel, as the velocity offset
// 60B1h of CiA 402 would bring it. The group command has no such offset, only a set-point; hence
// the set-point p through which Kv (x_c - x_m) + Kff v_c grows by u, exactly, while the axis stays
// where it is. It fades to zero by itself and leaves no position behind. A pulse begins at the
// zero of the velocity, found between two cycles.
//
// Signs: an error is actual - commanded and is taken off; backlash > 0 is an encoder ahead of the
// table, which a motor then has to drive further in the direction of motion.
//
// Validity: first order in the errors (scale 100 um/m of a correction of 50 um: 5 nm). The lead is
// a prediction, off by j l^3/6 + j T l^2/4 while the jerk is j: 21 nm for 1 ms, 1.4 um for 5 ms at
// 50 m/s^3. Where a jerk limit is used up by the program, a transition adds half of it again; a
// table adds (change of slope) v / T to the acceleration at its points; a pulse of friction makes
// the acceleration jump by A/T_r, as the friction does. A correction beyond the travel is cut off.
//
// Source: tables with two directions and cross tables: Siemens SINUMERIK 840D sl, Function Manual
// Extended Functions, K3 Compensations (LEC, CEC), also the characteristic a1, a2, a3 of the
// friction compensation; backlash spread over cycles: Beckhoff TwinCAT CNC, P-AXIS-00243; sign of
// backlash: Heidenhain TNC; own derivation of p.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bus/tick.hpp"
#include "model/axes.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// A sign passed through three moving averages, with its rate; one cycle behind its own end.
class SmoothedSign {
 public:
  /// `duration` [s] of a whole change.
  explicit SmoothedSign(double duration = 0);
  void step(int sign);
  double value() const { return output_[1]; }
  double rate() const { return 0.5 * (output_[0] - output_[2]) / kCycle; }  ///< [1/s]

 private:
  static constexpr int kAverages = 3;
  struct Average {
    std::vector<std::int64_t> last;
    std::int64_t sum = 0;
  };
  std::size_t cycles_, next_ = 0;
  std::array<Average, kAverages> averages_;
  std::array<double, 3> output_{};  ///< newest first
};

/// Positions and velocities with what the settings of a machine make of them, ready to be used.
class CompensationRules {
 public:
  /// Throws std::invalid_argument where a table has no points.
  explicit CompensationRules(const Machine& machine);
  bool empty() const { return empty_; }  ///< nothing is compensated

  struct TwoWayCurve {
    std::size_t axis = 0, over = 0;
    std::vector<double> at, mean, half;  ///< (f + r)/2, (f - r)/2
    bool modulo = false;
  };
  /// One axis by itself.
  struct OneAxis {
    AxisCompensation set;
    double lower = 0, upper = 0;  ///< travel
    double kv = 0, velocity_ff = 1;
    double transition = 0;  ///< [s]
  };
  PerAxis<OneAxis> axes;
  SquarenessCompensation squareness;
  std::vector<TwoWayCurve> curves;
  double entry = 0;  ///< duration of switching on [s]

 private:
  bool empty_ = true;
};

/// What is going on.
struct CompensationState {
  explicit CompensationState(const CompensationRules& rules);

  /// The pulses of an axis: both exponentials, and the set-point they make.
  struct Pulse {
    double decaying = 0, rising = 0;  ///< [m/s or rad/s]
    double position = 0;              ///< p
  };
  bool begun = false;
  AxisVector planned_velocity{};  ///< of the cycle before
  AxisVector velocity{};          ///< the same with the lead
  PerAxis<int> direction{};
  PerAxis<SmoothedSign> turned;
  SmoothedSign entered;
  PerAxis<Pulse> pulses{};
};

struct Compensated {
  AxisVector position{}, velocity{};  ///< to be commanded
  /// w c: what of it is in the encoders' reading only, not in the machine's position.
  AxisVector correction{};
};

/// One cycle.
Compensated compensated(const CompensationRules& rules, const AxisVector& position,
                        const AxisVector& velocity, CompensationState& state);

}  // namespace vcnc
