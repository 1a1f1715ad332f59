// The fast dynamics: a speed law that is already known, warped in time to the fastest one within
// the limits.
//
// The motion q(t) that the base law gives is sampled, and the warp of time along it optimised
// (time_warp.hpp), in rounds on finer grids, as long as they gain, and in stretches that hold each
// other's ends; the stretches of the next round meet elsewhere. Where the law then runs at the
// programmed feed but for what the optimisation leaves, it is set to exactly that feed. Last, what
// the axes will really do is checked: differences of q at the bus cycle up to the third, the
// velocity at each cycle, the feed and what the probe allows. Where a limit is exceeded, because
// the grid was too coarse to see it, the motion around is warped to the nearest one within limits.
// Where that does not come to an end, a smaller share of the limits is tried; at last the base law
// stands.
//
// A span of the base law is handled by itself: at an end that is not at rest the result continues
// the base law to the second derivative.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "controller/planner_law.hpp"
#include "controller/time_warp.hpp"

namespace vcnc {

/// What a run is planned for.
struct RunLimits {
  const Path& path;
  const FrameMap& map;
  const MotionLimits& limits;
  const std::optional<ProbingLimit>& probing;
};

struct LawSpan {
  double t0 = 0, t1 = 0;  ///< of the base law
  double start = 0;       ///< when the result will begin [s]: places the bus cycles
  bool from_rest = true, to_rest = true;
};

class FastLaw {
 public:
  FastLaw(const RunLimits& run, const SpeedLaw& base, const LawSpan& span);

  SpeedTable take() { return std::move(law_); }
  int repairs() const { return repairs_; }
  bool given_up() const { return given_up_; }

 private:
  struct Excess;
  struct Motion;
  struct Warp;
  SpeedTable table_of_base() const;
  LawPoint law_at(double t) const;
  void warp_in_rounds(double margin);
  void warp_fastest(double step, double accuracy, double margin, double inset);
  void keep_feed();
  bool repair();
  Warp warp_nearest(const std::vector<Excess>& excess, int firmness);
  Motion motion(double from, double cell, std::size_t count, std::size_t samples,
                std::size_t span) const;
  std::vector<WarpNode> warp_nodes(const Motion& motion, double margin) const;
  static double worst(const std::vector<Excess>& excess);
  std::vector<double> follow(const Warp& warp);
  std::vector<Excess> at_any_phase(double from, double to) const;
  std::vector<Excess> at_cycles() const;

  const RunLimits* run_;
  const SpeedLaw* base_;
  LawSpan span_;
  SpeedTable law_;
  int repairs_ = 0;
  bool given_up_ = false;
};

}  // namespace vcnc
