// The modules the NC unit waits for in every cycle.
#pragma once

#include "bus/barrier.hpp"
#include "bus/fault.hpp"

namespace vcnc {

Roster machine_roster(const BusFaults& faults = {});

}  // namespace vcnc
