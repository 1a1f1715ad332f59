// The dynamic error of one instant: what the probe says about the machine, and how it splits up.
//
// Frames: W workpiece, T tool = probe. FK is the forward kinematics of the declared machine with
// the declared tool length (gauge line to ball centre) and work offset G54; R = R_WT(q_act).
//
//   T_th  = FK(q_cmd)            theoretical path of the ball centre
//   T_act = T_th + R delta       actual path by the definition of the inspection method
//   E     = R delta              their difference, delta = deflection in the probe frame
//   b     = FK(q_act) + R delta  where the ball centre is by the measuring systems
//   n     = outward surface normal (from the material to the probe) at the foot of b
//
// The program drives the ball centre delta0 deeper than contact (setup.predeflection), so that a
// perfect machine deflects the probe by delta0 along n. With D(p) the signed distance of p from the
// declared piece and r_b the ball radius, contact without friction gives
//   n . (R delta) = r_b - D(p_true),     p_true = the true undeflected ball centre.
//
//   e_n     = delta0 - n . (R delta)           = D(p_true) - (r_b - delta0)
//   e_plan  = D(FK(q_cmd)) - (r_b - delta0)    what interpolation and blending planned
//   e_servo = D(FK(q_act)) - D(FK(q_cmd))      contour part of the following error
//   e_rest  = e_n - e_plan - e_servo           geometry, structure, form of the piece, probe
//
// All in metres; + = the machine is away from the part. A true tip that is shifted by +5 um along n
// gives e_n = +5 um.
//
// Tracking error e_t = FK(q_act) - FK(q_cmd); lag = e_t . tau along the direction of travel tau
// (negative: behind), cross = |e_t - lag tau|. Share of axis j in the error along n, to first
// order: n . J_j (q_act_j - q_cmd_j), with J the Jacobian of FK.
//
// Validity: friction tilts the deflection towards the travel; projection on n removes that to first
// order. The piece counts as nominal. Skew dt between probe and axes shows up as
// delta0 * (turn rate of n) * dt plus the change of e_n within dt.
// Source: the definition T_act = T_th + R delta is the inspection method's own; the split by
// command, encoder and tool-centre-point data follows Andolfatto, Lavernhe, Mayer, Evaluation of
// servo, geometric and dynamic error sources on five-axis high-speed machine tools, Int. J. Mach.
// Tools Manuf. 51 (2011) 787.
#pragma once

#include <memory>

#include "bus/telemetry.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// Whether a sample can be believed.
enum class Contact { ok, no_contact, out_of_range, invalid };

struct ErrorSample {
  Tick tick = 0;
  Vec3 theoretical = Vec3::Zero();  ///< T_th [m]
  Vec3 actual = Vec3::Zero();       ///< T_act [m]
  AxisVector following{};           ///< q_act - q_cmd
  double lag = 0, cross = 0;        ///< tracking error along and across the travel [m]
  double travel = 0;                ///< commanded path since the previous sample [m]

  bool near_piece = false;  ///< everything below holds only then
  Contact contact = Contact::no_contact;
  Vec3 n = Vec3::UnitZ();
  SurfacePoint foot;    ///< nearest surface point of b
  double distance = 0;  ///< D(FK(q_cmd)) [m]
  double e_n = 0, e_plan = 0, e_servo = 0, e_rest = 0;
  AxisVector share{};  ///< of each axis in the error along n [m]
};

/// Live evaluator: one row in, one sample out, no look-ahead.
class DynamicError {
 public:
  /// `piece` may be null: then only the axes are evaluated.
  DynamicError(const Machine& declared, const Piece* piece);

  ErrorSample evaluate(const TelemetryRow& row);

 private:
  void evaluate_contact(const TelemetryRow& row, const ToolPose& cmd, const ToolPose& act,
                        ErrorSample& sample);
  bool may_touch(const Vec3& p);

  Kinematics kinematics_;
  const Piece* piece_;
  double ball_radius_, predeflection_, min_deflection_;

  SurfacePoint hint_cmd_, hint_act_, hint_ball_;
  bool first_ = true;
  Vec3 previous_ = Vec3::Zero();  ///< previous theoretical position
  Vec3 tangent_ = Vec3::Zero();   ///< last direction of travel
  Vec3 probed_ = Vec3::Zero();    ///< where `clearance_` was found
  double clearance_ = -1;         ///< the piece is at least this far from `probed_`
};

}  // namespace vcnc
