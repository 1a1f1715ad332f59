// Non-rational B-spline curves in space.
#pragma once

#include <span>
#include <vector>

#include "model/math.hpp"

namespace vcnc {

/// C(u) = sum_i N_{i,p}(u) P_i on a non-decreasing knot vector with n + p + 2 knots for n + 1 points.
/// de Boor's algorithm; source: Piegl, Tiller, The NURBS Book, 2nd ed., ch. 2-3.
class BSplineCurve {
 public:
  /// Throws std::invalid_argument saying what is wrong (too few points, wrong number of knots,
  /// decreasing knots, a knot repeated more than degree + 1 times, non-finite numbers).
  BSplineCurve(int degree, std::vector<double> knots, std::vector<Vec3> points);

  struct Point {
    Vec3 c, c1, c2;  ///< value, first and second derivative with respect to u
  };
  Point eval(double u) const;  ///< u is clamped to [u_min, u_max]
  double u_min() const { return knots_[static_cast<std::size_t>(degree_)]; }
  double u_max() const { return knots_[points_.size()]; }

 private:
  int degree_;
  std::vector<double> knots_;
  std::vector<Vec3> points_;
};

}  // namespace vcnc
