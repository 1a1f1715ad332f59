// Fits the numbers of what was added about where a machine stands, what goes along by the
// sensitivities that it has.
#pragma once

#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

/// Until nothing moves.
void converge(const Evidence& evidence, FittedMachine& machine);

}  // namespace vcnc
