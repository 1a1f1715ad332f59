#include "controller/path.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::path_test {
namespace {

constexpr double kAngleTolerance = 0.01 * kDegree;

Coordinates at(double x, double y, double z = 0, double a = 0, double c = 0) {
  Coordinates result;
  result << x, y, z, a, c;
  return result;
}

Move line(const Coordinates& start, const Coordinates& end, double tolerance = 10e-6) {
  Move move;
  move.start = start;
  move.end = end;
  move.feed_mode = Move::Feed::tip;
  move.feed = 0.05;
  move.tolerance = tolerance;
  return move;
}

std::vector<Move> polyline(const std::vector<Coordinates>& points, double tolerance = 10e-6) {
  std::vector<Move> moves;
  for (std::size_t i = 1; i < points.size(); ++i)
    moves.push_back(line(points[i - 1], points[i], tolerance));
  return moves;
}

Move circle(double radius, double sweep, double pitch = 0) {
  Move move = line(at(radius, 0), at(radius * std::cos(sweep), radius * std::sin(sweep), pitch));
  move.kind = Move::Kind::arc;
  move.arc = {Vec3::Zero(), kZ, sweep};
  return move;
}

/// Distance of a point from a polyline.
double distance(const Vec3& p, const std::vector<Move>& moves) {
  double best = 1e9;
  for (const Move& move : moves) {
    const Vec3 a = move.start.head<3>(), d = move.end.head<3>() - a;
    const double share = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (p - a - share * d).norm());
  }
  return best;
}

TEST(Path, ALineStaysALine) {
  const Path path({line(at(0, 0, 0), at(0.03, 0.04, 0, 0.5, 0.1))}, kAngleTolerance);
  EXPECT_DOUBLE_EQ(path.length(), 0.05);
  for (int i = 0; i <= 100; ++i) {
    const double share = i / 100.0;
    const PathPoint point = path.eval(share * path.length());
    const Coordinates end = at(0.03, 0.04, 0, 0.5, 0.1);
    EXPECT_LE((point.x - share * end).norm(), 1e-15);
    EXPECT_LE((point.dx - end / 0.05).norm(), 1e-11);
  }
}

TEST(Path, TheLengthIsThatOfTheControlledPoint) {
  EXPECT_DOUBLE_EQ(Path({line(at(0, 0), at(0.1, 0, 0, 1, 1))}, kAngleTolerance).length(), 0.1);
  EXPECT_DOUBLE_EQ(Path({line(at(0, 0), at(0, 0, 0, 0, 2))}, kAngleTolerance).length(),
                   2 * Path::kRotaryLength);
  EXPECT_DOUBLE_EQ(Path({circle(0.05, kPi)}, kAngleTolerance).length(), 0.05 * kPi);
}

TEST(Path, ACornerIsRoundedByTheTolerance) {
  for (const double degrees : {5.0, 45.0, 90.0, 150.0}) {
    const double turn = degrees * kDegree, tolerance = 8e-6;
    const auto moves = polyline(
        {at(-0.05, 0), at(0, 0), at(0.05 * std::cos(turn), 0.05 * std::sin(turn))}, tolerance);
    const Path path(moves, kAngleTolerance);
    // |x - r| = |t2 - t1| h / 6 at the corner, exactly.
    const double h = path.half_width(0.05);
    const double jump = 2 * std::sin(turn / 2);
    const double deviation = path.eval(0.05).x.head<3>().norm();
    EXPECT_NEAR(deviation, jump * h / 6, 0.02 * deviation);
    EXPECT_LE(deviation, tolerance);
    if (h < 0.9 * Path::kLargestWidth) {
      EXPECT_GE(deviation, 0.6 * tolerance);
    }
  }
}

TEST(Path, EndPointsAreExact) {
  const auto moves = polyline({at(0, 0), at(1e-4, 0), at(1e-4, 2e-4), at(0.01, 0.02, 0.03, 1, 2)});
  const Path path(moves, kAngleTolerance);
  EXPECT_LE((path.eval(0).x - moves.front().start).norm(), 1e-15);
  EXPECT_LE((path.eval(path.length()).x - moves.back().end).norm(), 1e-15);
}

TEST(Path, ACircleKeepsItsRadius) {
  for (const double radius : {1e-3, 0.02, 0.1, 0.5}) {
    const Path path({circle(radius, 2 * kPi)}, kAngleTolerance);
    for (int i = 0; i <= 1000; ++i) {
      const Vec3 p = path.eval(path.length() * i / 1000).x.head<3>();
      EXPECT_NEAR(p.norm(), radius, 1.2 * Path::kArcTolerance);
    }
  }
}

TEST(Path, TheAverageOfACircleHasTheClosedForm) {
  // A hat of half width h shrinks a circle of radius R to R sinc^2(h / 2R).
  const double radius = 0.05;
  const Path path({circle(radius, 2 * kPi)}, kAngleTolerance);
  const double s = path.length() / 2, half = path.half_width(s) / (2 * radius);
  const double expected = radius * std::pow(std::sin(half) / half, 2);
  EXPECT_NEAR(path.eval(s).x.head<3>().norm(), expected, 1e-14);
}

