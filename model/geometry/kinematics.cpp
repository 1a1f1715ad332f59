#include "model/geometry/kinematics.hpp"

#include <cmath>

namespace vcnc {
namespace {

// Below this sine of A the tool axis says next to nothing about C.
constexpr double kPoleSine = 1e-4;

// Adds whole turns to `angle` until it is within half a turn of `reference`.
double nearest_turn(double angle, double reference) {
  return angle + 2 * kPi * std::round((reference - angle) / (2 * kPi));
}

/// Rotation by the vector t: about its direction by its length [rad].
Mat3 rot_vector(const Vec3& t) {
  const double angle = t.norm();
  if (angle == 0) return Mat3::Identity();
  return Eigen::AngleAxisd(angle, t / angle).toRotationMatrix();
}

/// A rotation about a line that is tilted by t.
Mat3 about_tilted(const Mat3& R, const Vec3& t) {
  if (t.isZero(0)) return R;
  const Mat3 tilt = rot_vector(t);
  return tilt * R * tilt.transpose();
}

}  // namespace

Kinematics::Kinematics(const KinematicsParams& params, double tool_length, const Vec3& p_MW)
    : params_(params),
      tool_length_(tool_length),
      p_MW_(p_MW),
      p_AT_(params.p_AG - tool_length * Vec3::UnitZ()) {}

RotaryPair Kinematics::counted(const RotaryPair& iso) const {
  return {params_.a_reversed ? -iso.a : iso.a, params_.c_reversed ? -iso.c : iso.c};
}

AxisVector Kinematics::inverse(const Vec3& p_WT, double a, double c) const {
  const RotaryPair iso = counted({a, c});
  const KinematicsParams& k = params_;
  Vec3 p_M;
  if (k.type == KinematicsParams::Type::trunnion) {
    p_M = k.p_MA + rot_x(-iso.a) * (rot_z(-iso.c) * (p_WT + p_MW_ - k.p_MC) + (k.p_MC - k.p_MA));
  } else {
    p_M = p_WT + p_MW_ - rot_z(iso.c) * (k.p_CA + rot_x(iso.a) * p_AT_) + k.p_CA + p_AT_;
  }
  return {p_M.x(), p_M.y(), p_M.z() + tool_length_, a, c};
}

ToolPose Kinematics::forward(const AxisVector& q) const {
  const RotaryPair iso = counted({q[kA], q[kC]});
  const KinematicsParams& k = params_;
  const Mat3 Rx = rot_x(iso.a), Rz = rot_z(iso.c);
  const Vec3 p_M(q[kX], q[kY], q[kZ] - tool_length_);
  ToolPose pose;
  pose.R_WT = Rz * Rx;
  if (k.type == KinematicsParams::Type::trunnion) {
    pose.p_WT = Rz * (Rx * (p_M - k.p_MA) - (k.p_MC - k.p_MA)) + k.p_MC - p_MW_;
  } else {
    pose.p_WT = p_M - p_MW_ + Rz * (k.p_CA + Rx * p_AT_) - k.p_CA - p_AT_;
  }
  return pose;
}

ToolPose Kinematics::forward(const AxisVector& q, const GeometryErrors<double>& e) const {
  const RotaryPair iso = counted({q[kA], q[kC]});
  const KinematicsParams& k = params_;
  const Mat3 Rx = about_tilted(rot_x(iso.a), e.a_tilt);
  const Mat3 Rz = about_tilted(rot_z(iso.c), e.c_tilt);
  const Mat3 turn = rot_vector(e.tool_turn);
  const Vec3 longer = e.tool_longer * (turn * Vec3::UnitZ());
  const Vec3 p_M = Vec3(q[kX], q[kY], q[kZ] - tool_length_) + e.tip;
  ToolPose pose;
  if (k.type == KinematicsParams::Type::trunnion) {
    const Vec3 p_MA = k.p_MA + e.a_shift, p_MC = k.p_MC + e.c_shift;
    pose.R_WT = Rz * Rx * turn;
    pose.p_WT =
        Rz * (Rx * (p_M - longer - p_MA - e.a_run) - (p_MC - p_MA) - e.c_run) + p_MC - p_MW_;
  } else {
    // The head's arm from the C axis' line over the A axis' line to the tip.
    const Vec3 p_A = k.p_CA + e.a_shift;
    const Vec3 to_tip = p_AT_ - e.a_shift;
    pose.R_WT = turn * Rz * Rx;
    pose.p_WT = p_M - p_MW_ + Rz * (p_A + e.a_run + Rx * to_tip - e.c_shift) + e.c_shift + e.c_run -
                k.p_CA - p_AT_ - e.tool_longer * (pose.R_WT * Vec3::UnitZ());
  }
  const Mat3 piece = rot_vector(e.piece_tilt).transpose();
  pose.p_WT = piece * (pose.p_WT - e.piece_shift);
  pose.R_WT = piece * pose.R_WT;
  return pose;
}

std::array<Vec3, 3> Kinematics::arms(const AxisVector& q) const {
  Vec3 tip(q[kX], q[kY], q[kZ] - tool_length_);
  if (params_.type == KinematicsParams::Type::head) {
    const RotaryPair iso = counted({q[kA], q[kC]});
    tip += rot_z(iso.c) * (params_.p_CA + rot_x(iso.a) * p_AT_) - params_.p_CA - p_AT_;
  }
  return {Vec3(tip.x() - q[kX], tip.y(), tip.z()), Vec3(tip.x() - q[kX], tip.y() - q[kY], tip.z()),
          Vec3(tip.x() - q[kX], tip.y() - q[kY], tip.z() - q[kZ])};
}

Eigen::Matrix<double, 3, 5> Kinematics::jacobian(const AxisVector& q) const {
  const RotaryPair iso = counted({q[kA], q[kC]});
  const KinematicsParams& k = params_;
  const Mat3 Rx = rot_x(iso.a), Rz = rot_z(iso.c);
  const Vec3 e_x = Vec3::UnitX(), e_z = Vec3::UnitZ();
  Eigen::Matrix<double, 3, 5> J;
  if (k.type == KinematicsParams::Type::trunnion) {
    const Vec3 p_M(q[kX], q[kY], q[kZ] - tool_length_);
    const Vec3 in_cradle = Rx * (p_M - k.p_MA);  // from the A axis, turned back by the cradle
    J.leftCols<3>() = Rz * Rx;
    J.col(kA) = Rz * e_x.cross(in_cradle);
    J.col(kC) = e_z.cross(Rz * (in_cradle - (k.p_MC - k.p_MA)));
  } else {
    const Vec3 swung = Rx * p_AT_;
    J.leftCols<3>() = Mat3::Identity();
    J.col(kA) = Rz * e_x.cross(swung);
    J.col(kC) = e_z.cross(Rz * (k.p_CA + swung));
  }
  if (k.a_reversed) J.col(kA) *= -1;
  if (k.c_reversed) J.col(kC) *= -1;
  return J;
}

Vec3 tool_axis(double a, double c) {
  return {std::sin(a) * std::sin(c), -std::sin(a) * std::cos(c), std::cos(a)};
}

RotaryPair rotary_from_axis(const Vec3& d, const RotaryPair& previous) {
  const double sine = std::hypot(d.x(), d.y());
  if (sine < kPoleSine) {
    // The best A for the C that stays: project d on the plane the tool can swing in.
    const double side = d.x() * std::sin(previous.c) - d.y() * std::cos(previous.c);
    return {std::atan2(side, d.z()), previous.c};
  }
  const double a = std::atan2(sine, d.z()), c = std::atan2(d.x(), -d.y());
  const RotaryPair first{a, nearest_turn(c, previous.c)};
  const RotaryPair second{-a, nearest_turn(c + kPi, previous.c)};
  const auto way = [&](const RotaryPair& r) {
    return std::abs(r.a - previous.a) + std::abs(r.c - previous.c);
  };
  return way(second) < way(first) ? second : first;
}

}  // namespace vcnc
