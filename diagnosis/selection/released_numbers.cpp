#include "diagnosis/selection/released_numbers.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/candidates/suspects.hpp"
#include "diagnosis/candidates/trial.hpp"

namespace vcnc {
namespace {

constexpr double kWorthAFit = 0.5;  ///< of another gain, that sensitivities must promise
constexpr double kLongWay = 9;      ///< tolerances, where sensitivities are others

/// A long way off its declaration a number may do better than sensitivities tell.
void refit_far(const Appraisal& appraisal, double least, std::vector<Contender>& all) {
  appraisal.rules().evidence.each_together(all.size(), [&](std::size_t i) {
    Contender& c = all[i];
    const FreedNumber& n = c.numbers.front();
    if (c.gain < least || std::abs(n.value - n.centre) < kLongWay * n.tolerance) return;
    c.numbers.front().tolerance = 0;
    Refit fit = refit(appraisal.rules().evidence, appraisal.machine().machine, c.numbers,
                      without(appraisal.linear(), c.numbers), {.max_iterations = kGlance});
    const double gain = appraisal.held_out() - fit.held_out;
    if (gain <= c.gain) return;
    c.gain = gain;
    c.numbers = fit.live;
    c.fit = std::move(fit);
  });
}

}  // namespace

bool may_be_out(const FreedNumber& n) {
  return !n.common() && n.tolerance > 0 && !is_clamping(n.number.key);
}

bool may_be_released(const DiagnosisOptions& options, const FreedNumber& n) {
  return may_be_out(n) && is_suspected(options.suspects, n.number.key);
}

std::vector<Contender> released_numbers(const Appraisal& appraisal, Released which,
                                        double as_much) {
  const ContestRules& rules = appraisal.rules();
  const FittedMachine& now = appraisal.machine();
  const Ground& ground = appraisal.ground();
  std::vector<Contender> all;
  for (std::size_t i = 0; i < now.nuisances.numbers.size(); ++i) {
    const FreedNumber& n = now.nuisances.numbers[i];
    const double far = rules.options.out_of_tolerance;
    if (!may_be_released(rules.options, n) ||
        (which == Released::where_pulled && !n.held && std::abs(n.pull()) < far))
      continue;
    Eigen::VectorXd precision = ground.precision;
    precision[static_cast<Eigen::Index>(i)] = 0;
    const LinearStep s = linear_step(ground.grams.fitted, ground.grams.held_out, precision,
                                     appraisal.linear().offset());
    const double value = n.value + s.step[static_cast<Eigen::Index>(i)] * n.number.typical;
    if (value < n.number.min || value > n.number.max ||
        std::abs(value - n.centre) < far * n.tolerance)
      continue;
    Contender c;
    c.released = n.number.key;
    c.numbers = {n};
    c.gain = ground.held_out - s.held_out;
    c.fit.held_out_of = left_after(ground.grams.held_out_of, s.step);
    c.fit.residual = now.residual;
    c.fit.linear_step = s.step;
    all.push_back(std::move(c));
    all.back().numbers.front().value = value;
    all.back().numbers.front().held = false;
  }
  refit_far(appraisal, kWorthAFit * as_much, all);
  return all;
}

std::vector<TrialColumns> lifted_numbers(const Appraisal& appraisal) {
  const ContestRules& rules = appraisal.rules();
  const FittedMachine& now = appraisal.machine();
  std::vector<TrialColumns> all;
  for (std::size_t c = 0; c < rules.candidates.size(); ++c) {
    const std::vector<FreeNumber>& numbers = rules.candidates[c].numbers;
    const auto moves = [](const FreeNumber& n) { return !is_fixed(n); };
    const auto own = std::find_if(numbers.begin(), numbers.end(), moves);
    if (std::count_if(numbers.begin(), numbers.end(), moves) != 1) continue;
    for (std::size_t i = 0; i < now.nuisances.numbers.size(); ++i) {
      const FreedNumber& n = now.nuisances.numbers[i];
      if (n.number.key != own->key || !may_be_released(rules.options, n)) continue;
      TrialColumns t;
      t.trial.candidate = c;
      for (const FreeNumber& f : numbers)
        t.trial.values.push_back(f.key == n.number.key ? n.value : number_of(now.machine, f.key));
      t.trial.directions = {
          {.number = static_cast<std::size_t>(own - numbers.begin()), .step = n.number.typical}};
      const std::vector<const Column*> column{&now.nuisances.columns[i]};
      t.columns = {PackedColumn(*column.front())};
      t.own = rules.evidence.cross(column, column);
      all.push_back(std::move(t));
    }
  }
  return all;
}

bool is_out_of_tolerance(const Appraisal& appraisal, const std::vector<FreedNumber>& numbers) {
  for (const FreedNumber& n : numbers)
    for (const FreedNumber& declared : appraisal.machine().nuisances.numbers)
      if (n.number.key == declared.number.key &&
          std::abs(n.value - declared.centre) <
              appraisal.rules().options.out_of_tolerance * declared.tolerance)
        return false;
  return true;
}

}  // namespace vcnc
