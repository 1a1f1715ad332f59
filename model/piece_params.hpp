// A workpiece as data: what a piece file may hold. Geometry: model/geometry/piece.hpp.
#pragma once

#include <string>
#include <vector>

#include "model/fields.hpp"

namespace vcnc {

struct PieceParams {
  enum class Kind { ruled, ring, sphere, plane, cone };
  std::string name = "unnamed";
  Kind kind = Kind::ruled;

  // ruled: equal-thickness rim about the mid-surface S(u,v) = (1-v) C0(u) + v C1(u)
  int degree = 3;
  std::vector<double> knots;
  std::vector<Vec3> bottom;  ///< control points of C0 [m]
  std::vector<Vec3> top;     ///< control points of C1 [m]
  double thickness = 3e-3;

  // ring, sphere, plane, cone
  Vec3 centre = Vec3::Zero();        ///< centre, or a point of the plane / of the cone's base [m]
  Vec3 direction = Vec3::UnitZ();    ///< axis of ring and cone, outward normal of the plane
  double radius = 50e-3;             ///< of the ring's surface, the sphere, the cone's base
  double height = 40e-3;             ///< of ring and cone
  double half_angle = 15 * kDegree;  ///< of the cone
  bool bore = true;                  ///< ring: probed inside

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("name", p.name, "shown in reports");
    visit.choice("kind", p.kind,
                 {{"ruled", Kind::ruled},
                  {"ring", Kind::ring},
                  {"sphere", Kind::sphere},
                  {"plane", Kind::plane},
                  {"cone", Kind::cone}},
                 "ruled: rim of equal thickness between two B-spline curves");
    visit("degree", p.degree, Range{1, 7}, "ruled: degree of the B-splines");
    visit("knots", p.knots, unit::none, Range{-1e6, 1e6}, "ruled: knot vector, non-decreasing");
    visit("bottom_mm", p.bottom, unit::mm, Range{-1e5, 1e5},
          "ruled: control points of the lower curve");
    visit("top_mm", p.top, unit::mm, Range{-1e5, 1e5}, "ruled: control points of the upper curve");
    visit("thickness_mm", p.thickness, unit::mm, Range{0.1, 100}, "ruled: wall thickness");
    visit("centre_mm", p.centre, unit::mm, Range{-1e5, 1e5},
          "ring, sphere, cone: centre; plane: a point");
    visit("direction", p.direction, unit::none, Range{-1, 1},
          "ring, cone: axis; plane: outward normal");
    visit("radius_mm", p.radius, unit::mm, Range{0.1, 1e5},
          "ring, sphere: radius; cone: radius of its base");
    visit("height_mm", p.height, unit::mm, Range{0.1, 1e5}, "ring, cone: height");
    visit("half_angle_deg", p.half_angle, unit::deg, Range{1, 89},
          "cone: half of its opening angle");
    visit("bore", p.bore, "ring: probed inside (true) or outside");
  }
};

}  // namespace vcnc
