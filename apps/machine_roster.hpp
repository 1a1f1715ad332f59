// The modules the NC unit waits for in every cycle.
#pragma once

#include "bus/barrier.hpp"

namespace vcnc {

Roster machine_roster();

}  // namespace vcnc
