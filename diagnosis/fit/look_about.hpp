// What chi-square does about a fitted number, farther out than its curvature tells.
//
// Where an axis rattles, or friction decides where it comes to rest, chi-square is ragged: a fit
// ends in one of its dips, and the curvature is that of the dip. At v + k w, k = +-1, 2, 4, 8 half
// widths w of its interval, with all other numbers along their columns, what is left is held
// against a parabola a k^2 + b k + c through all of it. What scatters about that, s (rms), moves
// the least by as much as a k^2 = s does:
//
//   half width of the interval = w sqrt(1 + (b/2a)^2 + s/a)
//
// A smooth chi-square is its own parabola and leaves w as it is.
#pragma once

#include <vector>

#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

/// Times its half width that a number may be off, from `k` (in half widths; one of them 0) and the
/// chi-square there; 1: no more than that. At most the farthest of `k`.
double times_wider(const std::vector<double>& k, const std::vector<double>& chi_square);

/// Looks about some numbers of what was added, by key. Begins again where less is left than where
/// the machine stands by more than `least`, and keeps what is better. Says of each number how much
/// more than its interval it may be off (FreedNumber::ragged). Anchored at the machine then.
void look_about(Evidence& evidence, FittedMachine& machine, const std::vector<std::string>& keys,
                bool inexact, double least);

}  // namespace vcnc
