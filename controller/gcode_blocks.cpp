#include "controller/gcode_blocks.hpp"

namespace vcnc {
namespace {

Coordinates as_coordinates(const AxisVector& q) { return Eigen::Map<const Coordinates>(q.data()); }

AxisVector as_axes(const Coordinates& x) { return {x[0], x[1], x[2], x[3], x[4]}; }

}  // namespace

Coordinates start_coordinates(const Machine& machine) {
  Coordinates q;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    q[static_cast<Eigen::Index>(i)] = machine.axes[i].limits.start;
  return q;
}

FrameMap::FrameMap(const KinematicsParams& params, const MotionFrame& frame) {
  if (frame.rtcp) kinematics_.emplace(params, frame.tool_length, frame.p_MW);
}

Coordinates FrameMap::to_axes(const Coordinates& x) const {
  if (!kinematics_) return x;
  return as_coordinates(kinematics_->inverse(x.head<3>(), x[kA], x[kC]));
}

Coordinates FrameMap::from_axes(const Coordinates& q) const {
  if (!kinematics_) return q;
  Coordinates x = q;
  x.head<3>() = kinematics_->forward(as_axes(q)).p_WT;
  return x;
}

}  // namespace vcnc
