// Faults as people write them on a command line.
#pragma once

#include <string>
#include <vector>

#include "bus/fault.hpp"

namespace vcnc {

/// Each text in the form of bus/fault.hpp. Throws InputError naming the text.
BusFaults parse_faults(const std::vector<std::string>& texts);

}  // namespace vcnc
