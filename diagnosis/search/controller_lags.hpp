// Lags of the loops of a healthy machine, which hardly anybody can declare.
//
// How late a position loop acts, and a velocity is measured, depends on cycles and filters of a
// drive, and on whether its feed-forward is as late. Where it is not as declared, a position is off
// by what no force makes (controller_check.hpp), in proportion to speed and acceleration, and what
// that hides is put down to something else. Lags are fitted to nothing but r of the healthy run, by
// least squares, so that friction has no say:
//
//   min | r - sum_i d r / d tau_i  (tau_i - tau_i declared) |^2,   0 <= tau_i <= 2 ms
//
// and are kept where they take half of its mean square at least and that is more than noise. Gains
// stay as declared. None is fitted of a sampled controller, whose lags are another number, nor
// where command, position or force of an axis is not recorded.
#pragma once

#include "diagnosis/records/record.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// The declared machine with the lags of its loops as a healthy run has them.
Machine with_lags_of(const Record& healthy, const Machine& declared);

}  // namespace vcnc
