#include "controller/gcode_blocks.hpp"

namespace vcnc {
namespace {

Coordinates as_coordinates(const AxisVector& q) { return Eigen::Map<const Coordinates>(q.data()); }

}  // namespace

AxisVector as_axes(const Coordinates& x) { return {x[0], x[1], x[2], x[3], x[4]}; }

Coordinates start_coordinates(const Machine& machine) {
  Coordinates q;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    q[static_cast<Eigen::Index>(i)] = machine.axes[i].limits.start;
  return q;
}

Mat3 tilt_rotation(const Vec3& angles) {
  using Eigen::AngleAxisd;
  return (AngleAxisd(angles[0], Vec3::UnitZ()) * AngleAxisd(angles[1], Vec3::UnitX()) *
          AngleAxisd(angles[2], Vec3::UnitZ()))
      .toRotationMatrix();
}

FrameMap::FrameMap(const KinematicsParams& params, const MotionFrame& frame)
    : tilted_(!frame.tilt.isZero(0) || !frame.tilt_origin.isZero(0)),
      origin_(frame.tilt_origin),
      R_WF_(tilt_rotation(frame.tilt)) {
  if (frame.rtcp) kinematics_.emplace(params, frame.tool_length, frame.p_MW);
}

Coordinates FrameMap::to_axes(const Coordinates& x) const {
  if (!kinematics_) return x;
  if (tilted_)
    return as_coordinates(kinematics_->inverse(origin_ + R_WF_ * x.head<3>(), x[kA], x[kC]));
  return as_coordinates(kinematics_->inverse(x.head<3>(), x[kA], x[kC]));
}

Coordinates FrameMap::from_axes(const Coordinates& q) const {
  if (!kinematics_) return q;
  Coordinates x = q;
  x.head<3>() = kinematics_->forward(as_axes(q)).p_WT;
  if (tilted_) x.head<3>() = R_WF_.transpose() * (x.head<3>() - origin_);
  return x;
}

}  // namespace vcnc
