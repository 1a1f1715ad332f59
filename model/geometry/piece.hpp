// Workpieces: where the nearest point of the real surface is, and how to walk around them.
//
// The distance is signed: positive outside the material, so a ball of radius r touches where
// distance(centre) = r. Every piece is a closed form but the ruled rim:
//
//   ruled   solid { p : |p - M(u,v)| <= t/2 }, M the mid-surface S(u,v) = (1-v) C0(u) + v C1(u), u in
//           [u_min, u_max], v in [0, 1]. The faces are the parallel surfaces S +- (t/2) n; the ends are
//           round caps about the end rulings. Closest point by Newton on
//           (p - S) . S_u = 0, (p - S) . S_v = 0, started from the previous one.
//   ring    cylinder about `direction`, probed inside (bore) or outside
//   sphere, plane, cone
#pragma once

#include <memory>
#include <vector>

#include "model/geometry/bspline.hpp"
#include "model/math.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

/// Nearest point of a surface.
struct SurfacePoint {
  double distance = 0;       ///< signed distance of the query point [m]
  Vec3 n = Vec3::UnitZ();    ///< outward unit normal, from the material to the probe
  Vec3 foot = Vec3::Zero();  ///< the nearest surface point
  double u = 0, v = 0;       ///< parameters of the foot (ruled), else angle/height where they make sense
  bool valid = false;        ///< Newton converged (always true for closed forms)
};

/// One station of a scan path: the ball touches the surface here.
struct Station {
  double s = 0;      ///< arc length of the ball-centre path from its start [m]
  Vec3 centre;       ///< ball centre [m]
  Vec3 n;            ///< outward surface normal
  Vec3 tool_axis;    ///< unit tool axis of the finishing program
  double tilt = 0;   ///< ruled: signed angle of the ruling to the left of travel [rad]; else 0
};

class Piece {
 public:
  virtual ~Piece() = default;
  /// `hint` is the previous result for a nearby point; a default-constructed one starts anew.
  virtual SurfacePoint nearest(const Vec3& p, const SurfacePoint& hint) const = 0;
  /// Closed (or, for the plane, open) path of a ball of radius r whose centre keeps the distance
  /// r - interference from the surface, parallel to the base plane at height z (where it applies),
  /// sampled about every `step` [m]; the last station of a closed path coincides with the first.
  virtual std::vector<Station> scan_path(double ball_radius, double interference, double z, double step) const = 0;
  virtual const PieceParams& params() const = 0;
};

/// Builds a piece. Throws std::invalid_argument with the key that is wrong.
std::unique_ptr<Piece> make_piece(const PieceParams& params);

/// The ruled mid-surface alone.
class RuledSurface {
 public:
  RuledSurface(BSplineCurve bottom, BSplineCurve top);
  struct Point {
    Vec3 s, s_u, s_v, s_uu, s_uv;  ///< s_vv = 0
  };
  Point eval(double u, double v) const;
  Vec3 normal(double u, double v) const;  ///< unit(S_u x S_v)
  Vec3 ruling(double u) const;            ///< unit(C1 - C0)
  double u_min() const { return bottom_.u_min(); }
  double u_max() const { return bottom_.u_max(); }

 private:
  BSplineCurve bottom_, top_;
};

}  // namespace vcnc
