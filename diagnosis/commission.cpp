#include "diagnosis/commission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/search/evidence.hpp"
#include "diagnosis/search/intervals.hpp"
#include "diagnosis/search/screening.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Numbers that are fitted together: effects of an axis, or its lags.
struct Step {
  std::string name;
  std::vector<std::string> effects;
};

/// The simplest that does best is taken.
const std::vector<Step> kFrictionLaws{
    {"dry and viscous friction", {"coulomb", "viscous"}},
    {"dry, viscous and break-away friction", {"coulomb", "viscous", "stribeck"}},
    {"dry and viscous friction with pre-sliding", {"coulomb", "viscous", "presliding"}},
    {"dry, viscous and break-away friction with pre-sliding",
     {"coulomb", "viscous", "stribeck", "presliding"}}};
/// One after the other, the best first.
const std::vector<Step> kGains{{"kv_error", {"kv_error"}},
                               {"velocity_ff_error", {"velocity_ff_error"}},
                               {"acceleration_ff_error", {"acceleration_ff_error"}},
                               {"velocity_gain_error", {"velocity_gain_error"}},
                               {"integral_time_error", {"integral_time_error"}},
                               {"lag of the position loop", {"position_lag_us"}},
                               {"lag of the measured velocity", {"velocity_lag_us"}}};

/// Of a cascade, no effect of the library: every one has them.
std::vector<Candidate> lags(const Machine& declared) {
  std::vector<Candidate> all;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    for (const std::string key : {"position_lag_us", "velocity_lag_us"})
      if (declared.axes[axis].servo.controller == ServoParams::Controller::cascade)
        all.push_back({.effect = key,
                       .place = std::string(kAxisNames[axis]),
                       .numbers = {{.key = fmt::format("axes.{}.{}", kAxisNames[axis], key),
                                    .typical = 100,
                                    .min = 0,
                                    .max = 5000,
                                    .one_sided = true}},
                       .shape = {},
                       .family = Family::servo});
  return all;
}

/// A machine with these effects of one axis in its fit, started at what is declared of them; those
/// it has not yet.
FittedMachine with_effects(const std::vector<Candidate>& candidates, const FittedMachine& machine,
                           std::size_t axis, const std::vector<std::string>& effects) {
  FittedMachine more = machine;
  for (const std::string& effect : effects) {
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const Candidate& candidate = candidates[c];
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

/// Held-out chi-square that is left with more numbers, as far as their sensitivities tell.
double promised(const Evidence& evidence, const FittedMachine& machine, FittedMachine more) {
  std::vector<FreedNumber> added = more.numbers();
  added.erase(added.begin(), added.begin() + static_cast<std::ptrdiff_t>(machine.columns.size()));
  take_values(added, machine.machine);
  for (Column& c : columns_of(evidence, machine.machine, machine.prediction, added))
    more.columns.push_back(std::move(c));
  return Ground(evidence, machine.residual, more.linear()).held_out;
}

/// What was added goes along with every further fit, by its sensitivities.
void rest(FittedMachine& m) {
  const std::vector<FreedNumber> numbers = m.numbers();
  m.nuisances.numbers.insert(m.nuisances.numbers.end(), numbers.begin(), numbers.end());
  m.nuisances.columns.insert(m.nuisances.columns.end(), m.columns.begin(), m.columns.end());
  m.added.clear();
  m.columns.clear();
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
  std::vector<Candidate> all = of.candidates;
  for (Candidate& lag : lags(of.declared)) all.push_back(std::move(lag));
  Evidence evidence(of.record, of.replica, of.declared);
  FittedMachine machine = fit_declared(evidence, of.declared);
  Commissioning result;
  std::vector<AddedEffect> found;
  bool going = true;
  const auto go = [&](std::size_t axis) {
    going = !keep_going || keep_going({fmt::format("friction and gains of {}", kAxisNames[axis]),
                                       static_cast<double>(axis) / kAxisCount});
    return going;
  };
  const auto fitted = [&](const std::vector<Step>& steps, std::size_t axis) {
    std::vector<FittedMachine> trials(steps.size(), machine);
    evidence.each_together(steps.size(), [&](std::size_t i) {
      trials[i] = with_effects(all, machine, axis, steps[i].effects);
      if (trials[i].added.size() > machine.added.size()) converge(evidence, trials[i]);
    });
    return trials;
  };
  const double per_sample = 1 / std::max(1.0, evidence.count(Role::held_out));
  const auto accept = [&](FittedMachine best, std::size_t axis, const std::string& chosen) {
    result.notes.push_back(fmt::format("{}: {}, chi-square per held-out sample {:.3g} -> {:.3g}",
                                       kAxisNames[axis], chosen, machine.held_out * per_sample,
                                       best.held_out * per_sample));
    machine = std::move(best);
  };
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (!is_driven(of.record, axis)) continue;
    if (!go(axis)) break;
    std::vector<FittedMachine> trials = fitted(kFrictionLaws, axis);
    std::size_t law = trials.size();
    for (std::size_t i = 0; i < trials.size(); ++i)
      if ((law < trials.size() ? trials[law] : machine).held_out - trials[i].held_out >
          options.least_gain)
        law = i;
    if (law < trials.size()) accept(std::move(trials[law]), axis, kFrictionLaws[law].name);
    for (std::vector<Step> gains = kGains; !gains.empty() && go(axis);) {
      std::vector<double> left(gains.size());
      evidence.each_together(gains.size(), [&](std::size_t i) {
        left[i] = promised(evidence, machine, with_effects(all, machine, axis, gains[i].effects));
      });
      const auto gain = gains.begin() + (std::min_element(left.begin(), left.end()) - left.begin());
      FittedMachine best = std::move(fitted({*gain}, axis)[0]);
      if (machine.held_out - best.held_out <= options.least_gain) break;
      accept(std::move(best), axis, gain->name);
      gains.erase(gain);
    }
    found.insert(found.end(), machine.added.begin(), machine.added.end());
    rest(machine);
    if (!going) break;
  }
  // All together, where they have come to.
  machine.added = std::move(found);
  machine.nuisances = without(machine.nuisances, machine.numbers());
  for (AddedEffect& a : machine.added) take_values(a.numbers, machine.machine);
  anchor_at(evidence, machine);
  converge(evidence, machine);
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
