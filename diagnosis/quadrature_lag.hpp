// Whether sine and cosine of an encoder were sampled at one time.
//
// A channel that is late is behind by a phase in proportion to the speed, which no constant error
// of the signals is. The sine is shifted against the cosine by up to 100 samples; with every shift
// an ellipse is fitted,
//
//   A u^2 + B u w + C w^2 + D u + E w = 1
//
// by linear least squares, over 5000 samples. It is late where one shift leaves 0.6 of what none
// leaves or less (rms), and a twentieth of the signals' size at most, and turns cosine and sine
// neither into one nor to the end of what was tried. A lag at constant speed is not seen, and is
// told as signal_phase.
#pragma once

#include <optional>
#include <vector>

namespace vcnc {

struct SineLag {
  long samples = 0;  ///< of the sine behind the cosine; negative: the cosine is behind
  double left = 1;   ///< of the residual, when they are shifted
};

std::optional<SineLag> sine_lag(const std::vector<double>& cosine, const std::vector<double>& sine);

}  // namespace vcnc
