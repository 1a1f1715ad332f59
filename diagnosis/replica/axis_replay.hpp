// One axis of a hypothesis, driven by the command of a record.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/replica/commanded_motion.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// Samples of the true position in a cycle; the last belongs to its end.
inline constexpr std::size_t kTruthPerCycle = 10;

/// One value per cycle of 1 ms, SI; NaN where nothing is said of this axis.
struct AxisReplay {
  SharedSeries measured, twist, force;
  std::vector<double> truth;  ///< kTruthPerCycle per cycle: [10 k + 9] belongs to the instant k ms
};

/// `actual` is the hypothesis with its deviations applied and starting where the record does;
/// `motion` is at 1 ms. Throws std::invalid_argument where the machine cannot be simulated.
AxisReplay replay_axis(const Machine& hypothesis, const Machine& actual, std::size_t axis,
                       const CommandedMotion& motion);

/// Everything replay_axis() depends on besides the motion.
std::string fingerprint_of_axis(const Machine& hypothesis, const Machine& actual, std::size_t axis);

}  // namespace vcnc
