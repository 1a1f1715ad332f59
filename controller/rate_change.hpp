// A change of the rate at which a planned path is run.
//
//   d tau / dt = r0 + (r1 - r0) (3 s^2 - 2 s^3),  s = t / T
//   tau(t)     = tau0 + T (r0 (s - s^3 + s^4 / 2) + r1 (s^3 - s^4 / 2)),  then on at r1
// tau: time on the path as planned [s], t: real time [s]. With the velocity v, the acceleration a
// and the jerk j of an axis as planned, it has
//   r v,   r^2 a + r' v,   r^3 j + 3 r r' a + r'' v
// so that a constant rate up to 1 keeps every limit that the plan keeps.
// Source: time scaling of trajectories, Hollerbach, J. Dyn. Sys. Meas. Control 106 (1984) 102.
#pragma once

#include <algorithm>

namespace vcnc {

struct RateChange {
  double start = 0;         ///< tau0 [s]
  double from = 1, to = 1;  ///< r0, r1
  double time = 0;          ///< T [s]

  double rate(double t) const {
    const double s = share_of(t);
    const double share = s * s * (3 - 2 * s);
    return from * (1 - share) + to * share;
  }

  double path_time(double t) const {
    const double s = share_of(t);
    const double rising = s * s * s - 0.5 * s * s * s * s;
    const double changed =
        start + from * time * (s - s * s * s + 0.5 * s * s * s * s) + to * time * rising;
    return t > time ? changed + to * (t - time) : changed;
  }

  /// What it passes of the path until the rate is r1 [s].
  double way() const { return 0.5 * time * (from + to); }
  bool over(double t) const { return t >= time; }

 private:
  double share_of(double t) const { return time > 0 ? std::min(t / time, 1.0) : 1.0; }
};

}  // namespace vcnc
