#include "controller/retract.hpp"

#include <algorithm>

#include "model/geometry/kinematics.hpp"

namespace vcnc {

Retract::Retract(const Machine& machine, const AxisVector& from, const Vec3& deflection)
    : from_(from) {
  const double depth = deflection.norm();
  if (!(depth > 0)) return;
  const double length = std::min(depth + kRetractClearance, kLongestRetract);
  way_ = deflection / depth * length;
  if (machine.kinematics.type == KinematicsParams::Type::head)  // the tool turns with the head
    way_ = Kinematics(machine.kinematics, machine.probe.length, Vec3::Zero()).forward(from).R_WT *
           way_;
  for (std::size_t i = 0; i < 3; ++i) {
    const AxisLimits& limits = machine.axes[i].limits;
    double& way = way_[static_cast<Eigen::Index>(i)];
    way = std::clamp(from[i] + way, std::min(limits.min, from[i]), std::max(limits.max, from[i])) -
          from[i];
  }
  duration_ = 15.0 / 8 * way_.norm() / kRetractSpeed;
}

AxisVector Retract::position(double t) const {
  AxisVector q = from_;
  const double s = duration_ > 0 ? std::clamp(t / duration_, 0.0, 1.0) : 1;
  const double share = s * s * s * (10 + s * (-15 + s * 6));
  for (std::size_t i = 0; i < 3; ++i) q[i] += way_[static_cast<Eigen::Index>(i)] * share;
  return q;
}

AxisVector Retract::velocity(double t) const {
  AxisVector v{};
  if (!(duration_ > 0) || t >= duration_) return v;
  const double s = std::max(t / duration_, 0.0);
  const double rate = 30 * s * s * (1 - s) * (1 - s) / duration_;
  for (std::size_t i = 0; i < 3; ++i) v[i] = way_[static_cast<Eigen::Index>(i)] * rate;
  return v;
}

}  // namespace vcnc
