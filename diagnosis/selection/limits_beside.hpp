// Detection limits beside what was found: what else would have been told?
//
// What found effects explain is never known exactly (counted_gain.hpp), their numbers bend along,
// and what they leave must not be imitated: a second fault is told later than a first one.
#pragma once

#include <vector>

#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/screening/detection_limits.hpp"
#include "diagnosis/selection/contest_rules.hpp"

namespace vcnc {

/// In the units of detection_limits.hpp; of what was found, beside the rest of that.
struct LimitsBeside {
  std::vector<double> of_trials;    ///< in the order of the rules
  std::vector<double> of_releases;  ///< of the declared numbers of `base`
};

/// `first`: what an effect must reach where nothing was found.
LimitsBeside limits_beside(const ContestRules& rules, const FittedMachine& base,
                           const FittedMachine& found, const Needed& first);

}  // namespace vcnc
