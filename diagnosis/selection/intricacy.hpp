// How much an explanation says: of those that do as well, the one that says least is told.
//
// Numbers that are something, and two for every further tenth or tenfold of a usual size, or of a
// shape (a screw of 12 mm is no grating). Of declared numbers that do the same, the one by the
// fewest tolerances.
#pragma once

#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/selection/contender.hpp"

namespace vcnc {

double intricacy(const std::vector<Candidate>& candidates, const Contender& contender);
double intricacy(const std::vector<Candidate>& candidates, const AddedEffect& effect);
/// Of a declared number out of tolerance.
double intricacy(const FreedNumber& declared);

}  // namespace vcnc
