#include "model/machine.hpp"

#include <stdexcept>
#include <string_view>

#include "model/parameters.hpp"

namespace vcnc {

Machine::Machine() {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    AxisParams& axis = axes[i];
    if (!is_rotary(i)) continue;
    axis.limits = {.min = -2 * kPi,
                   .max = 2 * kPi,
                   .velocity = 3.5,
                   .acceleration = 15,
                   .jerk = 150,
                   .switch_distance = 2 * kDegree};
    axis.mechanics = {
        .load = 2, .motor_inertia = 0.5, .travel_per_turn = 2 * kPi, .force_limit = 500};
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
  machine.effects = Effects();
  return machine;
}

Machine actual(Machine machine) {
  for (const Deviation& deviation : machine.effects.deviations) {
    if (deviation.key.starts_with("effects."))
      throw std::invalid_argument(deviation.key + ": an effect is given under its own key");
    set_parameter(machine, deviation.key, deviation.value);
  }
  return machine;
}

Machine as_nc_believes(const Machine& machine) {
  const auto own = [](std::string_view key) {
    const bool limit = key.find(".velocity_mm_s") != key.npos ||
                       key.find(".velocity_deg_s") != key.npos ||
                       key.find(".acceleration_mm_s2") != key.npos ||
                       key.find(".acceleration_deg_s2") != key.npos ||
                       key.find(".jerk_mm_s3") != key.npos || key.find(".jerk_deg_s3") != key.npos;
    return key.starts_with("nc.") || (key.starts_with("axes.") && limit);
  };
  Machine nc = declared(machine);
  for (const Deviation& deviation : machine.effects.deviations)
    if (own(deviation.key)) set_parameter(nc, deviation.key, deviation.value);
  nc.effects.take(machine.effects, Place::nc);
  nc.effects.simulate_null = machine.effects.simulate_null;
  return nc;
}

}  // namespace vcnc
