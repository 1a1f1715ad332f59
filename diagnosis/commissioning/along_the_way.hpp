// What of a healthy drive hangs on where its axis is: ripple, cogging, waves of screws and
// encoders, weight, springs, uneven friction.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "diagnosis/commissioning/machine_in_fit.hpp"

namespace vcnc {

/// The best first, while signals of the axis stand out of noise and one explains a twentieth of
/// what is left. What was found, as candidates.
std::vector<std::size_t> fit_along_the_way(MachineInFit& machine, const std::string& place,
                                           const std::function<bool()>& go_on);

}  // namespace vcnc
