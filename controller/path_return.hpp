// Takes standing axes from where they are to another place, on a straight line in the space of the
// axes: back to the path after a retraction, or after the machine was switched on again.
//
//   law   q(t) = q0 + (q1 - q0) (10 s^3 - 15 s^4 + 6 s^5),  s = t / T
//         peaks: velocity 15/8 D/T, acceleration 10/sqrt(3) D/T^2, jerk 60 D/T^3
//   T     so long that the linear way is run with at most kRetractSpeed, the rotary one with the
//         turn that moves a point 0.2 m off its axis no faster, and that no axis takes more than
//         half of its acceleration and jerk limits
// Source: as controller/retract.hpp, whose motion this one reverses.
#pragma once

#include "controller/retract.hpp"
#include "model/machine.hpp"

namespace vcnc {

inline constexpr double kReturnTurn = kRetractSpeed / 0.2;  ///< [rad/s]

class PathReturn {
 public:
  PathReturn(const Machine& machine, const AxisVector& from, const AxisVector& to);

  double duration() const { return duration_; }
  AxisVector position(double t) const;
  AxisVector velocity(double t) const;

 private:
  AxisVector from_, to_;
  double duration_ = 0;
};

}  // namespace vcnc
