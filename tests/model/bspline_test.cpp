#include "model/geometry/bspline.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace vcnc::bspline_test {
namespace {

// Cox-de Boor recursion, straight from the definition.
double basis(const std::vector<double>& knots, std::size_t i, int p, double u) {
  if (p == 0) {
    const bool last = u == knots.back() && knots[i] < u && knots[i + 1] == u;
    return (knots[i] <= u && u < knots[i + 1]) || last ? 1.0 : 0.0;
  }
  const auto order = static_cast<std::size_t>(p);
  const double a = knots[i + order] - knots[i], b = knots[i + order + 1] - knots[i + 1];
  double value = 0;
  if (a > 0) value += (u - knots[i]) / a * basis(knots, i, p - 1, u);
  if (b > 0) value += (knots[i + order + 1] - u) / b * basis(knots, i + 1, p - 1, u);
  return value;
}

struct Example {
  int degree;
  std::vector<double> knots;
  std::vector<Vec3> points;
};

std::vector<Example> examples() {
  const std::vector<Vec3> eight{{5, 0, 0},   {-10, 20, 0}, {10, 20, 0}, {20, 30, 0},
                                {30, 30, 1}, {40, 30, 4},  {50, 20, 0}, {55, 0, 0}};
  return {{3, {0, 0, 0, 0, .2, .4, .6, .8, 1, 1, 1, 1}, eight},
          {2, {0, 0, 0, .1, .15, .5, .5, .8, 1, 1, 1}, eight},  // uneven, one double knot
          {1, {0, 0, .1, .2, .5, .6, .7, .9, 1, 1}, eight},
          {5, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}, eight},  // not clamped
          {7, {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1}, eight}};
}

TEST(BSpline, MatchesTheDefinition) {
  for (const Example& e : examples()) {
    const BSplineCurve curve(e.degree, e.knots, e.points);
    for (int k = 0; k <= 400; ++k) {
      const double u = curve.u_min() + (curve.u_max() - curve.u_min()) * k / 400;
      if (k == 400 && e.degree == 5) continue;  // the definition is half open there
      Vec3 expected = Vec3::Zero();
      for (std::size_t i = 0; i < e.points.size(); ++i)
        expected += basis(e.knots, i, e.degree, u) * e.points[i];
      ASSERT_LT((curve.eval(u).c - expected).norm(), 1e-11) << "degree " << e.degree << ", u " << u;
    }
  }
}

TEST(BSpline, DerivativesMatchDifferences) {
  for (const Example& e : examples()) {
    const BSplineCurve curve(e.degree, e.knots, e.points);
    const double range = curve.u_max() - curve.u_min(), h = 1e-6 * range;
    for (int k = 0; k < 97; ++k) {
      const double u = curve.u_min() + range * (k + 0.377) / 97;
      const auto low = curve.eval(u - h), mid = curve.eval(u), high = curve.eval(u + h);
      ASSERT_LT((mid.c1 - (high.c - low.c) / (2 * h)).norm(), 1e-5 / range) << e.degree;
      if (e.degree > 1)
        ASSERT_LT((mid.c2 - (high.c1 - low.c1) / (2 * h)).norm(), 1e-3 / (range * range))
            << e.degree;
      else
        ASSERT_EQ(mid.c2, Vec3::Zero());
    }
  }
}

TEST(BSpline, ClampedEndsAndTangents) {
  const Example e = examples()[0];
  const BSplineCurve curve(e.degree, e.knots, e.points);
  EXPECT_LT((curve.eval(0).c - e.points.front()).norm(), 1e-13);
  EXPECT_LT((curve.eval(1).c - e.points.back()).norm(), 1e-13);
  EXPECT_LT((curve.eval(0).c1 - 3 * (e.points[1] - e.points[0]) / 0.2).norm(), 1e-11);
  EXPECT_EQ(curve.eval(-1).c, curve.eval(0).c);
  EXPECT_EQ(curve.eval(2).c, curve.eval(1).c);
}

TEST(BSpline, CubicIsSmoothAcrossKnots) {
  const Example e = examples()[0];
  const BSplineCurve curve(e.degree, e.knots, e.points);
  for (const double knot : {.2, .4, .6, .8}) {
    const auto below = curve.eval(std::nextafter(knot, 0)), above = curve.eval(knot);
    EXPECT_LT((below.c - above.c).norm(), 1e-13);
    EXPECT_LT((below.c1 - above.c1).norm(), 1e-11);
    EXPECT_LT((below.c2 - above.c2).norm(), 1e-9);
  }
}

TEST(BSpline, ReproducesAPolynomial) {
  // Bezier points of (t, t^2, t^3) in degree 3.
  const BSplineCurve curve(3, {0, 0, 0, 0, 1, 1, 1, 1},
                           {{0, 0, 0}, {1. / 3, 0, 0}, {2. / 3, 1. / 3, 0}, {1, 1, 1}});
  for (double t = 0; t <= 1; t += 0.01) {
    const auto p = curve.eval(t);
    EXPECT_LT((p.c - Vec3(t, t * t, t * t * t)).norm(), 1e-15);
    EXPECT_LT((p.c1 - Vec3(1, 2 * t, 3 * t * t)).norm(), 1e-14);
    EXPECT_LT((p.c2 - Vec3(0, 2, 6 * t)).norm(), 1e-14);
  }
}

std::string reason(int degree, const std::vector<double>& knots, std::size_t points) {
  try {
    BSplineCurve(degree, knots, std::vector<Vec3>(points, Vec3::Zero()));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(BSpline, SaysWhatIsWrong) {
  EXPECT_EQ(reason(0, {0, 1}, 1), "B-spline degree is 0; allowed are 1 to 7");
  EXPECT_EQ(reason(8, {0, 1}, 1), "B-spline degree is 8; allowed are 1 to 7");
  EXPECT_EQ(reason(3, {0, 0, 0, 0, 1, 1, 1, 1}, 3),
            "a B-spline of degree 3 needs at least 4 control points, there are 3");
  EXPECT_EQ(reason(3, {0, 0, 0, 0, 1, 1, 1}, 4),
            "a B-spline of degree 3 with 4 control points needs 8 knots, there are 7");
  EXPECT_EQ(reason(1, {0, 0, 1, .5, 2}, 3), "knot 3 decreases");
  EXPECT_EQ(reason(1, {0, 0, 0, 1, 1}, 3), "knot 2 is repeated more than degree + 1 times");
  EXPECT_EQ(reason(1, {0, 0, std::nan(""), 1, 1}, 3), "knot 2 is not a number");
  EXPECT_EQ(reason(1, {0, 0, .5, 1, 1}, 3), "accepted");
}

}  // namespace
}  // namespace vcnc::bspline_test
