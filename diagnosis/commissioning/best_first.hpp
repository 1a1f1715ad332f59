// Gains, lags and whatever else of a healthy machine is one candidate each: the best first.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "diagnosis/commissioning/friction_fit.hpp"
#include "diagnosis/commissioning/machine_in_fit.hpp"

namespace vcnc {

/// While one explains a twentieth of what is left and the controller's signals do not contradict.
/// `friction` of the axis that they are of: null where they are of none.
void fit_best_of(MachineInFit& machine, std::vector<std::size_t> left, const std::string& place,
                 FrictionFit* friction, const std::function<bool()>& go_on);

}  // namespace vcnc
