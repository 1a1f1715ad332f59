#include "diagnosis/commissioning/machine_in_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/fit/ground.hpp"
#include "diagnosis/fit/joint_fit.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/healthy/controller_lags.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kStandsOut = 1.5;      // times the chi-square of noise: there is something to fit
constexpr double kNothing = 1e-3;       // of a typical size
constexpr double kNearlyAsGood = 0.95;  ///< of the most that one promises: as good

/// Of a cascade, no effect of the library: every one has them.
std::vector<Candidate> lags(const Machine& declared) {
  std::vector<Candidate> all;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    for (const LoopLag& lag : kLoopLags)
      if (declared.axes[axis].servo.controller == ServoParams::Controller::cascade)
        all.push_back({.effect = std::string(lag.key),
                       .place = std::string(kAxisNames[axis]),
                       .numbers = {{.key = fmt::format("axes.{}.{}", kAxisNames[axis], lag.key),
                                    .typical = 100,
                                    .min = 0,
                                    .max = 5000,
                                    .one_sided = true}},
                       .shape = {},
                       .family = Family::servo,
                       .of_loops = true});
  return all;
}

}  // namespace

MachineInFit::MachineInFit(const DiagnosisCase& from, const DiagnosisOptions& asked)
    : of(from),
      options(asked),
      candidates(from.candidates),
      evidence(from.record, from.replica, from.declared),
      controller_(from.record, from.replica.channels(), from.declared) {
  for (Candidate& lag : lags(from.declared)) candidates.push_back(std::move(lag));
}

std::vector<std::size_t> MachineInFit::the(const std::vector<std::string>& effects,
                                           const std::string& place) const {
  std::vector<std::size_t> all;
  for (const std::string& effect : effects)
    for (std::size_t c = 0; c < candidates.size(); ++c)
      if (candidates[c].effect == effect && candidates[c].place == place) all.push_back(c);
  return all;
}

FittedMachine MachineInFit::with_candidates(const FittedMachine& machine,
                                            const std::vector<std::size_t>& chosen) const {
  FittedMachine more = machine;
  for (const std::size_t c : chosen) {
    const Candidate& candidate = candidates[c];
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
  more.nuisances = without(more.nuisances, more.numbers());
  return more;
}

bool MachineInFit::gains_enough(const FittedMachine& than, const FittedMachine& better,
                                const std::string& place, double least_share) const {
  const Left left = left_in(evidence.chi2_of(than.residual, Role::held_out), place);
  return than.held_out - better.held_out >
         std::max(options.least_gain * std::max(1.0, left.chi2 / std::max(1.0, left.samples)),
                  least_share * left.above_noise);
}

bool MachineInFit::stands_out(const std::string& place) const {
  const std::vector<ComparedChannel>& channels = of.replica.channels();
  const auto is_own = [&](const ComparedChannel& c) {
    return !is_reading(c.kind) && kAxisNames[c.axis] == place;
  };
  const bool has_own = std::any_of(channels.begin(), channels.end(), is_own);
  const std::vector<double> chi2 = evidence.chi2_of(now.residual, Role::held_out);
  for (std::size_t c = 0; c < chi2.size(); ++c)
    if ((!has_own || is_own(channels[c])) &&
        chi2[c] > kStandsOut * evidence.count(c, Role::held_out))
      return true;
  return false;
}

MachineInFit::Left MachineInFit::left_in(const std::vector<double>& chi2,
                                         const std::string& place) const {
  const std::size_t axis = axis_named(place);
  Left left;
  for (std::size_t c = 0; c < chi2.size(); ++c) {
    const ComparedChannel& channel = of.replica.channels()[c];
    if (axis < kAxisCount && !is_reading(channel.kind) && channel.axis != axis) continue;
    const double samples = evidence.count(c, Role::held_out);
    left.chi2 += chi2[c];
    left.samples += samples;
    left.above_noise += std::max(0.0, chi2[c] - samples);
  }
  return left;
}

void MachineInFit::accept(FittedMachine better, const std::string& place,
                          const std::string& chosen) {
  const auto per_sample = [&](const FittedMachine& m) {
    const Left left = left_in(Ground(evidence, m.residual, m.linear()).held_out_of, place);
    return left.chi2 / std::max(1.0, left.samples);
  };
  notes.push_back(fmt::format("{}: {}, chi-square per held-out sample {:.3g} -> {:.3g}", place,
                              chosen, per_sample(now), per_sample(better)));
  now = std::move(better);
}

void MachineInFit::rest() {
  const std::vector<FreedNumber> numbers = now.numbers();
  now.nuisances.numbers.insert(now.nuisances.numbers.end(), numbers.begin(), numbers.end());
  now.nuisances.columns.insert(now.nuisances.columns.end(), now.columns.begin(), now.columns.end());
  now.added.clear();
  now.columns.clear();
}

void MachineInFit::fit_together() {
  now = fit_numbers(evidence, now.machine, now.nuisances.numbers);
  fit_jointly(evidence, now, every(now));
}

std::size_t MachineInFit::simplest_of_best(const std::vector<std::size_t>& some,
                                           const std::vector<double>& leaves) const {
  const auto first = std::min_element(leaves.begin(), leaves.end());
  const double enough = now.held_out - kNearlyAsGood * (now.held_out - *first);
  auto best = static_cast<std::size_t>(first - leaves.begin());
  const auto numbers = [&](std::size_t i) { return candidates[some[i]].numbers.size(); };
  for (std::size_t i = some.size(); i-- > 0;)
    if (leaves[i] <= enough && numbers(i) <= numbers(best)) best = i;
  return best;
}

bool MachineInFit::is_as_declared(const FittedMachine& m) const {
  const std::vector<FreedNumber>& numbers = m.added.back().numbers;
  return std::all_of(numbers.begin(), numbers.end(), [&](const FreedNumber& n) {
    return std::abs(n.value - number_of(of.declared, n.number.key)) <
           kNothing * std::abs(n.number.typical);
  });
}

bool MachineInFit::stands_for_force(const FittedMachine& m) const {
  const Candidate& last = candidates[m.added.back().candidate];
  if (!last.of_loops) return false;
  Machine without = m.machine;
  for (const FreeNumber& n : last.numbers)
    move_number(without, n.key, number_of(of.declared, n.key));
  const auto b = controller_.of(axis_named(last.place), evidence.predict(without),
                                evidence.predict(m.machine));
  return b && b->contradicts();
}

std::string told(const Candidate& c) {
  for (const LoopLag& lag : kLoopLags)
    if (c.effect == lag.key) return "lag of " + std::string(lag.of);
  return c.effect == "deviation" ? c.place : c.effect;
}

}  // namespace vcnc
