// The centre and the swept angle of a circular block.
//
//   centre given   sweep = angle from start to end about it, in the sense of G2/G3, plus P-1 turns
//   radius given   |R| with R > 0: up to half a turn, R < 0: more;
//                  centre = middle of the chord +- sqrt(R^2 - (chord/2)^2) across it
//   three points   c = s + (a^2 perp(b) - b^2 perp(a)) / (2 a x b) with a = via - s, b = end - s,
//                  perp a quarter turn clockwise
// Valid if the radii at start and end agree to 2 um + 0.1 %; within that the arc is a spiral.
// Source: NIST RS274/NGC interpreter, version 3 (NISTIR 6556), 3.5.3.
#pragma once

#include "model/math.hpp"

namespace vcnc {

using Vec2 = Eigen::Vector2d;

struct PlanarArc {
  Vec2 centre = Vec2::Zero();
  double sweep = 0;  ///< [rad], positive counter-clockwise
};

/// `turns` >= 1 counts the turns begun. Both throw LineError (without column) where there is no
/// such arc.
PlanarArc arc_about(const Vec2& start, const Vec2& end, const Vec2& centre, bool clockwise,
                    int turns);
PlanarArc arc_of_radius(const Vec2& start, const Vec2& end, double radius, bool clockwise,
                        int turns);

/// From start by via to end, less than a turn. Throws LineError where they lie on a line.
PlanarArc arc_through(const Vec2& start, const Vec2& via, const Vec2& end);

}  // namespace vcnc
