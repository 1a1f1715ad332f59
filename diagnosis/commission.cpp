#include "diagnosis/commission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/search/evidence.hpp"
#include "diagnosis/search/intervals.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// A machine with the effects of these names at one axis in its fit, started at what is declared of
/// them; those it has not yet.
FittedMachine with_effects(const DiagnosisCase& of, const FittedMachine& machine, std::size_t axis,
                           const std::vector<std::string>& effects) {
  FittedMachine more = machine;
  for (const std::string& effect : effects) {
    for (std::size_t c = 0; c < of.candidates.size(); ++c) {
      const Candidate& candidate = of.candidates[c];
      if (candidate.effect != effect || candidate.place != kAxisNames[axis]) continue;
      AddedEffect added{.candidate = c};
      for (std::size_t i = 0; i < candidate.numbers.size(); ++i) {
        const FreeNumber& n = candidate.numbers[i];
        const bool shape =
            std::find(candidate.shape.begin(), candidate.shape.end(), i) != candidate.shape.end();
        const double declared = number_of(machine.machine, n.key);
        // What cannot be negative would not leave zero.
        const double start = n.one_sided ? 0.3 * std::abs(n.typical) : 0;
        FreedNumber freed{.number = n, .value = declared != 0 ? declared : start, .shape = shape};
        freed.number.typical = std::max(std::abs(n.typical), 1e-9);
        added.numbers.push_back(freed);
      }
      more.added.push_back(std::move(added));
    }
  }
  more.nuisances = without(more.nuisances, more.numbers());
  return more;
}

/// Whether an axis is told to move at all.
bool is_driven(const Record& record, std::size_t axis) {
  const MeasuredSignal* command = record.find(SignalKind::command, axis);
  if (!command) return record.find(SignalKind::position, axis) != nullptr;
  const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
  return *high - *low > 1e-6;
}

}  // namespace

Commissioning commission(const DiagnosisCase& of, const DiagnosisOptions& options,
                         const KeepGoing& keep_going) {
  struct FrictionLaw {
    const char* name;
    std::vector<std::string> effects;
  };
  static const std::vector<FrictionLaw> laws{
      {"dry and viscous friction", {"coulomb", "viscous"}},
      {"dry, viscous and break-away friction", {"coulomb", "viscous", "stribeck"}},
      {"dry and viscous friction with pre-sliding", {"coulomb", "viscous", "presliding"}},
      {"dry, viscous and break-away friction with pre-sliding",
       {"coulomb", "viscous", "stribeck", "presliding"}}};
  static const std::vector<std::string> gains{"kv_error", "velocity_ff_error",
                                              "acceleration_ff_error", "velocity_gain_error",
                                              "integral_time_error"};
  Evidence evidence(of.record, of.replica, of.declared);
  FittedMachine machine = fit_declared(evidence, of.declared);
  Commissioning result;
  const double per_sample = 1 / std::max(1.0, evidence.count(Role::held_out));
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (keep_going && !keep_going({fmt::format("friction and gains of {}", kAxisNames[axis]),
                                   static_cast<double>(axis) / kAxisCount}))
      break;
    if (!is_driven(of.record, axis)) continue;
    const auto fitted = [&](const std::vector<std::string>& effects) {
      FittedMachine trial = with_effects(of, machine, axis, effects);
      if (trial.added.size() > machine.added.size()) converge(evidence, trial);
      return trial;
    };
    const auto accept = [&](FittedMachine best, const std::string& chosen) {
      if (best.added.size() > machine.added.size())
        result.notes.push_back(
            fmt::format("{}: {}, chi-square per held-out sample {:.3g} -> {:.3g}", kAxisNames[axis],
                        chosen, machine.held_out * per_sample, best.held_out * per_sample));
      machine = std::move(best);
    };
    FittedMachine best = machine;
    std::string chosen;
    for (const FrictionLaw& law : laws) {
      FittedMachine trial = fitted(law.effects);
      if (best.held_out - trial.held_out <= options.least_gain) continue;
      best = std::move(trial);
      chosen = law.name;
    }
    accept(std::move(best), chosen);
    for (const std::string& gain : gains) {
      FittedMachine trial = fitted({gain});
      if (machine.held_out - trial.held_out > options.least_gain) accept(std::move(trial), gain);
    }
  }
  const std::map<std::string, Interval> intervals = intervals_of(evidence, machine);
  const auto tell = [&](const FreedNumber& n) {
    const auto i = intervals.find(n.number.key);
    const double half = i == intervals.end() ? 0 : i->second.half_width;
    result.numbers.push_back({n.number.key, n.value, std::max(n.number.min, n.value - half),
                              std::min(n.number.max, n.value + half)});
  };
  for (const FreedNumber& n : machine.numbers()) tell(n);
  for (const FreedNumber& n : machine.nuisances.numbers) tell(n);
  result.machine = machine.machine;
  result.figures = figures_of(of.record, of.replica, of.declared, result.machine, "all laps");
  result.warnings = evidence.noise().warnings;
  return result;
}

}  // namespace vcnc
