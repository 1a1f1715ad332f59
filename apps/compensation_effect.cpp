#include "apps/compensation_effect.hpp"

#include <stdexcept>

namespace vcnc {

std::vector<Curve> machine_error(Showing showing, std::size_t axis, const Machine& machine,
                                 const ExperimentOptions& options) {
  Experiment e = experiment(showing, axis, machine, options);
  e.machine.effects = machine.effects;
  const Observation observation = observe(e);
  if (!observation.clean()) throw std::runtime_error(observation.nc.end.reason);
  return curves(e, observation, Quantity::machine_error);
}

ErrorFigures figures_of(const Curve& curve) {
  return {rms(curve), max_abs(curve), peak_to_peak(curve)};
}

std::vector<PassComparison> compare_compensation(const Machine& machine,
                                                 const CompensationParams& settings) {
  Machine compensated = machine;
  compensated.nc.compensation = settings;
  std::vector<PassComparison> result;
  for (const auto& [showing, name] :
       {std::pair{Showing::circle, "circle"}, std::pair{Showing::s_piece, "S piece"}}) {
    const std::vector<Curve> before = machine_error(showing, kX, machine);
    const std::vector<Curve> after = machine_error(showing, kX, compensated);
    for (std::size_t i = 0; i < before.size(); ++i)
      result.push_back({name, before[i].label, figures_of(before[i]), figures_of(after.at(i))});
  }
  return result;
}

}  // namespace vcnc
