// Effects that are switched on but have nothing to act on.
#pragma once

#include <string>
#include <vector>

#include "model/machine.hpp"

namespace vcnc {

/// One sentence for each, naming its key and what is missing: what scales or shapes friction where
/// there is none, backlash that friction cannot hold open behind a scale on the load, the ball's
/// contact without a piece. Not wrong, but most likely not what was meant.
std::vector<std::string> idle_effects(const Machine& machine);

}  // namespace vcnc
