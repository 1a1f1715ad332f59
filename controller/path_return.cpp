#include "controller/path_return.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

PathReturn::PathReturn(const Machine& machine, const AxisVector& from, const AxisVector& to)
    : from_(from), to_(to) {
  constexpr double kPeakSpeed = 15.0 / 8, kPeakJerk = 60, kShare = 0.5;
  const double peak_acceleration = 10 / std::sqrt(3.0);
  Vec3 way = Vec3::Zero();
  double turn = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double d = to[i] - from[i];
    if (is_rotary(i))
      turn = std::max(turn, std::abs(d));
    else
      way[static_cast<Eigen::Index>(i)] = d;
    const AxisLimits& limits = machine.axes[i].limits;
    duration_ =
        std::max({duration_, kPeakSpeed * std::abs(d) / limits.velocity,
                  std::sqrt(peak_acceleration * std::abs(d) / (kShare * limits.acceleration)),
                  std::cbrt(kPeakJerk * std::abs(d) / (kShare * limits.jerk))});
  }
  duration_ = std::max(
      {duration_, kPeakSpeed * way.norm() / kRetractSpeed, kPeakSpeed * turn / kReturnTurn});
}

AxisVector PathReturn::position(double t) const {
  if (t >= duration_) return to_;
  const double s = std::max(t / duration_, 0.0);
  const double share = s * s * s * (10 + s * (-15 + s * 6));
  AxisVector q = from_;
  for (std::size_t i = 0; i < kAxisCount; ++i) q[i] += (to_[i] - from_[i]) * share;
  return q;
}

AxisVector PathReturn::velocity(double t) const {
  AxisVector v{};
  if (t >= duration_) return v;
  const double s = std::max(t / duration_, 0.0);
  const double rate = 30 * s * s * (1 - s) * (1 - s) / duration_;
  for (std::size_t i = 0; i < kAxisCount; ++i) v[i] = (to_[i] - from_[i]) * rate;
  return v;
}

}  // namespace vcnc
