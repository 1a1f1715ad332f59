#include "diagnosis/commissioning/along_the_way.hpp"

#include <algorithm>
#include <set>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/refit.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/screening/screening.hpp"
#include "diagnosis/screening/trial_values.hpp"

namespace vcnc {
namespace {

const std::vector<std::string> kAlongTheWay{
    "torque_ripple",      "cogging",          "transmission_error", "encoder_eccentricity",
    "load_encoder_error", "weight_imbalance", "cable_chain",        "friction_asymmetry"};

/// The machine with one of some candidates each, those that do most by their sensitivities.
std::vector<FittedMachine> best_of(const MachineInFit& in, const std::vector<std::size_t>& some) {
  constexpr std::size_t kFew = 2;
  std::vector<Candidate> chosen;
  for (const std::size_t c : some) chosen.push_back(in.candidates[c]);
  const LinearPart linear = in.now.linear();
  const Ground ground(in.evidence, in.now.residual, linear);
  const TrialValuesOf values(in.evidence, in.now.machine, in.now.residual, in.options.least_gain);
  std::vector<TrialColumns> tried =
      simulate_trials(in.evidence, in.now.machine, in.now.prediction, chosen,
                      trials(in.now.machine, chosen, values), [](double) { return true; });
  std::vector<FittedMachine> fitted;
  std::set<std::size_t> begun;
  for (const Screened& s : screen(in.evidence, ground, {}, chosen, tried)) {
    const TrialColumns& t = tried[s.trial];
    const std::size_t c = t.trial.candidate;
    if (begun.size() == kFew || !(s.gain > in.options.least_gain)) break;
    if (!begun.insert(c).second) continue;
    FittedMachine& m = fitted.emplace_back(in.now);
    set_whole_numbers(m.machine, chosen[c], t.trial);
    m.added.push_back(
        {.candidate = some[c],
         .numbers = start_of(chosen[c], t.trial, s.size, t.own.fitted.diagonal().cwiseSqrt())});
    m.nuisances = without(m.nuisances, m.numbers());
  }
  in.evidence.each_together(fitted.size(),
                            [&](std::size_t i) { converge(in.evidence, fitted[i]); });
  return fitted;
}

}  // namespace

std::vector<std::size_t> fit_along_the_way(MachineInFit& in, const std::string& place,
                                           const std::function<bool()>& go_on) {
  std::vector<std::size_t> left = in.the(kAlongTheWay, place), found;
  while (!left.empty() && in.stands_out(place) && go_on()) {
    std::vector<FittedMachine> fitted = best_of(in, left);
    if (fitted.empty()) break;
    std::vector<std::size_t> few;
    std::vector<double> leaves;
    for (const FittedMachine& f : fitted) {
      few.push_back(f.added.back().candidate);
      leaves.push_back(f.held_out);
    }
    const std::size_t best = in.simplest_of_best(few, leaves);
    if (!in.gains_enough(in.now, fitted[best], place, kShareOfLeft)) break;
    converge_anew(in.evidence, fitted[best]);  // what goes along was linear about a machine without
    std::erase(left, few[best]);
    if (!in.gains_enough(in.now, fitted[best], place, kShareOfLeft) ||
        in.is_as_declared(fitted[best]))
      continue;
    found.push_back(few[best]);
    if (in.candidates[few[best]].effect == CableChain::text.name)
      std::erase_if(left, [&](std::size_t c) {  // where a spring rests stands for a weight
        return in.candidates[c].effect == WeightImbalance::text.name;
      });
    in.accept(std::move(fitted[best]), place, told(in.candidates[few[best]]));
    in.rest();
  }
  return found;
}

}  // namespace vcnc
