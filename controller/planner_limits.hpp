// How fast a path may be run through at each of its points.
//
// With q(s) the axis positions along the path, v = ds/dt, a = dv/dt, j = da/dt:
//   dq/dt = q' v,   d2q/dt2 = q'' v^2 + q' a,   d3q/dt3 = q''' v^3 + 3 q'' v a + q' j
// Part of each limit (velocity V, acceleration A, jerk J of an axis) bounds v alone,
//   |q'| v <= V,   |q''| v^2 <= kCurveShare A,   |q'''| v^3 <= kCurveShare J,
// and what is left at a speed v bounds a. The speed law is a moving average over the time T of one
// with steps in a, so that |j| <= 2 |a| / T:
//   |a| <= (A - |q''| v^2) / |q'|,   |a| <= (J - |q'''| v^3) / (3 |q''| v + 2 |q'| / T)
// With the probe in the spindle v is also bounded by what a crash must not exceed
// (model/safety/probing_speed.hpp), whatever kind of motion it is.
#pragma once

#include <optional>
#include <vector>

#include "controller/path.hpp"
#include "model/machine.hpp"
#include "model/safety/probing_speed.hpp"

namespace vcnc {

/// Limits of all axes as vectors.
struct MotionLimits {
  Coordinates velocity, acceleration, jerk;
  MotionLimits(const Machine& machine, double share);
};

/// Axis positions along a path, and their exact derivative.
struct AxisPoint {
  Coordinates q, dq;
};
AxisPoint axis_point(const FrameMap& map, const PathPoint& point);

/// Largest ds/dt that the programmed feed allows at s, where the path has the derivative dx.
double feed_limit(const Path& path, double s, const Coordinates& dx);

/// What the probe allows while it is in the spindle: of rapids, of turning axes, of blends.
std::optional<ProbingLimit> probing_limit(const Machine& machine);

/// Largest ds/dt that feed and probe allow at s, where the path has the derivative dx.
double speed_limit(const Path& path, double s, const Coordinates& dx, const AxisPoint& axes,
                   const std::optional<ProbingLimit>& probing);

struct LimitNode {
  double s = 0;
  double v_max = 0;        ///< by feed and by the parts of the limits named above [m/s]
  Coordinates d1, d2, d3;  ///< |q'|, |q''|, |q'''|, the largest around this node
  double a_scale = 1;      ///< lowered where the verification found too much

  /// Largest |a| at speed v; not below 0.
  double acceleration(double v, double window, const MotionLimits& limits) const;
};

/// Nodes from `from` to where the path is settled, as dense as the path is sharp.
std::vector<LimitNode> limit_nodes(const Path& path, const FrameMap& map,
                                   const MotionLimits& limits,
                                   const std::optional<ProbingLimit>& probing = {},
                                   double from = 0);

/// Goes on with the nodes of a path that was extended.
void extend_nodes(const Path& path, const FrameMap& map, const MotionLimits& limits,
                  const std::optional<ProbingLimit>& probing, std::vector<LimitNode>& nodes);

}  // namespace vcnc
