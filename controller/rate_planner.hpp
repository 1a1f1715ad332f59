// Changes of the rate at which a planned run is played (rate_change.hpp), such that no axis leaves
// its limits: found by trying, each candidate being checked cycle by cycle like the plan itself
// (planner.hpp), by differences of the positions up to the third.
//
//   a rate up to 1   keeps the limits by itself; the change to it may take of each axis what the
//                    plan leaves: velocity and acceleration within kAllowedShare of the limits,
//                    jerk within kAllowedJerk, since a plan that is at its jerk limit throughout
//                    leaves nothing
//   a rate above 1   only where the plan leaves enough for it (fast_until): r v within V, r^2 a and
//                    r^3 j within kFastShare of A and J, and the probe's speed
//                    (model/safety/probing_speed.hpp); with the way up and the way down inside
// T is the shortest on a geometric grid.
#pragma once

#include <optional>

#include "bus/tick.hpp"
#include "controller/planner.hpp"
#include "controller/rate_change.hpp"
#include "model/machine.hpp"
#include "model/safety/probing_speed.hpp"

namespace vcnc {

class RatePlanner {
 public:
  static constexpr double kAllowedShare = 1.001, kAllowedJerk = 1.05, kFastShare = 0.85,
                          kShare = 0.5;

  explicit RatePlanner(const Machine& machine);

  /// A change that begins at `start` of the path. Towards 1 it ends at a whole cycle of the path.
  /// `share`: of the limits, for the shortest one tried.
  std::optional<RateChange> change(const Trajectory& run, double start, double from, double to,
                                   double share = kShare) const;
  /// One that ends at `end` and begins not before `earliest`.
  std::optional<RateChange> change_ending(const Trajectory& run, double end, double from, double to,
                                          double earliest) const;
  /// The slowest one tried, where none keeps every limit: it exceeds them least.
  RateChange slowest(const Trajectory& run, double start, double from, double to) const;

  /// Until when the path can be run at a rate above 1, from `tau` on, as far as 2 s ahead; `tau`:
  /// not at all.
  double fast_until(const Trajectory& run, double tau, double rate) const;

  /// Where the block of the program that is at `tau` ends; the run's duration for the last one.
  static double block_end(const Trajectory& run, double tau);

 private:
  double shortest_time(const Trajectory& run, double at, double difference,
                       double share = kShare) const;
  bool keeps_limits(const Trajectory& run, const RateChange& change) const;
  const MotionLimits& limits(const Trajectory& run) const;

  MotionLimits feed_limits_, rapid_limits_;
  std::optional<ProbingLimit> probing_;
};

/// The change with T lengthened so that, the rate having become 1, the time on the path is at whole
/// cycles; and what cycle of the path real cycle 0 of the change then counts as.
struct AlignedChange {
  RateChange change;
  Tick base = 0;
};
AlignedChange aligned(const RateChange& change);

}  // namespace vcnc
