#include "diagnosis/commissioning/best_first.hpp"

#include <algorithm>
#include <numeric>

#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/ground.hpp"
#include "diagnosis/fit/refit.hpp"

namespace vcnc {
namespace {

constexpr double kFixed = 1e12;  ///< precision of a number that stays

/// Held-out chi-square that is left with more numbers, as far as their sensitivities tell; those
/// that these take beyond their range stay where they are.
double promised(const Evidence& evidence, const FittedMachine& machine, FittedMachine more) {
  std::vector<FreedNumber> added = more.numbers();
  added.erase(added.begin(), added.begin() + static_cast<std::ptrdiff_t>(machine.columns.size()));
  take_values(added, machine.machine);
  for (Column& c : columns_of(evidence, machine.machine, machine.prediction, added))
    more.columns.push_back(std::move(c));
  const LinearPart linear = more.linear();
  const Ground ground(evidence, machine.residual, linear);
  Eigen::VectorXd precision = ground.precision, offset = ground.offset;
  const auto first = static_cast<Eigen::Index>(linear.numbers.size() - added.size());
  const auto step = [&] {
    return linear_step(ground.grams.fitted, ground.grams.held_out, precision, offset);
  };
  const LinearStep free = step();
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(added.size()); ++i) {
    const FreedNumber& n = added[static_cast<std::size_t>(i)];
    const double value = n.value + free.step[first + i] * n.number.typical;
    if (n.number.min <= value && value <= n.number.max) continue;
    precision[first + i] = kFixed;
    offset[first + i] = 0;
  }
  return step().held_out;
}

/// Of those that promise half of the most, the best few: sensitivities do not tell which of them
/// does best when it is fitted.
std::vector<std::size_t> promising(const FittedMachine& now,
                                   const std::vector<std::size_t>& candidates,
                                   const std::vector<double>& promise) {
  constexpr std::size_t kFew = 3;
  constexpr double kHalfAsGood = 0.5;
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t x, std::size_t y) { return promise[x] < promise[y]; });
  const double enough = now.held_out - kHalfAsGood * (now.held_out - promise[order.front()]);
  std::vector<std::size_t> few{candidates[order.front()]};
  for (std::size_t k = 1; k < order.size() && few.size() < kFew; ++k)
    if (promise[order[k]] <= enough) few.push_back(candidates[order[k]]);
  return few;
}

}  // namespace

void fit_best_of(MachineInFit& in, std::vector<std::size_t> left, const std::string& place,
                 FrictionFit* friction, const std::function<bool()>& go_on) {
  constexpr int kAnew = 3;  // gains beside which the friction is fitted anew: the most promising
  int anew = 0;
  while (!left.empty() && go_on()) {
    std::vector<double> promise(left.size());
    in.evidence.each_together(left.size(), [&](std::size_t i) {
      promise[i] = promised(in.evidence, in.now, in.with_candidates(in.now, {left[i]}));
    });
    const std::vector<std::size_t> few = promising(in.now, left, promise);
    std::vector<FittedMachine> fitted(few.size());
    std::vector<double> leaves(few.size());
    in.evidence.each_together(few.size(), [&](std::size_t i) {
      fitted[i] = in.with_candidates(in.now, {few[i]});
      converge(in.evidence, fitted[i]);
      leaves[i] = fitted[i].held_out;
    });
    const std::size_t best = in.simplest_of_best(few, leaves);
    FittedMachine& better = fitted[best];
    if (!in.gains_enough(in.now, better, place, kShareOfLeft)) return;
    std::erase(left, few[best]);
    if (in.is_as_declared(better)) {
      if (friction && anew++ < kAnew) friction->fit_with(few[best]);
    } else if (!in.stands_for_force(better)) {
      in.accept(std::move(better), place, told(in.candidates[few[best]]));
    }
  }
}

}  // namespace vcnc
