#include "controller/path_corner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "controller/path.hpp"
#include "controller/planner.hpp"
#include "tests/bench/jerk_bound.hpp"
#include "tests/controller/planned_moves.hpp"

namespace vcnc::path_corner_test {
namespace {

using Shape = PathCorner::Shape;
constexpr double kP = 10e-6;

std::vector<Move> corner(double degrees, double length) {
  const double turn = degrees * kDegree;
  const Coordinates middle = at(0.6 * length, 0.8 * length);
  const Coordinates end = middle + at(length * (0.6 * std::cos(turn) - 0.8 * std::sin(turn)),
                                      length * (0.6 * std::sin(turn) + 0.8 * std::cos(turn)));
  std::vector<Move> moves{line(at(0, 0), middle, 0.3), line(middle, end, 0.3)};
  for (Move& move : moves) move.dynamics = NcParams::Dynamics::fast;
  return moves;
}

/// e of the shape in steps of 1/n from w = -1, by adding up jerk, and with e(0) = 1.
std::vector<double> integrated(double swing, int n) {
  std::vector<double> e{0};
  double v = 0, a = 0;
  const double h = 1.0 / n;
  for (int i = 0; i < 2 * n; ++i) {
    const double j = (i + 0.5) * h < swing ? -1 : 1;
    e.push_back(e.back() + h * (v + h * (0.5 * a + h * j / 6)));
    v += h * (a + 0.5 * j * h);
    a += j * h;
  }
  const double middle = e[static_cast<std::size_t>(n)];
  for (double& value : e) value /= middle;
  return e;
}

TEST(PathCorner, IsTheCurveOfTwoRampsOfConstantJerk) {
  constexpr int kSteps = 20000;
  const double share = 0.186712629589;
  for (const Shape shape : {Shape::swinging, Shape::plain}) {
    const std::vector<double> e = integrated(shape == Shape::swinging ? share : 0, kSteps);
    const PathCorner curve(shape, 3e-6);
    EXPECT_NEAR(curve.reach(), 3e-6 * e.back(), 1e-3 * curve.reach());
    for (std::size_t i = kSteps; i < e.size(); i += 500) {
      const double before = e[2 * kSteps - i], s = 3e-6 * (e[i] - before);
      EXPECT_NEAR(curve.at(s).value, 3e-6 * before, 4e-9) << i;
      EXPECT_DOUBLE_EQ(curve.at(-s).value, curve.at(s).value);
    }
    const double least = *std::min_element(e.begin(), e.end());
    EXPECT_NEAR(least, shape == Shape::swinging ? -1 : 0, 1e-3);
  }
}

TEST(PathCorner, TheSlopeIsTheDerivative) {
  for (const Shape shape : {Shape::swinging, Shape::plain}) {
    const PathCorner curve(shape, 7e-6);
    const double step = 1e-9;
    for (double s = -1.1 * curve.reach(); s < 1.1 * curve.reach(); s += 0.0173 * curve.reach())
      EXPECT_NEAR((curve.at(s + step).value - curve.at(s - step).value) / (2 * step),
                  curve.at(s).slope, 1e-6);
    EXPECT_NEAR(curve.at(1e-12).slope, -0.5, 1e-6);
  }
}

TEST(PathCorner, UsesTheToleranceWhereThereIsRoom) {
  for (const double degrees : {10.0, 45.0, 90.0, 150.0, 180.0}) {
    const Path path(corner(degrees, 0.05), 0.01 * kDegree);
    EXPECT_NEAR((path.eval(0.05).x - path.programmed(0.05).x).norm(), kP, 1e-12) << degrees;
  }
}

TEST(PathCorner, StaysWithinTheToleranceAndSmooth) {
  for (const double degrees : {3.0, 7.0, 30.0, 90.0, 120.0, 170.0})
    for (const double length : {5e-5, 2e-4, 5e-4, 1e-3, 0.02}) {
      const Path path(corner(degrees, length), 0.01 * kDegree);
      const double step = 1e-8;
      const double bend = 6 / std::min(length, 1e-5);  // far above any curvature of these paths
      Coordinates last = path.eval(0).dx;
      const int count = 3000;
      for (int i = 1; i < count; ++i) {
        const double s = path.length() * i / count;
        const PathPoint point = path.eval(s);
        EXPECT_LE((point.x - path.programmed(s).x).norm(), 1.001 * kP) << degrees << " " << length;
        const Coordinates slope = (path.eval(s + step).x - path.eval(s - step).x) / (2 * step);
        EXPECT_LE((slope - point.dx).norm(), 1e-5) << degrees << " " << length << " " << s;
        EXPECT_LE((point.dx - last).norm(), bend * path.length() / count);
        last = point.dx;
      }
    }
}

TEST(PathCorner, SmoothDynamicsKeepTheAverage) {
  std::vector<Move> moves = corner(90, 0.05);
  for (Move& move : moves) move.dynamics = NcParams::Dynamics::smooth;
  const Path path(moves, 0.01 * kDegree);
  const double h = path.half_width(0.05);
  EXPECT_NEAR((path.eval(0.05).x - path.programmed(0.05).x).norm(), std::sqrt(2.0) * h / 6, 1e-7);
  EXPECT_DOUBLE_EQ(path.detail(0.05), h);
}

TEST(PathCorner, ASquareCornerSavesMostOfWhatTheRampsOverlap) {
  const Machine machine = test_machine();
  const double length = 0.03;
  std::vector<Move> moves{line(at(0, 0), at(length, 0), 0.5),
                          line(at(length, 0), at(length, length), 0.5)};
  for (Move& move : moves) move.dynamics = NcParams::Dynamics::fast;
  const auto time_of = [&](std::vector<Move> run) {
    return Trajectory(Path(std::move(run), 0.01 * kDegree), machine).duration();
  };
  const double time = time_of(moves);
  // 28 ms were the jerk constant throughout.
  EXPECT_LT(time, time_of({moves[0]}) + time_of({moves[1]}) - 0.012);
  EXPECT_LT(time, 2 * shortest_time(length) - 0.010);
  EXPECT_GT(time, jerk_bound(moves, machine));
}

TEST(PathCorner, ArcsAreRoundedOnlyNextToTheirJoints) {
  const double radius = 5e-3;
  Move arc = line(at(0.03, 0), at(0.03, 2 * radius), 0.1);
  arc.kind = Move::Kind::arc;
  arc.arc = {Vec3(0.03, radius, 0), kZ, kPi};
  std::vector<Move> moves{line(at(0, 0), at(0.03, 0), 0.1), arc,
                          line(at(0.03, 2 * radius), at(0, 2 * radius), 0.1)};
  for (Move& move : moves) move.dynamics = NcParams::Dynamics::fast;
  const Path path(moves, 0.01 * kDegree);
  double joint = 0, middle = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double share = i / 1000.0;
    const Vec3 p = path.eval(0.03 + kPi * radius * share).x.head<3>() - arc.arc.centre;
    double& worst = share > 0.25 && share < 0.75 ? middle : joint;
    worst = std::max(worst, std::abs(p.norm() - radius));
  }
  EXPECT_LE(middle, 1.2 * Path::kArcTolerance);
  EXPECT_GT(joint, 10 * Path::kArcTolerance);
  EXPECT_LE(joint, kP);
}

TEST(PathCorner, NoArcIsRoundedNextToAnother) {
  Move circle = line(at(0.05, 0), at(0.05, 0), 0.1);
  circle.kind = Move::Kind::arc;
  circle.arc = {Vec3::Zero(), kZ, 2 * kPi};
  circle.dynamics = NcParams::Dynamics::fast;
  const Path path({circle, circle}, 0.01 * kDegree);
  for (int i = 0; i <= 1000; ++i)
    EXPECT_NEAR(path.eval(path.length() * i / 1000).x.head<3>().norm(), 0.05,
                1.2 * Path::kArcTolerance);
}

}  // namespace
}  // namespace vcnc::path_corner_test
