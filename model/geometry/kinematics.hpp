// Five-axis kinematics with axes A and C: trunnion (A carries the C table) and head (C carries A).
//
// Frames: M machine, W workpiece, T tool. W is parallel to M at A = C = 0 and stands on the table
// at the work offset p_MW; T has its origin at the controlled point (tool end or ball centre) and
// its z axis along the tool, away from the workpiece. Signs follow ISO 841 (+ = the tool turns +
// relative to the workpiece), so that for both types
//
//   R_WT = Rz(C) Rx(A),   tool axis in W:  d = R_WT e_z = (sinA sinC, -sinA cosC, cosA)
//
//   trunnion  p_M = p_MA + Rx(-A) [ Rz(-C) (p_W + p_MW - p_MC) + (p_MC - p_MA) ]
//   head      p_M = p_W + p_MW - Rz(C) [ p_CA + Rx(A) (p_AG - L e_z) ] + p_CA + p_AG - L e_z
//
// and the linear axes stand at p_M + L e_z, where L is the tool length (so they read the position
// of the spindle gauge line at A = C = 0). p_MA, p_MC, p_CA, p_AG: see KinematicsParams.
// Inverse of the tool axis: A = acos d_z, C = atan2(d_x, -d_y); the second solution is
// (-A, C + 180 deg).
// Source: ISO 841; closed forms by hand, rigid axes without errors.
#pragma once

#include <array>

#include "model/axes.hpp"
#include "model/effects/ports.hpp"
#include "model/machine.hpp"
#include "model/math.hpp"

namespace vcnc {

/// Controlled point and tool orientation in workpiece coordinates.
struct ToolPose {
  Vec3 p_WT = Vec3::Zero();
  Mat3 R_WT = Mat3::Identity();
};

/// Positions of the rotary axes [rad].
struct RotaryPair {
  double a = 0, c = 0;
};

class Kinematics {
 public:
  /// `tool_length` L [m]; `p_MW` work offset [m], machine frame at A = C = 0.
  Kinematics(const KinematicsParams& params, double tool_length, const Vec3& p_MW);

  /// Axis positions that put the controlled point at p_WT with the rotary axes at a, c [rad], as
  /// the control counts them.
  AxisVector inverse(const Vec3& p_WT, double a, double c) const;

  /// Where the controlled point is, and how the tool stands, for axis positions q.
  ToolPose forward(const AxisVector& q) const;

  /// The same on a machine with errors; with all errors zero the same to the last bit. Every body
  /// moves as a whole, without a first-order approximation:
  ///   tip        p_M' = p_M + tip - tool_longer R_M d,   tool turned by R(tool_turn)
  ///   rotary     a line with shift s and tilt t turns by R(t) Rx R(t)^T about the point + s,
  ///              what it turns is displaced by run
  ///   piece      p_W = R(piece_tilt)^T (p - piece_shift)
  /// R(t) is the rotation by the vector t [rad]. Source: the names and the first-order form are
  /// those of ISO 230-1 and ISO 230-7 (location errors of axes), composed as rigid motions.
  ToolPose forward(const AxisVector& q, const GeometryErrors<double>& errors) const;

  /// From the carriages of X, Y and Z to the tool tip, machine frame (PosePort::Context::arm).
  std::array<Vec3, 3> arms(const AxisVector& q) const;

  /// d p_WT / d q: columns per axis, [m/m] and [m/rad].
  Eigen::Matrix<double, 3, 5> jacobian(const AxisVector& q) const;

  /// Between ISO 841 rotary positions (tool_axis, rotary_from_axis) and those the control counts
  /// (every q, and the a, c of inverse): the signs of a_reversed, c_reversed. Its own inverse.
  RotaryPair counted(const RotaryPair& iso) const;

  double tool_length() const { return tool_length_; }

 private:
  KinematicsParams params_;
  double tool_length_;
  Vec3 p_MW_;
  Vec3 p_AT_;  ///< from the A axis to the controlled point at zero (head)
};

/// Tool axis in workpiece coordinates for ISO 841 rotary positions a, c [rad].
Vec3 tool_axis(double a, double c);

/// Rotary positions for a unit tool axis d, continuous with `previous` (least |dA| + |dC| over both
/// solutions and all turns of C). At the pole (sin A < 1e-4) C keeps its previous value and A is
/// the best for it, so the tool axis may be off by at most 1e-4 rad there.
RotaryPair rotary_from_axis(const Vec3& d, const RotaryPair& previous);

}  // namespace vcnc
