// What is safe when something besides the crash is broken.
//
// The protection is single-fault safe: its two paths (overtravel module, NC unit) and the drives'
// own supervision share nothing but the bus, and the bus is supervised by everyone. With a fault
// the machine is safe if
//   * it stopped, or the true deflection never left the usable range;
//   * it began to stop at the latest kDetectionChain + kFaultDelay cycles after a sample in which
//   the range
//     was left: two cycles without a message are borne, one more finds that out;
//   * every axis truly stands at the end, with the spindle locked, and the spindle was locked or
//     stood when the axes came to rest; a machine that only waits for its mains need not lock it;
//   * the spindle takes no start afterwards and a module that had tripped keeps its state;
//   * an alarm names the node, the cause, or the protection that acted;
//   * every cycle is recorded;
//   * the deflection stayed below the mechanical limit, where the NC unit had allowed the feed.
// What a kind of fault may excuse is in one table, kTolerances.
#pragma once

#include <string>
#include <vector>

#include "apps/lockout_case.hpp"
#include "apps/lockout_trip.hpp"

namespace vcnc {

inline constexpr Tick kFaultDelay = 4;

/// What a kind excuses, and what names it.
struct FaultTolerance {
  BusFault::Kind kind;
  /// How wrong the reading may be without being found out, in signal periods.
  double periods;
  /// It moves an axis by itself: the feed check cannot answer for the way.
  bool moves_axes;
  std::vector<int> alarms;  ///< that name it, besides those naming the node
};
const FaultTolerance& tolerance_of(BusFault::Kind kind);

/// What is not safe, one sentence each. `faults` are those that were played, resolved.
std::vector<std::string> judge_faulted(const Scenario& scenario, const LockoutCase& the_case,
                                       const BusFaults& faults, const TripLog& log,
                                       const TripFigures& figures, const TripEnd& end);

/// The table as Markdown.
std::string fault_tolerances_markdown();

}  // namespace vcnc
