// Speed law s(t): fastest run under the limits of the nodes, then a moving average in time.
//
// A forward and a backward pass give v(s) with steps in acceleration; the average over a window T
//   s_f(t) = 1/T int_{t-T}^{t} s dt,   ds_f/dt = (s(t) - s(t-T)) / T
// bounds the jerk by |a| steps over T and starts and ends with zero speed and acceleration. For the
// average to keep a speed limit, each node's limit v is first spread over +- v T/2: then whoever
// passes the node is that slow for the whole window.
#pragma once

#include <vector>

#include "controller/planner_limits.hpp"

namespace vcnc {

struct LawPoint {
  double s = 0, ds = 0;
};

class SpeedLaw {
 public:
  /// `window` T [s].
  SpeedLaw(const std::vector<LimitNode>& nodes, const MotionLimits& limits, double window);

  /// The law with the window that makes the run shortest.
  static SpeedLaw fastest(const std::vector<LimitNode>& nodes, const MotionLimits& limits);

  double duration() const { return (knots_.back().t + window_) / pace_; }
  double window() const { return window_ / pace_; }
  double pace() const { return pace_; }
  LawPoint at(double t) const;
  /// Position before averaging: what the limits at a node have an influence on.
  double raw_position(double t) const { return raw(pace_ * t).s; }
  /// Runs the whole law slower: t -> pace t, pace <= 1.
  void slow_down(double pace) { pace_ *= pace; }

 private:
  struct Knot {
    double t, s, v;
  };
  std::size_t index(double t) const;
  LawPoint raw(double t) const;
  LawPoint raw_in(std::size_t cell, double t) const;

  std::vector<Knot> knots_;
  double window_, pace_ = 1;
};

}  // namespace vcnc
