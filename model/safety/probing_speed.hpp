// How fast axes may move with the probe in the spindle so that a crash cannot take it to its
// mechanical limit.
//
// Axes q_i with speeds v_i are stopped by a quick stop, each on its own ramp a_i: T_i = |v_i| /
// a_i. With J_i = R_WT^T dp/dq_i (linear axes: a unit vector; rotary axes: lever arm), all in the
// frame of the probe, the ball goes on relative to the workpiece by
//   w(t) = v t_r + D(t),   v = sum J_i v_i,   D(t) = sum J_i v_i (u - u^2 / 2 T_i), u = min(t, T_i)
// where t_r is the time from the hard stage of the protection to braking axes. Axes that hold the
// ball in place together (RTCP) do not stop together, so D may exceed what v suggests.
// The deflection goes along the surface normal n, (w n) n, whose component along e is at most
// (|w| + |w e|) / 2. With the reserve r_e between the hard stage (runaway: a soft stop may come too
// late) and the limit, all speeds times f
//   f t_r (|v| + |v e|) / 2 + f^2 max_t (|D| + |D e|) / 2 <= r_e     laterally and axially
// A single direction with one deceleration a gives v t_r + v^2 / 2a <= r / ((1 + share) / 2). The
// lateral hard stage is at the corner of the range. Besides, periods must be countable, or nobody
// would see the range being left: f |v| <= signal period / (2 x 100 us) (model/probe/signals.hpp).
// J is that of the begin: turning by D it changes by less than D itself, second order.
// Source: own derivation.
#pragma once

#include "model/geometry/kinematics.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// How far the machine goes on after the probe has left its range [m]: reaction time and braking,
///   s = v t_r + v^2 / 2a
double stopping_distance(double speed, double reaction_time, double deceleration);

/// What all speeds may be multiplied by, and what forbids more.
struct ProbingBound {
  enum class By { counting, lateral, axial };
  double factor = 0;     ///< f; infinite: the ball does not move
  By by = By::counting;  ///< what is at its end
  double speed = 0;      ///< |v| as asked for [m/s]
  std::size_t axis = 0;  ///< that contributes most to the ball's motion
  double lever = 0;      ///< of that axis, if it is rotary: |J_i| [m]
};

class ProbingLimit {
 public:
  /// `reaction_time` t_r [s]; the decelerations are those of the axes.
  ProbingLimit(const Machine& machine, double reaction_time);

  /// Axes at q with the speeds dq [m/s, rad/s].
  ProbingBound at(const AxisVector& q, const AxisVector& dq) const;

  double lateral_reserve() const { return lateral_reserve_; }  ///< [m]
  double axial_reserve() const { return axial_reserve_; }      ///< [m]

 private:
  Kinematics kinematics_;
  AxisVector deceleration_{};
  double reaction_time_, lateral_reserve_, axial_reserve_, countable_;
};

}  // namespace vcnc
