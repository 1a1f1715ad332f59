// The scanning probe as a mechanism: a ball on a spring-guided mass that touches a workpiece.
//
// The ball centre is at p = p_WT + R_WT delta in the workpiece frame, delta the deflection in the
// probe frame (parallel to the tool frame), p_WT, R_WT the tool pose. State: p and its velocity v.
// With m = moving mass + stylus, k the spring rate and d = 2 zeta sqrt(k m):
//
//   m v' = -k (p - p_WT) - d (v - v_T) + F_h + lambda
//   v_T       velocity of the tool's controlled point
//   contact   gap = distance(p) - ball radius >= 0,  lambda_n >= 0,  lambda_n gap = 0, no rebound
//   friction  |lambda_t| <= mu lambda_n, opposite to the sliding velocity (Coulomb)
//   F_h       suspension hysteresis: Coulomb friction of the guides, at most k * return_to_zero
//
// Integration: Moreau time stepping at h = 100 us, p1 = p0 + h v1 (symplectic Euler: the spring
// acts from the start of the step, the damper implicitly; stable for every probe within the ranges
// of ProbeParams). The impulses of guides, contact and surface friction follow in turn on the same
// step. The unilateral constraint is imposed on the position at the end of the step: the ball is
// put back along the normal of the nearest point, which is exact for any surface, because the foot
// does not change along its normal. So in lasting contact the ball rests on the surface to
// rounding, and without friction the deflection is the geometric penetration along the normal.
// Across the normal it lags by m a / k behind a tool that accelerates with a along the surface:
// 15 um at 0.3 m/s^2.
//
// Radius, friction mu and hysteresis may be changed by effects (TouchPort), also with the direction
// of the surface. An effect may also lift the piece off the ball; when that ends, the surface comes
// back under the ball: the depth in which the ball lies then decays with 20 ms, slowly enough that
// damper and spring keep the ball on it (2 zeta sqrt(k/m) > 1/20 ms) and no period is lost.
//
// With return_to_zero h the free ball may come to rest anywhere within +-h. Gravity does not
// deflect the ball (the rest position is the zero of the probe), it takes away range: see
// usable_range.
//
// Neglected:
// - Rotation of the probe frame. The suspension turns with the tool, its guides carry the mass
//   along; what is left are the centrifugal force m w^2 |delta| and the Coriolis force
//   2 m w |delta'| on m = 65 g. At w = 164 deg/s, |delta| = 2 mm, |delta'| = 50 mm/s they are at
//   most 1.1 mN + 18.6 mN against 662 mN of the spring at 0.5 mm, the second only in lift-off.
// - Bending of the stylus: 88 um/N (carbide, 50 mm x 2 mm: L^3/(3 E I)), proportional to the
//   deflection and hence part of the calibration; see the effect stylus_bending.
// - Elasticity of the contact (Hertz, below 0.5 um at 0.65 N), and a suspension that is not equally
//   stiff in all directions.
// - End stops: the deflection goes on beyond the range and beyond overtravel as driven.
// Source: scanning probes of the SP600 class (moving mass 55 g, 135 gf/mm); Moreau, Unilateral
// Contact and Dry Friction in Finite Freedom Dynamics, 1988.
//
// Usage in the probe node, once per bus cycle with the true load positions of the five drives:
//
//   for (int j = 0; j < 10; ++j) {                              // every 100 us
//     for (axis) q[axis] = truth[axis].position[j];
//     const Vec3 delta = contact.step(kinematics.forward(q));   // true deflection, probe frame
//     for (c = 0..2) sample[c] = channel[c].sample(delta[c]);   // model/probe/signals.hpp
//   }
#pragma once

#include <cstdint>

#include "model/effects/chain.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// Range of the deflection towards both ends of each probe axis, magnitudes [m].
struct UsableRange {
  Vec3 positive = Vec3::Zero(), negative = Vec3::Zero();

  /// Share of the range that a deflection uses: 1 at its end in the worst direction.
  double share(const Vec3& deflection) const;
  bool contains(const Vec3& deflection) const { return share(deflection) <= 1; }
};

/// The range left when gravity has moved the suspension by dz = weight / spring rate:
///   vertical    along z: the stylus pulls down, dz = m_stylus g / k (the rest is trimmed out)
///   horizontal  along y: dz = (m_moving + m_stylus) g / k
/// The side that gravity pulls to loses dz, the other side gains it. Spring rates of probes are
/// given in grams per millimetre: 135 gf/mm = 1324 N/m, so dz [mm] = m [g] / 135.
UsableRange usable_range(const ProbeParams& probe);

class ProbeContact {
 public:
  /// `piece` may be null (nothing to touch) and must outlive the contact; `effects` are those on
  /// the ball and its contact.
  ProbeContact(const ProbeParams& probe, Chain<TouchPort> effects, const Piece* piece);

  /// Advances by one step of 100 us to the instant in which the tool has this pose; returns the
  /// true deflection in the probe frame [m]. The first call places the ball: at rest, at its zero
  /// or on the surface when the zero is inside the material.
  Vec3 step(const ToolPose& pose);

  bool touching() const { return touching_; }
  /// Contact force on the ball over the last step, workpiece frame [N].
  const Vec3& force() const { return force_; }
  /// Where the ball is, and the surface nearest to it (valid near the piece).
  const Vec3& ball() const { return p_; }
  const SurfacePoint& surface() const { return surface_; }

 private:
  void place(const ToolPose& pose);
  void feel(const ToolPose& pose);
  void put_back();
  void touch(double inertia, Vec3& v);

  ProbeParams probe_;
  Chain<TouchPort> effects_;
  TouchPort::Signal<double> ball_;  ///< radius, friction, ... at this step
  std::int64_t steps_ = 0;
  const Piece* piece_;
  double mass_, damping_;
  bool lifted_ = false;         ///< at the last step
  double sunk_ = 0;             ///< how far the surface is still below its place after lifting [m]
  Vec3 p_ = Vec3::Zero();       ///< ball centre
  Vec3 v_ = Vec3::Zero();       ///< its velocity
  Vec3 p_tool_ = Vec3::Zero();  ///< controlled point at the last step
  SurfacePoint surface_;
  Vec3 searched_ = Vec3::Zero();  ///< where the piece was searched last
  double clearance_ = 0;          ///< and how far the ball may go from there without touching
  Vec3 force_ = Vec3::Zero();
  bool placed_ = false, touching_ = false;
};

}  // namespace vcnc
