#include "controller/touch_trigger.hpp"

#include <algorithm>

#include "model/geometry/kinematics.hpp"

namespace vcnc {
namespace {

/// The deflection in the directions of X, Y, Z.
Vec3 along_axes(const Machine& machine, const ProbeReading& reading) {
  if (machine.kinematics.type != KinematicsParams::Type::head) return reading.deflection;
  const Kinematics kinematics(machine.kinematics, machine.probe.length, Vec3::Zero());
  return kinematics.forward(reading.position).R_WT * reading.deflection;
}

}  // namespace

TouchTrigger::TouchTrigger(const ProbeParams& probe)
    : on_(std::min(kOn * probe.min_deflection, 0.5 * probe.range)),
      off_(std::min(kOff * probe.min_deflection, 0.5 * on_)) {}

void TouchTrigger::step(const Vec3& deflection) {
  tripped_ = deflection.norm() >= (tripped_ ? off_ : on_);
}

AxisVector touch_point(const Machine& machine, const ProbeReading& reading, const Vec3& way) {
  AxisVector q = reading.position;
  const Vec3 delta = along_axes(machine, reading);
  const double against = -way.dot(delta);
  if (std::abs(against) <= TouchTrigger::kFlattest * delta.norm()) return q;
  const double back = delta.squaredNorm() / against;
  for (std::size_t i = 0; i < 3; ++i) q[i] -= back * way[static_cast<Eigen::Index>(i)];
  return q;
}

}  // namespace vcnc
