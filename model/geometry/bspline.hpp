// Non-rational B-spline curves in space.
#pragma once

#include <cstddef>
#include <vector>

#include "model/math.hpp"

namespace vcnc {

/// C(u) = sum_i N_{i,p}(u) P_i on a non-decreasing knot vector with n + p + 2 knots for n + 1
/// points.
/// Each knot span is turned once into its polynomial about the middle of the span
/// (derivatives of the basis functions: Piegl, Tiller, The NURBS Book, 2nd ed., A2.3), so that
/// eval() is one Horner scheme. Degree 1..7.
class BSplineCurve {
 public:
  /// Throws std::invalid_argument saying what is wrong (degree, too few points, wrong number of
  /// knots, decreasing knots, a knot repeated more than degree + 1 times, non-finite numbers).
  BSplineCurve(int degree, const std::vector<double>& knots, const std::vector<Vec3>& points);

  struct Point {
    Vec3 c, c1, c2;  ///< value, first and second derivative with respect to u
  };
  Point eval(double u) const;  ///< u is clamped to [u_min, u_max]
  double u_min() const { return breaks_.front(); }
  double u_max() const { return breaks_.back(); }
  std::size_t span_count() const { return breaks_.size() - 1; }

 private:
  int degree_;
  std::vector<double> breaks_;      ///< distinct knots from u_min to u_max
  std::vector<Vec3> coefficients_;  ///< per span: degree + 1 Taylor coefficients about its middle
  double spans_per_u_;              ///< first guess of the span: exact for uniform knots
};

}  // namespace vcnc
