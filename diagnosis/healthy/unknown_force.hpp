// The force on every axis of a healthy run that the declared machine does not have.
//
// What a model gets wrong about a machine is no error of its signals: mostly it is a force, of a
// friction whose law is another one. As a force it acts in every hypothesis, too: where a gain is
// higher, it moves the axis by less; where there is play, it decides on which side of that an axis
// is. Taken off the signals alone (differential.hpp), what it does to a change is put down to other
// effects.
//
//   F(t) := F(t) - (e_F - J e_x''),   means over laps and over 10 ms, twice
//
// in turns from nought, e_F and e_x what force and position are off the model under F, J the
// inertia of the axis: the force that is missing for it to move as it did, whatever its controller
// does. Where the axis stands, as before. It is believed where it stands out of the noise and the
// turns come to an end: half of its mean square at most is left. None is found where no force is
// recorded or where the record has a known force. Where a hypothesis has more dry friction, it
// grows as that does: it is what that law has wrong. Known to 5 %, what is slow of it and what is
// quick each for itself.
#pragma once

#include <vector>

#include "diagnosis/records/record.hpp"
#include "model/axes.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// One per sample [N or N m]; empty: none.
using ForceOfAxes = PerAxis<std::vector<double>>;

ForceOfAxes unknown_force(const Record& healthy, const Machine& declared);

}  // namespace vcnc
