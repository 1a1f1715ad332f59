// How much a reading counts where what is wrong with it goes over from one state to another, if no
// signal of a drive tells how the axis turned.
//
// An axis that turns goes through its play, its wind-up and the reach of its pre-sliding within
// some ten milliseconds. When it does depends on the law of its friction: one bristle lets go after
// F / k, a Maxwell slip of many elements by and by (Al-Bender, Lampaert, Swevers, IEEE Trans.
// Automat. Control 50 (2005) 1883), and a declared model has one of them. A step of some
// micrometres that comes 5 ms early makes more chi-square than all the rest of a circle, and
// numbers that move it would be fitted to nothing else. So a reading is uncertain by what the
// deviation d from the declared machine goes through within tau before and after it, beyond what it
// usually does:
//
//   w = 1 / sqrt(1 + (g / sigma)^2),   g = max(0, range of d over +-tau - 3 times its median)
//
// with d a mean over 5 ms and tau = 10 ms. Standard deviations are as much larger.
#pragma once

#include <vector>

namespace vcnc {

/// Of every sample of a channel, 0 .. 1. `deviation` from the declared machine [SI], NaN where it
/// is not known; `sigma` of its noise [SI]; `period` [s].
std::vector<float> turning_weight(const std::vector<double>& deviation, double sigma,
                                  double period);

}  // namespace vcnc
