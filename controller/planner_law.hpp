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
#include "controller/speed_table.hpp"

namespace vcnc {

class SpeedLaw {
 public:
  /// `window` T [s].
  SpeedLaw(const std::vector<LimitNode>& nodes, const MotionLimits& limits, double window);

  /// Goes on where `before` is settled: there the first node stands.
  SpeedLaw(const std::vector<LimitNode>& nodes, const MotionLimits& limits, SpeedLaw before);

  /// From the first node on, after the limits changed.
  void again(const std::vector<LimitNode>& nodes, const MotionLimits& limits);

  /// The law with the window that makes the run shortest.
  static SpeedLaw fastest(const std::vector<LimitNode>& nodes, const MotionLimits& limits);

  double duration() const { return (knots_.back().t + window_) / pace_; }
  double window() const { return window_ / pace_; }
  /// Up to this node the law does not depend on where the nodes end.
  std::size_t settled() const { return settled_; }
  /// Up to this time then.
  double settled_time() const { return knots_[first_ + settled_].t / pace_; }
  /// The law before t is not asked for any more.
  void forget(double t);
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
  void find(const std::vector<LimitNode>& nodes, const MotionLimits& limits);
  std::size_t index(double t) const;
  LawPoint raw(double t) const;
  LawPoint raw_in(std::size_t cell, double t) const;

  std::vector<Knot> knots_;
  std::size_t first_ = 0;    ///< knot of the first node
  std::size_t settled_ = 0;  ///< node
  double window_, pace_ = 1;
};

}  // namespace vcnc
