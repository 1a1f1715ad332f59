// Motion of the axes along one run: q(t) with every axis within its velocity, acceleration and
// jerk.
//
// Smooth dynamics: the speed law (planner_law.hpp) is found from the limits along the path
// (planner_limits.hpp). What the axes will then really do is checked: differences of q at the bus
// cycle up to the third, the velocity at each cycle and the feed. Where a limit is exceeded the law
// is made slower there and found anew; if some excess remains after kRepairs, the whole run is
// scaled in time, which lowers velocities, accelerations and jerks everywhere. The law leaves much
// of jerk and acceleration unused and never changes them faster than it must.
//
// Fast dynamics: this law, warped in time to the fastest one within the limits (fast_law.hpp), in
// spans of some seconds that join where the axes are far from their limits.
//
// A run of any length takes bounded memory: its moves come in batches, of which the law is found up
// to where braking at the end of the known path has no influence; what was played is forgotten.
#pragma once

#include <deque>
#include <functional>
#include <optional>

#include "controller/planner_law.hpp"

namespace vcnc {

struct MotionSample {
  AxisVector q{}, dq{};     ///< dq is the true derivative of q at this instant
  Vec3 tip = Vec3::Zero();  ///< the controlled point (RTCP) or X, Y, Z [m]
  double tip_speed = 0;     ///< of the controlled point (RTCP) or of X, Y, Z [m/s]
  int line = 0;
  Move::Panel panel = Move::Panel::acts;  ///< of the block
};

/// Moves that go on with a run; `open`: more follow.
struct MoveBatch {
  std::vector<Move> moves;
  bool open = false;
};
using MoveSource = std::function<MoveBatch()>;

class Trajectory {
 public:
  static constexpr int kRepairs = 25;

  /// `more` continues an open path.
  Trajectory(Path path, const Machine& machine, MoveSource more = {});

  /// Plans until the motion is known up to the time `to` or the run's end, and forgets what lies
  /// before `from`.
  void plan(double from, double to);
  bool complete() const { return !path_.open() && (!fast() || warped_ >= smooth_known_); }
  /// Up to where the motion is known; once it is complete, how long it lasts.
  double duration() const { return fast() ? fast_known_ : smooth_known_; }

  MotionSample at(double t) const;  ///< t is clamped to [0, duration]
  const Path& path() const { return path_; }
  int repairs() const { return repairs_; }  ///< how often the smooth law was found anew
  int fast_repairs() const { return fast_repairs_; }
  int given_up() const { return given_up_; }  ///< spans in which the smooth law stands for the fast
  double window() const { return law_.window(); }
  double pace() const { return law_.pace(); }  ///< below 1: the whole run was scaled

 private:
  struct Excess;
  /// A part of the fast law.
  struct Span {
    double start;
    SpeedTable law;
  };
  bool fast() const { return dynamics_ == NcParams::Dynamics::fast; }
  LawPoint law_at(double t) const;
  void extend();
  void plan_smooth();
  void plan_fast();
  double use_between(double from, double to, double step) const;
  double quietest(double from, double to) const;
  void forget(double from);
  double oldest_position() const;
  std::vector<Excess> verify() const;
  void lower(const std::vector<Excess>& excess);

  Path path_;
  MoveSource more_;
  NcParams::Dynamics dynamics_;
  FrameMap map_;
  std::optional<ProbingLimit> probing_;
  MotionLimits limits_;
  std::vector<LimitNode> nodes_;  ///< only while planning
  SpeedLaw law_;
  double smooth_known_ = 0, fast_known_ = 0;
  double begun_ = 0;   ///< of the smooth law: what is being planned begins here
  double warped_ = 0;  ///< up to here of the smooth law there are spans
  std::deque<Span> spans_;
  int waits_ = 0;  ///< for more of the path
  int repairs_ = 0, fast_repairs_ = 0, given_up_ = 0;
};

}  // namespace vcnc
