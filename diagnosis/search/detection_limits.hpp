// From which size on an effect, or a change of a declared number, would be told.
//
// To be told, a direction needs five standard deviations by the Cramer-Rao bound, what goes along
// projected out, and what its counted gain (counted_gain.hpp) and its consequence must reach. All
// of these are known for the size at which it was simulated; the limit is linear in the size.
//
// Where that leads far below what was simulated, it is tried: play that rattles at ten micrometres
// does nothing at all within the pre-sliding of friction. An effect that does not show at its limit
// is simulated at sizes in between until those at which it is told and is not are within a factor
// of two.
#pragma once

#include <functional>
#include <vector>

#include "diagnosis/search/screening.hpp"

namespace vcnc {

/// What an effect must reach to be told.
struct Needed {
  double counted_gain = 25;
  Doubt doubt;
  Consequence consequence;
};

/// Fills in the limits of trials, linear in the size.
void find_detection_limits(const Evidence& evidence, const Ground& ground, const Needed& needed,
                           std::vector<TrialColumns>& trials);

/// Tries the least limit of every candidate where it is far below what was simulated, and takes all
/// of that candidate by as much higher as it turns out. `base` and `prediction` are what the trials
/// were simulated from; where `keep_going` says no, limits stay.
void try_detection_limits(const Evidence& evidence, const Machine& base,
                          const Prediction& prediction, const std::vector<Candidate>& candidates,
                          const Ground& ground, const Needed& needed,
                          const std::function<bool(double)>& keep_going,
                          std::vector<TrialColumns>& trials);

/// Changes of declared numbers from which on they would be told, in the unit of the key: what takes
/// them `pull` tolerances away and gains `gain`. Infinity for those without a tolerance.
std::vector<double> release_limits(const Ground& ground, const std::vector<FreedNumber>& numbers,
                                   double pull, double gain);

}  // namespace vcnc
