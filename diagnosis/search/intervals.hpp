// How far fitted numbers may be from the truth: see diagnose.hpp for what is computed.
#pragma once

#include <map>
#include <string>

#include "diagnosis/search/selection.hpp"

namespace vcnc {

struct Interval {
  double half_width = 0;  ///< of the 95 % interval, in the unit of the key
};

/// By key, of nuisances and added effects.
std::map<std::string, Interval> intervals_of(const Evidence& evidence,
                                             const FittedMachine& machine);

}  // namespace vcnc
