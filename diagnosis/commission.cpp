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

class Commissioner {
 public:
  Commissioner(const DiagnosisCase& of, const DiagnosisOptions& options,
               const KeepGoing& keep_going)
      : of_(of),
        options_(options),
        keep_going_(keep_going),
        candidates_(of.candidates),
        evidence_(of.record, of.replica, of.declared),
        machine_(fit_declared(evidence_, of.declared)) {
    for (Candidate& lag : lags(of.declared)) candidates_.push_back(std::move(lag));
  }

  Commissioning run() {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      if (!is_driven(of_.record, axis)) continue;
      if (!go(axis)) break;
      fit_friction(axis);
      fit_gains(axis);
      found_.insert(found_.end(), machine_.added.begin(), machine_.added.end());
      rest(machine_);
    }
    fit_together();
    tell();
    return std::move(result_);
  }

 private:
  bool go(std::size_t axis) const {
    return !keep_going_ || keep_going_({fmt::format("friction and gains of {}", kAxisNames[axis]),
                                        static_cast<double>(axis) / kAxisCount});
  }

  /// The machine with each of the steps, fitted.
  std::vector<FittedMachine> fitted(const std::vector<Step>& steps, std::size_t axis) const {
    std::vector<FittedMachine> trials(steps.size(), machine_);
    evidence_.each_together(steps.size(), [&](std::size_t i) {
      trials[i] = with_effects(candidates_, machine_, axis, steps[i].effects);
      if (trials[i].added.size() > machine_.added.size()) converge(evidence_, trials[i]);
    });
    return trials;
  }

  double per_sample(const FittedMachine& m) const {
    return m.held_out / std::max(1.0, evidence_.count(Role::held_out));
  }

  /// Whether it gains what noise would not, if noise were all that is left.
  bool gains_enough(const FittedMachine& now, const FittedMachine& better) const {
    return now.held_out - better.held_out > options_.least_gain * std::max(1.0, per_sample(now));
  }

  void accept(FittedMachine better, std::size_t axis, const std::string& chosen) {
    result_.notes.push_back(fmt::format("{}: {}, chi-square per held-out sample {:.3g} -> {:.3g}",
                                        kAxisNames[axis], chosen, per_sample(machine_),
                                        per_sample(better)));
    machine_ = std::move(better);
  }

  void fit_friction(std::size_t axis) {
    std::vector<FittedMachine> trials = fitted(kFrictionLaws, axis);
    const FittedMachine* best = &machine_;
    for (const FittedMachine& trial : trials)
      if (gains_enough(*best, trial)) best = &trial;
    if (best == &machine_) return;
    const auto law = static_cast<std::size_t>(best - trials.data());
    accept(std::move(trials[law]), axis, kFrictionLaws[law].name);
  }

  void fit_gains(std::size_t axis) {
    for (std::vector<Step> gains = kGains; !gains.empty() && go(axis);) {
      std::vector<double> left(gains.size());
      evidence_.each_together(gains.size(), [&](std::size_t i) {
        left[i] = promised(evidence_, machine_,
                           with_effects(candidates_, machine_, axis, gains[i].effects));
      });
      const auto gain = gains.begin() + (std::min_element(left.begin(), left.end()) - left.begin());
      FittedMachine better = std::move(fitted({*gain}, axis)[0]);
      if (!gains_enough(machine_, better)) return;
      accept(std::move(better), axis, gain->name);
      gains.erase(gain);
    }
  }

  /// Everything that was found, from where it has come to.
  void fit_together() {
    machine_.added = std::move(found_);
    for (AddedEffect& a : machine_.added) take_values(a.numbers, machine_.machine);
    machine_.nuisances = without(machine_.nuisances, machine_.numbers());
    anchor_at(evidence_, machine_);
    converge(evidence_, machine_);
  }

  void tell() {
    const std::map<std::string, Interval> intervals = intervals_of(evidence_, machine_);
    for (const std::vector<FreedNumber>& numbers : {machine_.numbers(), machine_.nuisances.numbers})
      for (const FreedNumber& n : numbers) {
        const auto i = intervals.find(n.number.key);
        const double half = i == intervals.end() ? 0 : i->second.half_width;
        result_.numbers.push_back({n.number.key, n.value, std::max(n.number.min, n.value - half),
                                   std::min(n.number.max, n.value + half)});
      }
    result_.machine = machine_.machine;
    result_.figures =
        figures_of(of_.record, of_.replica, of_.declared, result_.machine, "all laps");
    result_.warnings = evidence_.noise().warnings;
  }

  const DiagnosisCase& of_;
  const DiagnosisOptions& options_;
  const KeepGoing& keep_going_;
  std::vector<Candidate> candidates_;
  Evidence evidence_;
  FittedMachine machine_;  ///< added: what was found on the axis in work
  std::vector<AddedEffect> found_;
  Commissioning result_;
};

}  // namespace

Commissioning commission(const DiagnosisCase& of, const DiagnosisOptions& options,
                         const KeepGoing& keep_going) {
  return Commissioner(of, options, keep_going).run();
}

}  // namespace vcnc
