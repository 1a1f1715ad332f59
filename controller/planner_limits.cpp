#include "controller/planner_limits.hpp"

#include <algorithm>
#include <cmath>

#include "bus/tick.hpp"

namespace vcnc {
namespace {

constexpr double kCurveShare = 0.7;
constexpr double kLargestStep = 1e-3;  ///< [m]
constexpr double kFewestSteps = 32;
constexpr double kStepsPerWidth = 4;
constexpr double kReactionCycles = 5;  ///< from the deflection to braking axes, measured 3 to 4
constexpr double kRapidShare = 0.95;   ///< of the bound: axes overshoot, feeds are up to people
constexpr double kSlowest = 1e-5;      ///< that the probe can demand [m/s]

}  // namespace

MotionLimits::MotionLimits(const Machine& machine, double share) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisLimits& axis = machine.axes[i].limits;
    const auto row = static_cast<Eigen::Index>(i);
    velocity[row] = share * axis.velocity;
    acceleration[row] = share * axis.acceleration;
    jerk[row] = share * axis.jerk;
  }
}

AxisPoint axis_point(const FrameMap& map, const PathPoint& point) {
  // The inverse kinematics are smooth, so a central difference along the path's tangent is exact
  // to some 1e-10 of the step-free derivative.
  constexpr double kStep = 1e-5;
  const double size = point.dx.norm();
  if (size < 1e-12) return {map.to_axes(point.x), Coordinates::Zero()};
  const double e = kStep / std::max(1.0, size);
  return {map.to_axes(point.x),
          (map.to_axes(point.x + e * point.dx) - map.to_axes(point.x - e * point.dx)) / (2 * e)};
}

double feed_limit(const Path& path, double s, const Coordinates& dx) {
  constexpr double kNone = 1e9, kStill = 1e-9;
  const PathSegment& segment = path.segment(s);
  double pace = 1;
  switch (segment.move.feed_mode) {
    case Move::Feed::none:
      return kNone;
    case Move::Feed::time:
      return segment.length / segment.move.feed;
    case Move::Feed::tip:
      pace = dx.head<3>().norm();
      break;
    case Move::Feed::rotary:
      pace = dx.tail<2>().norm();
      break;
  }
  return pace > kStill ? segment.move.feed / pace : kNone;
}

double LimitNode::acceleration(double v, double window, const MotionLimits& limits) const {
  double a = 1e9;
  for (Eigen::Index i = 0; i < 5; ++i) {
    if (d1[i] > 1e-12) a = std::min(a, (limits.acceleration[i] - d2[i] * v * v) / d1[i]);
    const double per_a = 3 * d2[i] * v + 2 * d1[i] / window;
    if (per_a > 1e-12) a = std::min(a, (limits.jerk[i] - d3[i] * v * v * v) / per_a);
  }
  return a_scale * std::max(a, 0.0);
}

std::optional<ProbingLimit> probing_limit(const Machine& machine) {
  if (!machine.probe.in_spindle) return std::nullopt;
  return ProbingLimit(machine, kReactionCycles * kCycle);
}

double speed_limit(const Path& path, double s, const Coordinates& dx, const AxisPoint& axes,
                   const std::optional<ProbingLimit>& probing) {
  const double feed = feed_limit(path, s, dx);
  if (!probing) return feed;
  const bool rapid = path.segment(s).move.kind == Move::Kind::rapid;
  const double most = probing->at(as_axes(axes.q), as_axes(axes.dq)).factor;
  return std::min(feed, std::max(kSlowest, (rapid ? kRapidShare : 1) * most));
}

std::vector<LimitNode> limit_nodes(const Path& path, const FrameMap& map,
                                   const MotionLimits& limits,
                                   const std::optional<ProbingLimit>& probing, double from) {
  const double length = path.length(), end = path.settled();
  std::vector<LimitNode> nodes;
  std::vector<Coordinates> slope;
  for (double s = from;;) {
    const PathPoint point = path.eval(s);
    const AxisPoint axes = axis_point(map, point);
    slope.push_back(axes.dq);
    LimitNode& node = nodes.emplace_back();
    node.s = s;
    node.v_max = speed_limit(path, s, point.dx, axes, probing);
    if (s >= end) break;
    const double step =
        std::min({path.detail(s) / kStepsPerWidth, kLargestStep, length / kFewestSteps});
    s = end - s < 1.5 * step ? end : s + step;
  }

  // Second and third derivatives by differences of the exact first one; each node then takes the
  // largest values of its neighbourhood.
  const std::size_t n = nodes.size();
  std::vector<Coordinates> second(n - 1), third(n, Coordinates::Zero());
  for (std::size_t j = 0; j + 1 < n; ++j)
    second[j] = (slope[j + 1] - slope[j]) / (nodes[j + 1].s - nodes[j].s);
  for (std::size_t j = 1; j + 1 < n; ++j)
    third[j] = (second[j] - second[j - 1]) * (2 / (nodes[j + 1].s - nodes[j - 1].s));
  for (std::size_t j = 0; j < n; ++j) {
    const std::size_t left = j > 0 ? j - 1 : 0, right = std::min(j + 1, n - 1);
    LimitNode& node = nodes[j];
    node.d1 =
        slope[left].cwiseAbs().cwiseMax(slope[j].cwiseAbs()).cwiseMax(slope[right].cwiseAbs());
    node.d2 =
        second[std::min(left, n - 2)].cwiseAbs().cwiseMax(second[std::min(j, n - 2)].cwiseAbs());
    node.d3 =
        third[left].cwiseAbs().cwiseMax(third[j].cwiseAbs()).cwiseMax(third[right].cwiseAbs());
    for (Eigen::Index i = 0; i < 5; ++i) {
      if (node.d1[i] > 0) node.v_max = std::min(node.v_max, limits.velocity[i] / node.d1[i]);
      if (node.d2[i] > 0)
        node.v_max =
            std::min(node.v_max, std::sqrt(kCurveShare * limits.acceleration[i] / node.d2[i]));
      if (node.d3[i] > 0)
        node.v_max = std::min(node.v_max, std::cbrt(kCurveShare * limits.jerk[i] / node.d3[i]));
    }
  }
  return nodes;
}

void extend_nodes(const Path& path, const FrameMap& map, const MotionLimits& limits,
                  const std::optional<ProbingLimit>& probing, std::vector<LimitNode>& nodes) {
  // The last nodes stood where the path ended then, the first two of the new ones know only one
  // neighbour; the new ones stand where the old ones do.
  constexpr std::size_t kAnew = 4, kOneSided = 2;
  if (nodes.size() < kAnew + kOneSided) {
    nodes = limit_nodes(path, map, limits, probing, nodes.empty() ? 0 : nodes.front().s);
    return;
  }
  const std::size_t kept = nodes.size() - kAnew;
  const std::vector<LimitNode> more =
      limit_nodes(path, map, limits, probing, nodes[kept - kOneSided].s);
  nodes.resize(kept);
  nodes.insert(nodes.end(), more.begin() + kOneSided, more.end());
}

}  // namespace vcnc
