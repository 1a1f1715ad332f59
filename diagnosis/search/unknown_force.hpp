// The force on every axis of a healthy run that the declared machine does not have.
//
// What a model gets wrong about a machine is no error of its signals: mostly it is a force, of a
// friction whose law is another one. As a force it acts in every hypothesis, too: where a gain is
// higher, it moves the axis by less; where there is play, it decides on which side of that an axis
// is. Taken off the signals alone (differential.hpp), what it does to a change is put down to other
// effects.
//
//   F(t) := F(t) - mean over laps of (force of the drive - that of the model under F), over 10 ms
//
// in turns from nought, while the axis moves; where it stands, as before. A force is believed only
// where it explains another signal, which it was not taken from: a fifth of the mean square of what
// the position is off the model. So none is found where no force is recorded, where the record has
// a known force, or where the model is off for other reasons (a controller at another rate).
#pragma once

#include <vector>

#include "diagnosis/records/record.hpp"
#include "model/axes.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// One per sample [N or N m]; empty: none.
using ForceOfAxes = PerAxis<std::vector<double>>;

ForceOfAxes unknown_force(const Record& healthy, const Machine& declared);

/// What is missing becomes what was before it, at the beginning what comes first.
void hold_over_gaps(std::vector<double>& series);

}  // namespace vcnc
