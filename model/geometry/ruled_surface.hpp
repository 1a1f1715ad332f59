// The ruled surface between two B-spline curves, S(u,v) = (1-v) C0(u) + v C1(u).
#pragma once

#include "model/geometry/bspline.hpp"
#include "model/math.hpp"

namespace vcnc {

/// The ruled mid-surface alone.
class RuledSurface {
 public:
  /// Throws std::invalid_argument when the curves do not share their parameter range.
  RuledSurface(BSplineCurve bottom, BSplineCurve top);

  struct Point {
    Vec3 s, s_u, s_v, s_uu, s_uv;  ///< s_vv = 0
  };
  Point eval(double u, double v) const;
  Vec3 normal(double u, double v) const;  ///< unit(S_u x S_v)
  Vec3 ruling(double u) const;            ///< unit(C1 - C0)
  double u_min() const { return bottom_.u_min(); }
  double u_max() const { return bottom_.u_max(); }
  std::size_t span_count() const { return bottom_.span_count(); }

 private:
  BSplineCurve bottom_, top_;
};

}  // namespace vcnc
