#include "model/machine.hpp"

#include <stdexcept>

namespace vcnc {

Machine::Machine() {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    AxisParams& axis = axes[i];
    if (!is_rotary(i)) continue;
    axis.limits = {
        .min = -2 * kPi, .max = 2 * kPi, .velocity = 3.5, .acceleration = 15, .jerk = 150};
    axis.mechanics = {
        .load = 2, .motor_inertia = 0.5, .travel_per_turn = 2 * kPi, .force_limit = 500};
    effects.axis[i].friction.stribeck_velocity = 0.02;
  }
}

double Machine::tool_length(int h) const {
  if (h == 0) return 0;
  if (h == 1 && setup.tool_length.empty()) return probe.length;
  if (h < 0 || static_cast<std::size_t>(h) > setup.tool_length.size())
    throw std::out_of_range("no tool length H" + std::to_string(h));
  return setup.tool_length[static_cast<std::size_t>(h) - 1];
}

Machine declared(Machine machine) {
  machine.effects = Machine().effects;
  return machine;
}

}  // namespace vcnc
