// Faults as people write them on a command line.
#pragma once

#include <string>
#include <vector>

#include "bus/fault.hpp"

namespace vcnc {

/// Each text in the form of bus/fault.hpp. Throws InputError naming the text.
BusFaults parse_faults(const std::vector<std::string>& texts);

/// The faults, as they were written, that are not among those that have had an effect.
std::vector<std::string> never_struck(const BusFaults& faults,
                                      const std::vector<std::string>& struck);

}  // namespace vcnc
