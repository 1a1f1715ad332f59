#include "controller/gcode/arc_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/gcode/cursor.hpp"

namespace vcnc {
namespace {

constexpr double kRadiusTolerance = 2e-6, kRadiusToleranceShare = 1e-3;
constexpr double kSamePoint = 1e-9;

}  // namespace

PlanarArc arc_about(const Vec2& start, const Vec2& end, const Vec2& centre, bool clockwise,
                    int turns) {
  const Vec2 r0 = start - centre, r1 = end - centre;
  if (r0.norm() < kSamePoint) throw LineError("arc of radius 0", 0);
  const double mismatch = std::abs(r0.norm() - r1.norm());
  if (mismatch > kRadiusTolerance + kRadiusToleranceShare * r0.norm())
    throw LineError(
        fmt::format("radius mismatch: {:.4f} mm at the start, {:.4f} mm at the end; allowed is a "
                    "difference of 2 um + 0.1 %",
                    r0.norm() * 1e3, r1.norm() * 1e3),
        0);
  double sweep = std::atan2(r0[0] * r1[1] - r0[1] * r1[0], r0.dot(r1));
  const bool closed = (end - start).norm() < kSamePoint;
  if (clockwise)
    sweep = closed ? -2 * kPi : sweep >= 0 ? sweep - 2 * kPi : sweep;
  else
    sweep = closed ? 2 * kPi : sweep <= 0 ? sweep + 2 * kPi : sweep;
  if (turns > 1) sweep += (clockwise ? -2 * kPi : 2 * kPi) * (turns - 1);
  return {centre, sweep};
}

PlanarArc arc_of_radius(const Vec2& start, const Vec2& end, double radius, bool clockwise,
                        int turns) {
  const Vec2 chord = end - start;
  const double half = chord.norm() / 2;
  if (half < kSamePoint)
    throw LineError("arc by R that ends where it starts; give the centre by I J K", 0);
  const double excess = half - std::abs(radius);
  if (excess > kRadiusTolerance + kRadiusToleranceShare * std::abs(radius))
    throw LineError(
        fmt::format("R{:g} is shorter than half the chord, {:.4f} mm", radius * 1e3, half * 1e3),
        0);
  // The centre lies left of the chord for the shorter counter-clockwise arc.
  const double rise = std::sqrt(std::max(0.0, radius * radius - half * half));
  const Vec2 left = Vec2(-chord[1], chord[0]) / (2 * half);
  const Vec2 centre = start + chord / 2 + left * (((radius > 0) != clockwise) ? rise : -rise);
  return arc_about(start, end, centre, clockwise, turns);
}

PlanarArc arc_through(const Vec2& start, const Vec2& via, const Vec2& end) {
  constexpr double kFlat = 1e-9;  // sine of the angle between the chords
  const Vec2 a = via - start, b = end - start;
  const double doubled = a[0] * b[1] - a[1] * b[0];
  if (a.norm() < kSamePoint || b.norm() < kSamePoint || (end - via).norm() < kSamePoint)
    throw LineError("the three points of a circle must lie apart", 0);
  if (std::abs(doubled) < kFlat * a.norm() * b.norm())
    throw LineError("the three points of a circle lie on a line", 0);
  const auto across = [](const Vec2& t) { return Vec2(t[1], -t[0]); };
  const Vec2 centre =
      start + (a.squaredNorm() * across(b) - b.squaredNorm() * across(a)) / (2 * doubled);
  return arc_about(start, end, centre, doubled < 0, 1);
}

}  // namespace vcnc
