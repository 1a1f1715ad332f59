// What a change of the machine does to what is measured, in units that matter to its user.
#pragma once

#include "diagnosis/evidence/evidence.hpp"

namespace vcnc {

struct Consequence {
  /// RMS of what it does to the contour: to the reading of probe or bar where there is one, to the
  /// tool position across the way that it goes, else to the positions of the linear axes, or to
  /// what their motors go where no position is recorded [um].
  double contour_um = 0;
  /// Largest RMS of what it does to any signal, and to any but the readings, of the noise of one
  /// sample; that of the position of a linear axis is 0.1 um at least.
  double of_noise = 0, of_noise_but_readings = 0;
};

Consequence consequence(const Evidence& evidence, const Prediction& a, const Prediction& b);

}  // namespace vcnc
