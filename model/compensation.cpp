#include "model/compensation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "model/machine.hpp"

namespace vcnc {
namespace {

double largest_of(const std::vector<double>& values) {
  double largest = 0;
  for (double v : values) largest = std::max(largest, std::abs(v));
  return largest;
}

std::string of_axis(std::size_t axis) { return std::string(kAxisNames[axis]) + "."; }

std::string objection_to(const ReversalPulse& pulse, const AxisParams& axis) {
  constexpr double kLeastFeedForward = 0.5, kCycleTime = 1e-3;
  if (pulse.amplitude == 0) return "";
  if (pulse.rise >= pulse.decay) return "friction.rise_ms must be below friction.decay_ms";
  if (axis.servo.velocity_ff < kLeastFeedForward)
    return "friction.amplitude goes through the velocity feed-forward: velocity_ff must be at "
           "least 0.5";
  if (pulse.a3 > 0 && !(pulse.a1 < pulse.a2 && pulse.a2 < pulse.a3))
    return "friction: a1, a2, a3 must ascend";
  const double strongest = std::max(std::abs(pulse.amplitude), std::abs(pulse.least));
  if (strongest / std::max(pulse.rise, kCycleTime) > axis.limits.acceleration)
    return "friction: the amplitude rises faster than the acceleration of the axis allows; a "
           "longer rise_ms or less amplitude is needed";
  return "";
}

/// Of a duration that is too short for what it brings.
std::string too_short(double transition, double shortest, std::size_t corrected) {
  std::ostringstream text;
  text << "transition_ms: " << transition / unit::ms.to_si << " is too short for the limits of "
       << kAxisNames[corrected] << ", at least " << std::ceil(shortest / unit::ms.to_si * 10) / 10
       << " are needed";
  return text.str();
}

std::string objection_to(const CompensationTable& table) {
  if (!table.file.empty()) {
    if (!table.at.empty() || !table.error.empty() || !table.error_reverse.empty())
      return "either file or points, not both";
    return "";
  }
  if (table.at.size() < 2) return "needs at least two points";
  if (table.error.size() != table.at.size()) return "needs as many errors as positions";
  if (!table.error_reverse.empty() && table.error_reverse.size() != table.at.size())
    return "needs as many errors in reverse as positions, or none";
  for (std::size_t i = 1; i < table.at.size(); ++i)
    if (!(table.at[i - 1] < table.at[i])) return "positions must ascend";
  if (table.modulo && table.error.front() != table.error.back())
    return "with modulo the last error must be the first one again";
  if (table.modulo && !table.error_reverse.empty() &&
      table.error_reverse.front() != table.error_reverse.back())
    return "with modulo the last error in reverse must be the first one again";
  return "";
}

}  // namespace

double ReversalPulse::amplitude_at(double a) const {
  if (a3 <= 0) return amplitude;
  if (a < a1) return amplitude * a / a1;
  if (a <= a2) return amplitude;
  if (a < a3) return amplitude + (least - amplitude) * (a - a2) / (a3 - a2);
  return least;
}

double CompensationTable::largest_jump() const {
  double jump = 0;
  for (std::size_t i = 0; i < std::min(error.size(), error_reverse.size()); ++i)
    jump = std::max(jump, std::abs(error[i] - error_reverse[i]));
  return jump;
}

double CompensationTable::largest() const {
  return std::max(largest_of(error), largest_of(error_reverse));
}

double CompensationParams::largest_jump(std::size_t axis, std::size_t over) const {
  double jump = axis == over ? std::abs(axes[axis].backlash) : 0;
  for (const CompensationTable& table : tables)
    if (table.axis_index() == axis && table.over_index() == over) jump += table.largest_jump();
  return jump;
}

std::string CompensationParams::objection(const PerAxis<AxisParams>& machine_axes) const {
  for (std::size_t i = 0; i < tables.size(); ++i)
    if (const std::string wrong = objection_to(tables[i]); !wrong.empty())
      return "table " + std::to_string(i + 1) + ": " + wrong;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (const std::string wrong = objection_to(axes[i].friction, machine_axes[i]); !wrong.empty())
      return of_axis(i) + wrong;
    if (axes[i].transition == 0) continue;
    for (std::size_t corrected = 0; corrected < kAxisCount; ++corrected) {
      const AxisLimits& l = machine_axes[corrected].limits;
      constexpr double kAnyJerk = std::numeric_limits<double>::infinity();
      const double shortest =
          shortest_transition(largest_jump(corrected, i), l.velocity, l.acceleration, kAnyJerk);
      if (axes[i].transition < shortest)
        return of_axis(i) + too_short(axes[i].transition, shortest, corrected);
    }
  }
  return "";
}

double shortest_transition(double jump, double velocity, double acceleration, double jerk) {
  const double way = std::abs(jump);
  return std::max(
      {2.25 * way / velocity, std::sqrt(9 * way / acceleration), std::cbrt(54 * way / jerk)});
}

}  // namespace vcnc