TEST(Path, AHelixRisesEvenly) {
  const Path path({circle(0.02, 4, 0.01)}, kAngleTolerance);
  EXPECT_NEAR(path.length(), std::hypot(0.08, 0.01), 1e-15);
  for (int i = 1; i < 50; ++i)
    EXPECT_NEAR(path.eval(path.length() * i / 50).x[kZ], 0.01 * i / 50, 1e-15);
}

/// A chain of points on an S-like curve, with the rotary axes turning along.
std::vector<Move> dense_curve(double spacing, double tolerance) {
  std::vector<Coordinates> points;
  for (double t = 0; t <= 1; t += spacing / 0.2)
    points.push_back(at(0.1 * std::sin(2 * kPi * t), 0.05 * std::sin(4 * kPi * t), 0,
                        0.1 + 0.05 * std::sin(2 * kPi * t), 2 * t));
  return polyline(points, tolerance);
}

TEST(Path, DensePointsStayWithinTheTolerance) {
  for (const double tolerance : {1e-6, 10e-6, 100e-6}) {
    const auto moves = dense_curve(3e-4, tolerance);
    const Path path(moves, kAngleTolerance);
    double worst = 0;
    for (double s = 0; s < path.length(); s += 1.07e-4) {
      const PathPoint point = path.eval(s);
      worst = std::max(worst, distance(point.x.head<3>(), moves));
      const Coordinates off = point.x - path.programmed(s).x;
      EXPECT_LE(off.tail<2>().norm(), 1.1 * kAngleTolerance);
    }
    EXPECT_LE(worst, tolerance) << tolerance;
  }
}

TEST(Path, DensePointsComeOutSmooth) {
  // The curvature of the smooth curve follows that of the curve the points were taken from: the
  // polyline's own corners (7 mrad every 0.3 mm) have disappeared.
  std::vector<Coordinates> points;
  const double radius = 0.044, step = 3e-4 / radius;
  for (int i = 0; i * step < 2; ++i)
    points.push_back(at(radius * std::cos(i * step), radius * std::sin(i * step)));
  const Path path(polyline(points, 10e-6), kAngleTolerance);
  const double e = 2e-5;
  for (double s = 0.01; s < path.length() - 0.01; s += 7.3e-5) {
    const Coordinates curvature = (path.eval(s + e).dx - path.eval(s - e).dx) / (2 * e);
    EXPECT_NEAR(curvature.norm() * radius, 1, 0.03);
  }
}

TEST(Path, TheDerivativeIsTheDerivative) {
  std::vector<Move> moves = dense_curve(3e-3, 10e-6);
  const Coordinates last = moves.back().end;
  moves.push_back(line(last, last + at(0.01, -0.02, 0.005)));
  Move arc = line(moves.back().end, moves.back().end + at(0.01, 0.01));
  arc.kind = Move::Kind::arc;
  arc.arc = {Vec3(arc.start[0], arc.start[1] + 0.01, 0), kZ, kPi / 2};
  moves.push_back(arc);
  const Path path(moves, kAngleTolerance);
  for (double s = 1e-4; s < path.length() - 1e-4; s += 9.7e-5) {
    const double e = std::min(1e-6, 0.02 * path.half_width(s));
    const Coordinates difference = (path.eval(s + e).x - path.eval(s - e).x) / (2 * e);
    EXPECT_LE((difference - path.eval(s).dx).cwiseAbs().maxCoeff(), 2e-3 * (1 + difference.norm()))
        << s;
  }
}

TEST(Path, IsContinuousToTheSecondDerivative) {
  const auto moves =
      polyline({at(0, 0), at(0.01, 0), at(0.01, 0.01), at(0.0101, 0.0102), at(0.03, 0.01)});
  const Path path(moves, kAngleTolerance);
  for (double s = 0; s < path.length();) {
    const double h = path.half_width(s), e = 1e-3 * h;
    const Coordinates d1 = path.eval(s).dx, d2 = path.eval(s + e).dx;
    // |t2 - t1| / h bounds the second derivative of the average (2: tangents turn back at most),
    // the changing width adds its share.
    EXPECT_LE((d2 - d1).norm(), 3 * e / h) << s;
    s += 0.05 * h;
  }
}

TEST(Path, ExactPathsKeepHalfAMicrometre) {
  auto moves = polyline({at(0, 0), at(0.02, 0), at(0.04, 0.0003)});  // 0.86 deg
  for (Move& move : moves) move.exact = true;
  const Path path(moves, kAngleTolerance);
  double worst = 0;
  for (double s = 0.019; s < 0.021; s += 1e-6)
    worst = std::max(worst, distance(path.eval(s).x.head<3>(), moves));
  EXPECT_LE(worst, 0.5e-6);
  EXPECT_GE(worst, 0.1e-6);
}

TEST(Path, RotaryToleranceHoldsForPureTurns) {
  const auto moves = polyline({at(0, 0), at(0, 0, 0, 0.5, 0), at(0, 0, 0, 0.5, 0.7)});
  const Path path(moves, kAngleTolerance);
  double worst = 0;
  for (double s = 0; s < path.length(); s += 1e-6)
    worst = std::max(worst, (path.eval(s).x - path.programmed(s).x).tail<2>().norm());
  EXPECT_LE(worst, kAngleTolerance);
  EXPECT_GE(worst, 0.5 * kAngleTolerance);
}

}  // namespace
}  // namespace vcnc::path_test
