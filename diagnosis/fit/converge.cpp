#include "diagnosis/fit/converge.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/fit/misfit.hpp"
#include "diagnosis/fit/refit.hpp"

namespace vcnc {
namespace {

constexpr double kDamping = 1e-3;       ///< of steps that fail undamped (refit.hpp)
constexpr double kNoStep = 1;           ///< chi-square that no step is worth
constexpr double kMuch = 10;            ///< and that a part of the step is worth to be sought for
constexpr double kBeyondPromise = 0.1;  ///< of what a step promises, that it may do better by
constexpr double kFarthestStep = 64;    ///< times what sensitivities tell

/// Goes as far towards a refit as makes the misfit smaller: sensitivities are not everywhere what
/// they are where they were taken. False: not a step.
bool step_towards(const Evidence& evidence, FittedMachine& m, const Refit& f,
                  const std::vector<double>& weight, double least) {
  if (least - f.fitted < kNoStep) return false;
  std::vector<FreedNumber> old = m.nuisances.numbers;
  for (const FreedNumber& n : m.numbers()) old.push_back(n);
  const auto at = [&](const std::vector<double>& shares) {
    std::vector<Refit> parts(shares.size(), f);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      Refit& part = parts[i];
      part.linear = between(old, f.linear, shares[i]);
      part.live = between(old, f.live, shares[i]);
      part.machine = with(with(m.machine, part.live), part.linear);
    }
    return moved_to(evidence, m, parts);
  };
  const auto misfit_of = [&](const FittedMachine& trial) {
    return misfit(evidence, trial.residual, weight, trial.nuisances.numbers);
  };
  FittedMachine whole = std::move(at({1.0}).front());
  double now = misfit_of(whole);
  if (now < least) {
    // What is rough about the sensitivities makes steps too short: where one does better than it
    // promised, one goes on.
    const bool better = f.fitted - now > kNoStep + kBeyondPromise * (least - f.fitted);
    for (double more = 2; better && more <= kFarthestStep; more *= 2) {
      FittedMachine farther = std::move(at({more}).front());
      const double then = misfit_of(farther);
      if (then > now - kNoStep) break;
      whole = std::move(farther);
      now = then;
    }
    m = std::move(whole);
    return true;
  }
  if ((now > least && now - least < kNoStep) || least - f.fitted <= kMuch) return false;
  for (FittedMachine& part : at({0.5, 0.2, 0.05})) {  // side by side (lanes)
    now = misfit_of(part);
    if (now > least && now - least < kNoStep) return false;
    if (!(now < least)) continue;
    m = std::move(part);
    return true;
  }
  return false;
}

/// Whether two refits of the same machine go to the same place: linear numbers but for a twentieth
/// of their way, live ones, which damping hardly moves, but for a twentieth of themselves.
bool leads_the_same_way(const Refit& a, const Refit& b) {
  constexpr double kOfTheWay = 0.05;
  const auto apart = [](double x, double y) {
    return std::abs(x - y) > kOfTheWay * std::max(std::abs(x), std::abs(y));
  };
  for (Eigen::Index i = 0; i < a.linear_step.size(); ++i)
    if (apart(a.linear_step[i], b.linear_step[i])) return false;
  return std::equal(
      a.live.begin(), a.live.end(), b.live.begin(),
      [&](const FreedNumber& x, const FreedNumber& y) { return !apart(x.value, y.value); });
}

}  // namespace

void converge(const Evidence& evidence, FittedMachine& m) {
  constexpr int kRounds = 3;
  double before = m.held_out;
  Column residual = evidence.residual(evidence.predict(m.machine));
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<FreedNumber> live = m.numbers();
    const std::vector<double> weight = weights_of_channels(evidence, residual);
    const double least = misfit(evidence, residual, weight, m.nuisances.numbers);
    const auto promise = [&](double damping) {
      return refit(evidence, m.machine, live, without(m.nuisances, live),
                   {.max_iterations = 8, .weight = weight, .damping = damping});
    };
    // What undamped steps promise and do not keep, damped ones may, if they are others.
    const auto damped = [&](const Refit& undamped) {
      if (least - undamped.fitted < kMuch) return false;
      const Refit f = promise(kDamping);
      return !leads_the_same_way(f, undamped) && step_towards(evidence, m, f, weight, least);
    };
    const Refit undamped = promise(0);
    if (!step_towards(evidence, m, undamped, weight, least) && !damped(undamped)) {
      if (round == 0) stay(evidence, m);
      break;
    }
    residual = m.residual;
    const double now = m.held_out;
    if (std::abs(before - now) < 1 + 1e-4 * std::abs(now - evidence.count(Role::held_out))) break;
    before = now;
  }
}

}  // namespace vcnc
