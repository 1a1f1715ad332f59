// Motion of the axes along one run: q(t) with every axis within its velocity, acceleration and
// jerk.
//
// The speed law (planner_law.hpp) is found from the limits along the path (planner_limits.hpp).
// What the axes will then really do is checked: differences of q at the bus cycle up to the third,
// the velocity at each cycle and the feed. Where a limit is exceeded the law is made slower there
// and found anew; if some excess remains after kRepairs, the whole run is scaled in time, which
// lowers velocities, accelerations and jerks everywhere.
#pragma once

#include "controller/planner_law.hpp"

namespace vcnc {

struct MotionSample {
  AxisVector q{}, dq{};     ///< dq is the true derivative of q at this instant
  Vec3 tip = Vec3::Zero();  ///< the controlled point (RTCP) or X, Y, Z [m]
  double tip_speed = 0;     ///< of the controlled point (RTCP) or of X, Y, Z [m/s]
  int line = 0;
};

class Trajectory {
 public:
  static constexpr int kRepairs = 25;

  Trajectory(Path path, const Machine& machine);

  double duration() const { return law_.duration(); }
  MotionSample at(double t) const;  ///< t is clamped to [0, duration]
  const Path& path() const { return path_; }
  int repairs() const { return repairs_; }  ///< how often the law was found anew
  double window() const { return law_.window(); }
  double pace() const { return law_.pace(); }  ///< below 1: the whole run was scaled

 private:
  struct Excess;
  std::vector<Excess> verify() const;
  void lower(const std::vector<Excess>& excess);

  Path path_;
  FrameMap map_;
  MotionLimits limits_;
  std::vector<LimitNode> nodes_;  ///< only while planning
  SpeedLaw law_;
  int repairs_ = 0;
};

}  // namespace vcnc
