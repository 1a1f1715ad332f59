// What a hypothesis leaves of the fitted laps and what its numbers are off their declaration, as
// fits make it least.
#pragma once

#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

/// Weight of each channel's chi-square: one that is far off tells of something missing, not of the
/// numbers that are there, and would pull them anywhere. (As if its noise were half of what it is
/// off.)
std::vector<double> weights_of_channels(const Evidence& evidence, const Column& residual);

double misfit(const Evidence& evidence, const Column& residual, const std::vector<double>& weight,
              const std::vector<FreedNumber>& numbers);
/// All channels alike.
double misfit(const Evidence& evidence, const FittedMachine& machine);
/// What is made least by steps that each take their weights where they begin: beyond where they
/// begin to shrink, a channel counts by its logarithm.
double quiet_misfit(const Evidence& evidence, const FittedMachine& machine);

/// Chi-square that no further look is worth: little, and little of what is more than noise; less
/// little where that is far more, since something is missing then that will ask for other numbers.
double settled(const Evidence& evidence, const FittedMachine& machine);

}  // namespace vcnc
