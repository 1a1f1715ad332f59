#include "model/geometry/bspline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace vcnc {
namespace {

constexpr int kMaxDegree = 7;

void check(int degree, const std::vector<double>& knots, const std::vector<Vec3>& points) {
  const auto fail = [](const std::string& text) { throw std::invalid_argument(text); };
  if (degree < 1 || degree > kMaxDegree)
    fail("B-spline degree is " + std::to_string(degree) + "; allowed are 1 to 7");
  const auto order = static_cast<std::size_t>(degree) + 1;
  if (points.size() < order)
    fail("a B-spline of degree " + std::to_string(degree) + " needs at least " +
         std::to_string(order) + " control points, there are " + std::to_string(points.size()));
  if (knots.size() != points.size() + order)
    fail("a B-spline of degree " + std::to_string(degree) + " with " +
         std::to_string(points.size()) + " control points needs " +
         std::to_string(points.size() + order) + " knots, there are " +
         std::to_string(knots.size()));
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (!std::isfinite(knots[i])) fail("knot " + std::to_string(i) + " is not a number");
    if (i > 0 && knots[i] < knots[i - 1]) fail("knot " + std::to_string(i) + " decreases");
    if (i >= order && knots[i] == knots[i - order])
      fail("knot " + std::to_string(i) + " is repeated more than degree + 1 times");
  }
  for (const Vec3& p : points)
    if (!p.allFinite()) fail("a control point is not a number");
  if (!(knots[points.size()] > knots[order - 1])) fail("the knots leave no span for the curve");
}

// k-th derivative at u inside the knot span [knots[span], knots[span + 1]]: differences of the
// control points give the derivative's own control points, de Boor's recursion evaluates them.
Vec3 derivative(int degree, const std::vector<double>& knots, const std::vector<Vec3>& points,
                std::size_t span, double u, int k) {
  const auto p = static_cast<std::size_t>(degree), order = static_cast<std::size_t>(k);
  std::array<Vec3, kMaxDegree + 1> d;
  for (std::size_t j = 0; j <= p; ++j) d[j] = points[span - p + j];
  for (std::size_t r = 1; r <= p; ++r) {
    const bool difference = r <= order;
    for (std::size_t j = p; j >= r; --j) {
      // Differences shorten the support from the outside, so both recursions share these knots when
      // the differences come first.
      const std::size_t i = span - p + j;
      const double low = knots[i], width = knots[i + p + 1 - r] - low;
      if (difference) {
        d[j] = static_cast<double>(p + 1 - r) * (d[j] - d[j - 1]) / width;
      } else {
        const double t = (u - low) / width;
        d[j] = (1 - t) * d[j - 1] + t * d[j];
      }
    }
  }
  return d[p];
}

}  // namespace

BSplineCurve::BSplineCurve(int degree, const std::vector<double>& knots,
                           const std::vector<Vec3>& points)
    : degree_(degree), spans_per_u_(0) {
  check(degree, knots, points);
  const auto p = static_cast<std::size_t>(degree);
  breaks_.push_back(knots[p]);
  for (std::size_t span = p; span < points.size(); ++span) {
    if (knots[span + 1] == knots[span]) continue;
    const double middle = 0.5 * (knots[span] + knots[span + 1]);
    double factorial = 1;
    for (int k = 0; k <= degree; ++k) {
      if (k > 0) factorial *= k;
      coefficients_.push_back(derivative(degree, knots, points, span, middle, k) / factorial);
    }
    breaks_.push_back(knots[span + 1]);
  }
  spans_per_u_ = static_cast<double>(span_count()) / (u_max() - u_min());
}

BSplineCurve::Point BSplineCurve::eval(double u) const {
  u = std::clamp(u, u_min(), u_max());
  const double place = (u - u_min()) * spans_per_u_, last = static_cast<double>(span_count() - 1);
  auto i = place > 0 ? static_cast<std::size_t>(std::min(place, last)) : 0;  // 0 if not a number
  while (u < breaks_[i]) --i;
  while (i + 1 < span_count() && u >= breaks_[i + 1]) ++i;

  const auto order = static_cast<std::size_t>(degree_) + 1;
  const Vec3* a = coefficients_.data() + i * order;
  const double t = u - 0.5 * (breaks_[i] + breaks_[i + 1]);
  Vec3 c = a[order - 1], c1 = Vec3::Zero(), half_c2 = Vec3::Zero();
  for (std::size_t k = order - 1; k-- > 0;) {
    half_c2 = half_c2 * t + c1;
    c1 = c1 * t + c;
    c = c * t + a[k];
  }
  return {c, c1, 2 * half_c2};
}

}  // namespace vcnc
