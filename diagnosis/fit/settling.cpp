#include "diagnosis/fit/settling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/ground.hpp"
#include "diagnosis/fit/joint_fit.hpp"
#include "diagnosis/fit/misfit.hpp"

namespace vcnc {
namespace {

/// Fits where the replica is exact: what is found there may be where it is not any more.
void converge_exactly(Evidence& evidence, FittedMachine& m, const NoUse& no_use = {}) {
  constexpr int kAnchors = 4, kInVain = 2;
  double least = misfit(evidence, m);
  int in_vain = 0;  // some go around in a circle
  for (int i = 0; i < kAnchors; ++i) {
    const double before = m.held_out;
    converge(evidence, m);
    const double there = misfit(evidence, m);
    anchor_at(evidence, m);
    const double here = misfit(evidence, m), little = settled(evidence, m);
    if (std::abs(there - here) < little) break;
    if (no_use.given_up(m.held_out, kAnchors * (before - m.held_out))) break;
    in_vain = here < least - little ? 0 : in_vain + 1;
    if (in_vain == kInVain) break;
    least = std::min(least, here);
  }
}

/// Where all numbers stand.
std::vector<double> stand(const FittedMachine& m) {
  std::vector<double> all;
  for (const FreedNumber& n : m.nuisances.numbers) all.push_back(n.value);
  for (const FreedNumber& n : m.numbers()) all.push_back(n.value);
  return all;
}

/// Takes sensitivities of `which` where the machine stands and fits, until that changes nothing, or
/// would, if gains go on to shrink as they do; `gain` is that of the fit before.
void fit_in_rounds(Evidence& evidence, FittedMachine& m, const std::vector<std::size_t>& which,
                   double gain = std::numeric_limits<double>::infinity(),
                   const NoUse& no_use = {}) {
  constexpr int kLinearisations = 8;
  for (int round = 0; round < kLinearisations; ++round) {
    const double before = m.held_out, off = misfit(evidence, m), last = gain;
    const std::vector<double> from = stand(m);
    linearise(evidence, m, which);
    converge_exactly(evidence, m, no_use);
    if (stand(m) == from) break;
    gain = std::max(before - m.held_out, off - misfit(evidence, m));
    const double next =
        last > 0 && std::isfinite(last) ? gain * std::sqrt(std::abs(gain) / last) : gain;
    if (std::min(gain, next) < settled(evidence, m)) break;
    if (no_use.given_up(m.held_out, kLinearisations * gain)) break;
  }
}

/// Tolerances from which on a declared number may stand for something that is missing.
constexpr double kPulledFar = 1.5;
/// The same, even where nothing else is left.
constexpr double kPulledOut = 3;

/// With declared numbers that were pulled back where they are declared, and what was added fitted
/// to that first: from where it stands beside pulled numbers, the way may be too far.
FittedMachine as_if_never_pulled(Evidence& evidence, FittedMachine m) {
  constexpr int kSecondGlance = 4;
  LinearPart others;
  for (std::size_t i = 0; i < m.nuisances.numbers.size(); ++i) {
    FreedNumber& n = m.nuisances.numbers[i];
    if (std::abs(n.pull()) > kPulledFar) {
      n.value = n.centre;
    } else {
      others.numbers.push_back(n);
      others.columns.push_back(m.nuisances.columns[i]);
    }
  }
  m.machine = with(m.machine, m.nuisances.numbers);
  evidence.anchor(m.machine);
  Refit alone = refit(evidence, m.machine, m.numbers(), others, {.max_iterations = kSecondGlance});
  alone.linear = between(others.numbers, alone.linear, 1.0);
  alone.machine = with(alone.machine, alone.linear);
  m = std::move(moved_to(evidence, m, {alone}).front());
  anchor_at(evidence, m);
  return m;
}

}  // namespace

FittedMachine fit_declared(Evidence& evidence, const Machine& declared, Against against) {
  return fit_numbers(evidence, declared, nuisances(declared, against));
}

FittedMachine fit_numbers(Evidence& evidence, const Machine& declared,
                          std::vector<FreedNumber> numbers) {
  constexpr double kShowsNothing = 0.03;  // standard deviations by a typical change
  FittedMachine m;
  m.machine = declared;
  m.nuisances.numbers = std::move(numbers);
  m.prediction = evidence.predict(declared);
  linearise(evidence, m, every(m));
  // What the run cannot show stays at its declaration.
  LinearPart shown;
  for (std::size_t i = 0; i < m.nuisances.numbers.size(); ++i) {
    const Column& column = m.nuisances.columns[i];
    if (column.zero() ||
        evidence.chi2(column, Role::fitted) + evidence.chi2(column, Role::held_out) <
            kShowsNothing * kShowsNothing)
      continue;
    shown.numbers.push_back(m.nuisances.numbers[i]);
    shown.columns.push_back(std::move(m.nuisances.columns[i]));
  }
  m.nuisances = std::move(shown);
  converge(evidence, m);
  anchor_at(evidence, m);
  const double before = m.held_out;
  converge_exactly(evidence, m);
  fit_in_rounds(evidence, m, every(m), before - m.held_out);
  return m;
}

void converge_anew(const Evidence& evidence, FittedMachine& m) {
  stay(evidence, m);
  linearise(evidence, m, every(m));
  converge(evidence, m);
}

void converge_jointly(const Evidence& evidence, FittedMachine& m) {
  converge(evidence, m);
  fit_jointly(evidence, m, concerned(m));
}

FittedMachine within_tolerance(Evidence& evidence, FittedMachine m, double tolerances,
                               const std::function<bool(const FreedNumber&)>& may_be_out_of_one) {
  constexpr int kOneAfterTheOther = 3;
  for (int round = 0; round < kOneAfterTheOther; ++round) {
    bool any = false;
    for (FreedNumber& n : m.nuisances.numbers) {
      if (n.held || std::abs(n.pull()) <= tolerances || !may_be_out_of_one(n)) continue;
      n.held = any = true;
      n.value = n.centre;
    }
    if (!any) break;
    m.machine = with(m.machine, m.nuisances.numbers);
    evidence.anchor(m.machine);
    stay(evidence, m);
    converge_exactly(evidence, m);
  }
  return m;
}

void settle_at(Evidence& evidence, FittedMachine& m) {
  m.machine = with(with(m.machine, m.numbers()), m.nuisances.numbers);
  anchor_at(evidence, m);
  m.columns = columns_of(evidence, m.machine, m.prediction, m.numbers());
  m.held_out = Ground(evidence, m.residual, m.linear()).held_out;
  converge_exactly(evidence, m);
}

void settle_in(Evidence& evidence, FittedMachine& m, const NoUse& no_use) {
  constexpr double kNoGainYet = std::numeric_limits<double>::infinity();
  anchor_at(evidence, m);
  fit_in_rounds(evidence, m, concerned(m), kNoGainYet, no_use);
  double pulled = 0;
  for (const FreedNumber& n : m.nuisances.numbers) pulled = std::max(pulled, std::abs(n.pull()));
  const bool stands_in = pulled > kPulledOut,
             may_gain = pulled > kPulledFar && m.held_out > no_use.little;
  if ((stands_in || may_gain) && m.held_out < no_use.much) {
    FittedMachine anew = as_if_never_pulled(evidence, m);
    fit_in_rounds(evidence, anew, every(anew), kNoGainYet, no_use);
    if (misfit(evidence, anew) < misfit(evidence, m))
      m = std::move(anew);
    else
      evidence.anchor(m.machine);
  }
}

}  // namespace vcnc
