// Takes the probe off what it has run into: a straight motion of the linear axes from rest to rest.
//
//   way       along the deflection (the tool follows its stylus), so that the stylus is relieved:
//             its length and kRetractClearance more, kLongestRetract at most, within the travel
//   law       x(t) = x0 + way (10 s^3 - 15 s^4 + 6 s^5),  s = t / T;  peak speed 15/8 |way| / T
//   T         for a peak speed of kRetractSpeed
// Source: the minimum-jerk polynomial of Flash and Hogan, J. Neuroscience 5 (1985) 1688.
#pragma once

#include "model/machine.hpp"

namespace vcnc {

inline constexpr double kRetractSpeed = 0.010, kRetractClearance = 1e-3, kLongestRetract = 6e-3;

class Retract {
 public:
  /// From rest at axis positions `from`, with the probe's deflection [m, probe frame].
  Retract(const Machine& machine, const AxisVector& from, const Vec3& deflection);

  double duration() const { return duration_; }
  AxisVector position(double t) const;
  AxisVector velocity(double t) const;

 private:
  AxisVector from_;
  Vec3 way_ = Vec3::Zero();
  double duration_ = 0;
};

}  // namespace vcnc
