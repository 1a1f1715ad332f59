// Workpieces: where the nearest point of the real surface is, and how to walk around them.
//
// The distance is signed: positive outside the material, so a ball of radius r touches where
// distance(centre) = r. Every piece is a closed form but the ruled rim:
//
//   ruled   solid { p : |p - M(u,v)| <= t/2 }, M the mid-surface S(u,v) = (1-v) C0(u) + v C1(u),
//           u in [u_min, u_max], v in [0, 1]. The faces are the parallel surfaces S +- (t/2) n;
//           ends, foot and crown of the wall are round. See model/geometry/ruled_piece.hpp.
//   ring    cylinder about `direction` through `centre`, `height` / 2 to either side of it;
//           bore: a hole in a plate without outer edge; else a boss
//   sphere  about `centre`
//   plane   half space below `centre`, outward normal `direction`
//   cone    frustum on a base of `radius` at `centre`, axis `direction`
//
// Height z of a scan path:
//
//   ruled, sphere, plane   every ball centre has this z (a level plane is scanned along x and has a
//                          z of its own)
//   ring, cone             the path is a circle in the plane normal to the axis through the axis
//                          point with this z; the axis must be within 60 deg of the z axis
//
// A plane is scanned along a straight line of length 2 `radius` about `centre`.
#pragma once

#include <memory>
#include <vector>

#include "model/geometry/ruled_surface.hpp"
#include "model/math.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

/// Nearest point of a surface.
struct SurfacePoint {
  double distance = 0;       ///< signed distance of the query point [m]
  Vec3 n = Vec3::UnitZ();    ///< outward unit normal, from the material to the probe
  Vec3 foot = Vec3::Zero();  ///< the nearest surface point
  double u = 0, v = 0;       ///< parameters of the foot on a ruled piece
  bool valid = false;        ///< Newton converged (always true for closed forms)
};

/// One station of a scan path: the ball touches the surface here.
struct Station {
  double s = 0;     ///< arc length of the ball-centre path from its start [m]
  Vec3 centre;      ///< ball centre [m]
  Vec3 n;           ///< outward surface normal
  Vec3 tool_axis;   ///< unit tool axis of the finishing program
  double tilt = 0;  ///< ruled: signed angle of the ruling to the left of travel [rad]; else 0
};

class Piece {
 public:
  virtual ~Piece() = default;
  /// `hint` is the previous result for a nearby point; a default-constructed one starts anew.
  virtual SurfacePoint nearest(const Vec3& p, const SurfacePoint& hint) const = 0;
  /// Closed (or, for the plane, open) path of a ball of radius r whose centre keeps the distance
  /// r - interference from the surface, parallel to the base plane at height z (where it applies),
  /// with stations no further apart than `step` [m]; the last station of a closed path coincides
  /// with the first. Throws std::invalid_argument when there is no such path.
  virtual std::vector<Station> scan_path(double ball_radius, double interference, double z,
                                         double step) const = 0;
  /// The height z for which scan_path() runs through a ball centre at p.
  virtual double scan_height(const Vec3& p) const { return p.z(); }
  virtual const PieceParams& params() const = 0;
};

/// Builds a piece. Throws std::invalid_argument with the key that is wrong.
std::unique_ptr<Piece> make_piece(const PieceParams& params);

}  // namespace vcnc
