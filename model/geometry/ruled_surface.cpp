#include "model/geometry/ruled_surface.hpp"

#include <stdexcept>
#include <utility>

namespace vcnc {

RuledSurface::RuledSurface(BSplineCurve bottom, BSplineCurve top)
    : bottom_(std::move(bottom)), top_(std::move(top)) {
  if (bottom_.u_min() != top_.u_min() || bottom_.u_max() != top_.u_max())
    throw std::invalid_argument(
        "the two curves of a ruled surface must share their parameter range");
}

RuledSurface::Point RuledSurface::eval(double u, double v) const {
  const BSplineCurve::Point a = bottom_.eval(u), b = top_.eval(u);
  return {a.c + v * (b.c - a.c), a.c1 + v * (b.c1 - a.c1), b.c - a.c, a.c2 + v * (b.c2 - a.c2),
          b.c1 - a.c1};
}

Vec3 RuledSurface::normal(double u, double v) const {
  const Point p = eval(u, v);
  return p.s_u.cross(p.s_v).normalized();
}

Vec3 RuledSurface::ruling(double u) const {
  return (top_.eval(u).c - bottom_.eval(u).c).normalized();
}

}  // namespace vcnc
