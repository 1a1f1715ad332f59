// What a candidate came to when it was refitted, alone or with another one.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/fit/refit.hpp"

namespace vcnc {

inline constexpr int kGlance = 4;  ///< iterations to see what one is worth

struct Contender {
  std::size_t candidate = 0;
  Machine begun;  ///< what is refitted: the machine so far, with the whole numbers of the trials
  std::vector<FreedNumber> numbers;
  std::set<std::string> needless;  ///< keys of those that may be as declared (needed_numbers.hpp)
  Refit fit;
  double gain = 0;
  double counts = 0;     ///< what of the gain counts (counted_gain.hpp)
  std::string released;  ///< key of a declared number whose tolerance is lifted; else empty
  double needed = 0;     ///< what it must gain to be told
  bool converged = false;

  /// What counts less what further numbers give by chance.
  double worth() const { return counts - 4 * static_cast<double>(numbers.size()); }
};

}  // namespace vcnc
