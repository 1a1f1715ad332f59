// When a found effect does something.
//
// What an effect explains may be wrong by a part (counted_gain.hpp), but a probe that clips is
// wrong about nothing where it does not. A channel is cut into slices of a twentieth of a second;
// an effect acts in those where the residual with it and without it, all other numbers as they are,
// differs by a hundredth of the mean of chi-square and more, and in the ones before and after.
#pragma once

#include <vector>

#include "diagnosis/evidence/evidence.hpp"

namespace vcnc {

/// Slice by slice of every channel; empty: in all of them, and not known better.
using ActingSlices = std::vector<std::vector<char>>;

/// Of an effect with these residuals.
ActingSlices acting_slices(const Record& record, const Column& with, const Column& without);

/// Held-out chi-square of every channel in the slices in which none of these acts; none: in all.
std::vector<double> chi2_at_rest(const Evidence& evidence, const Column& column,
                                 const std::vector<ActingSlices>& acting);

}  // namespace vcnc
