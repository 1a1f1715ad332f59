// Vectors, rotations and angle constants shared by the physics.
//
// Lengths are metres, angles radians, in every function of this project that does not say
// otherwise.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace vcnc {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kDegree = kPi / 180.0;

/// Rotation by `angle` [rad] about the x axis (right-hand rule).
inline Mat3 rot_x(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  Mat3 R;
  R << 1, 0, 0, 0, c, -s, 0, s, c;
  return R;
}

/// Rotation by `angle` [rad] about the z axis (right-hand rule).
inline Mat3 rot_z(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  Mat3 R;
  R << c, -s, 0, s, c, 0, 0, 0, 1;
  return R;
}

}  // namespace vcnc
