// The rim of equal thickness about a ruled surface: the S-shaped test piece.
//
// Nearest point. With r = S(u,v) - p the foot solves r . S_u = 0 and r . S_v = 0 on the bounded
// patch (a parameter at its bound stays there while the gradient pushes outward). Newton's method
// with the full Hessian, from the hint when the point is near; otherwise from samples of u, where
// the best v on the straight ruling is a closed form, so that every local minimum gets its own
// start. The surface normal is unit(p - M): that of the faces, and of the round ends, foot and
// crown alike. Points of the mid-surface itself have no nearest face; there n is the face normal of
// the hint's side.
//
// Scan path. Face +: u rising, M + rho n with rho = t/2 + r - interference; end at u_max; face -: u
// falling, M - rho n; end at u_min; v by Newton so that the ball centre's z stays exactly at the
// given height. On the ends the centre is M(u_end, v(phi)) + rho e(phi), where e turns from n to -n
// in the plane normal to the end ruling and v(phi) = (z - rho e_z - C0_z) / (C1_z - C0_z) holds z:
// every station keeps the distance rho from the end ruling, and the path is closed and continuous;
// its tangent jumps slightly at the ends' seams, where v starts to move. With the face + to the
// right of rising u, the material is always to the left of travel, so tilt > 0 (the wall leans away
// from the ball) is an open angle and tilt < 0 a closed one. On the faces the direction of travel
// for the tilt is that of the foot curve C0, on the ends that of the ball centre.
#pragma once

#include <vector>

#include "model/geometry/piece.hpp"
#include "model/geometry/ruled_surface.hpp"

namespace vcnc {

class RuledPiece final : public Piece {
 public:
  explicit RuledPiece(const PieceParams& params);

  SurfacePoint nearest(const Vec3& p, const SurfacePoint& hint) const override;
  std::vector<Station> scan_path(double ball_radius, double interference, double z,
                                 double step) const override;
  const PieceParams& params() const override { return params_; }
  const RuledSurface& surface() const { return surface_; }

 private:
  /// Foot on the mid-surface: r = M(u,v) - p.
  struct Foot {
    double u = 0, v = 0;
    Vec3 r = Vec3::Zero();
    bool converged = false;
  };
  Foot refine(const Vec3& p, double u, double v) const;
  Foot search(const Vec3& p) const;

  PieceParams params_;
  RuledSurface surface_;
  struct Sample {
    double u;
    Vec3 c0, ruling;  ///< C0(u), C1(u) - C0(u)
    double inverse_length2;
  };
  std::vector<Sample> samples_;
  double warm_reach_;  ///< up to here from M a local minimum is the nearest point [m]
};

}  // namespace vcnc
