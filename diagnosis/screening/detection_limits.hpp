// From which size on an effect, or a change of a declared number, would be told.
//
// To be told, a direction needs five standard deviations by the Cramer-Rao bound, what goes along
// projected out, and what its counted gain (counted_gain.hpp) and its consequence must reach. All
// of these are known for the size at which it was simulated; the limit is linear in the size.
//
// Beside what was found, its numbers go along, too, more is doubted, and a share of what is left is
// asked for.
//
// Where that leads far below what was simulated, it is tried: play that rattles at ten micrometres
// does nothing at all within the pre-sliding of friction. An effect that does not show at its limit
// is simulated at sizes in between until those at which it is told and is not are within a factor
// of two.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

#include "diagnosis/fit/acting_slices.hpp"
#include "diagnosis/screening/screening.hpp"

namespace vcnc {

/// What an effect must reach to be told.
struct Needed {
  double counted_gain = 25;
  Doubt doubt;
  Consequence consequence;
  /// Of held-out chi-square beyond the noise that is left per channel, the share that the effect
  /// must explain of it and its own together, where it shows. Empty: nothing is left.
  std::vector<double> left{};
  double share = 0;
  /// When found effects act, and the doubt while none does; empty: always.
  std::vector<ActingSlices> acting{};
  Doubt anywhere{};
};

/// Limits of directions on one ground. The references must outlive this.
class DetectionLimits {
 public:
  DetectionLimits(const Evidence& evidence, const Ground& ground, Needed needed);

  struct Limit {
    double steps = std::numeric_limits<double>::infinity();  ///< linear in the size
    std::size_t direction = 0;                               ///< that shows at the least size
  };
  Limit of(TrialColumns& trial) const;
  /// In the unit of the first number of the trial, as much higher than linear as was tried.
  double in_its_unit(TrialColumns& trial) const;
  /// Changes of declared numbers from which on they would be told, in the unit of the key: what
  /// takes each of `numbers` `pull` tolerances away and gains enough. Infinity for those without a
  /// tolerance and those that are not among the linear numbers of the ground, `linear`.
  std::vector<double> of_releases(const std::vector<FreedNumber>& linear,
                                  const std::vector<FreedNumber>& numbers, double pull) const;

 private:
  /// Steps at which as much gain counts as is needed, from the gain of one step in each channel;
  /// `at_rest`: the part of it while no found effect acts.
  double steps_to(const std::vector<double>& per_step, const std::vector<double>& at_rest) const;
  std::vector<double> part_at_rest(const Column& column) const;

  const Evidence& evidence_;
  const Ground& ground_;
  Needed needed_;
  Eigen::LDLT<Eigen::MatrixXd> information_;  ///< of the linear numbers, with their priors
};

/// Fills in the limits of trials, linear in the size.
void find_detection_limits(const DetectionLimits& limits, std::vector<TrialColumns>& trials);

/// Tries the least limit of every candidate where it is far below what was simulated, and takes all
/// of that candidate by as much higher as it turns out. `base` and `prediction` are what the trials
/// were simulated from; where `keep_going` says no, limits stay.
void try_detection_limits(const Evidence& evidence, const Machine& base,
                          const Prediction& prediction, const std::vector<Candidate>& candidates,
                          const DetectionLimits& limits,
                          const std::function<bool(double)>& keep_going,
                          std::vector<TrialColumns>& trials);

}  // namespace vcnc
