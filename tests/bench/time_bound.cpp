#include "tests/bench/time_bound.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "controller/planner_limits.hpp"

namespace vcnc {
namespace {

constexpr double kLargestStep = 1e-4;  ///< [m]
constexpr double kFewestSteps = 2000;

struct GridPoint {
  double s, b_max;
  Coordinates d1, d2;
};

struct Interval {
  double lo, hi;
  bool empty() const { return lo > hi; }
};

/// The u that the accelerations allow at b, and from which b + 2 u ds stays within [0, limit].
Interval allowed(const GridPoint& p, double b, double ds, double limit, const Coordinates& most) {
  Interval u{-b / (2 * ds), (limit - b) / (2 * ds)};
  for (Eigen::Index i = 0; i < 5; ++i) {
    const double rest = p.d2[i] * b;
    if (std::abs(p.d1[i]) < 1e-12) {
      if (std::abs(rest) > most[i]) return {1, 0};
      continue;
    }
    const double a = (-most[i] - rest) / p.d1[i], c = (most[i] - rest) / p.d1[i];
    u.lo = std::max(u.lo, std::min(a, c));
    u.hi = std::min(u.hi, std::max(a, c));
  }
  return u;
}

std::vector<GridPoint> grid_of(const Path& path, const FrameMap& map, const MotionLimits& limits,
                               double steps_per_width) {
  std::vector<GridPoint> grid;
  const double length = path.length();
  for (double s = 0;;) {
    const PathPoint point = path.eval(s);
    GridPoint& g = grid.emplace_back();
    g.s = s;
    g.d1 = axis_point(map, point).dq;
    const double e = 0.1 * std::min(path.detail(s) / steps_per_width, kLargestStep);
    const double a = std::max(0.0, s - e), b = std::min(length, s + e);
    g.d2 = (axis_point(map, path.eval(b)).dq - axis_point(map, path.eval(a)).dq) / (b - a);
    g.b_max = std::pow(feed_limit(path, s, point.dx), 2);
    for (Eigen::Index i = 0; i < 5; ++i)
      if (std::abs(g.d1[i]) > 1e-12)
        g.b_max = std::min(g.b_max, std::pow(limits.velocity[i] / g.d1[i], 2));
    if (s >= length) break;
    const double step =
        std::min({path.detail(s) / steps_per_width, kLargestStep, length / kFewestSteps});
    s = length - s < 1.5 * step ? length : s + step;
  }
  return grid;
}

}  // namespace

double time_bound(const Path& path, const Machine& machine, double steps_per_width) {
  const FrameMap map(machine.kinematics, path.frame());
  const MotionLimits limits(machine, 1);
  const std::vector<GridPoint> grid = grid_of(path, map, limits, steps_per_width);
  const std::size_t last = grid.size() - 1;

  std::vector<double> reach(grid.size(), 0);
  for (std::size_t j = last; j-- > 0;) {
    const double ds = grid[j + 1].s - grid[j].s;
    const auto possible = [&](double b) {
      return !allowed(grid[j], b, ds, reach[j + 1], limits.acceleration).empty();
    };
    // b = 0 is always possible, and the possible b form an interval.
    double lo = 0, hi = std::min(grid[j].b_max, 1e3);
    if (possible(hi)) {
      lo = hi;
    } else {
      for (int k = 0; k < 50; ++k) (possible(0.5 * (lo + hi)) ? lo : hi) = 0.5 * (lo + hi);
    }
    reach[j] = lo;
  }

  double time = 0, b = 0;
  for (std::size_t j = 0; j < last; ++j) {
    const double ds = grid[j + 1].s - grid[j].s;
    const Interval u = allowed(grid[j], b, ds, reach[j + 1], limits.acceleration);
    const double next = std::clamp(b + 2 * ds * u.hi, 0.0, reach[j + 1]);
    time += 2 * ds / (std::sqrt(b) + std::sqrt(next));
    b = next;
  }
  return time;
}

namespace {

/// Limits along a straight move of X, Y, Z.
struct LineLimits {
  double length, velocity, acceleration, jerk;
  Vec3 direction;
};

LineLimits line_limits(const Move& move, const Machine& machine) {
  const Vec3 way = (move.end - move.start).head<3>();
  LineLimits line{way.norm(), move.feed, 1e9, 1e9, way.normalized()};
  for (const std::size_t i : {kX, kY, kZ}) {
    const double share = std::abs(line.direction[static_cast<Eigen::Index>(i)]);
    if (share < 1e-9) continue;
    const AxisLimits& axis = machine.axes[i].limits;
    line.velocity = std::min(line.velocity, axis.velocity / share);
    line.acceleration = std::min(line.acceleration, axis.acceleration / share);
    line.jerk = std::min(line.jerk, axis.jerk / share);
  }
  return line;
}

double rest_to_rest(const LineLimits& line, bool with_jerk) {
  const double l = line.length, v = line.velocity, a = line.acceleration, j = line.jerk;
  if (!with_jerk) return l >= v * v / a ? l / v + v / a : 2 * std::sqrt(l / a);
  const double ramp = a / j;  // time in which the acceleration rises
  if (v >= a * ramp) {
    if (l >= v * (v / a + ramp)) return l / v + v / a + ramp;
    if (l >= 2 * a * ramp * ramp) return ramp + std::sqrt(ramp * ramp + 4 * l / a);
  } else if (l >= 2 * v * std::sqrt(v / j)) {
    return l / v + 2 * std::sqrt(v / j);
  }
  return 4 * std::cbrt(l / (2 * j));
}

}  // namespace

double time_with_stops(const std::vector<Move>& moves, const Machine& machine, bool with_jerk) {
  double time = 0;
  for (const Move& move : moves) time += rest_to_rest(line_limits(move, machine), with_jerk);
  return time;
}

double trapezoid_time(const std::vector<Move>& moves, const Machine& machine) {
  double time = time_with_stops(moves, machine, false);
  for (std::size_t i = 1; i < moves.size(); ++i) {
    const LineLimits from = line_limits(moves[i - 1], machine), to = line_limits(moves[i], machine);
    const double theta = 0.5 * std::acos(std::clamp(-from.direction.dot(to.direction), -1.0, 1.0));
    const double a = std::min(from.acceleration, to.acceleration);
    // No faster than the peaks of either move.
    const double most =
        std::min({from.velocity, to.velocity, std::sqrt(from.acceleration * from.length),
                  std::sqrt(to.acceleration * to.length)});
    const double v =
        std::min(most, 2 * std::sqrt(a * moves[i].tolerance / std::max(std::cos(theta), 1e-9)));
    time -= v / a;
  }
  return time;
}

}  // namespace vcnc
