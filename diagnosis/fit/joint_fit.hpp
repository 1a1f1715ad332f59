// Fits all numbers of a machine at the same time.
//
//   s = argmin |W (z - J s)|^2 + |theta + s|^2,  theta := theta + k s
//
// z: what the machine leaves, J: sensitivities of all numbers where it stands, W: weights of
// channels (misfit.hpp), theta: what numbers are off their declaration, in tolerances. Of k = 1, 2,
// 4 ... 16 the one that makes the misfit least: loud channels, which weigh little, would hold every
// step short. Where none does, steps are damped (Levenberg, Quart. Appl. Math. 2 (1944) 164;
// Marquardt, SIAM J. 11 (1963) 431). Then all is taken anew there.
//
// It ends where a step brings next to nothing, or where the next one promises no more and the last
// one did what it promised.
#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

/// With the replica exact where it was; declared numbers but for `which` keep the sensitivities
/// that they have.
void fit_jointly(const Evidence& evidence, FittedMachine& machine,
                 const std::vector<std::size_t>& which);

}  // namespace vcnc
