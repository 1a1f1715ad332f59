#include "diagnosis/selection/appraisal.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "diagnosis/fit/needed_numbers.hpp"

namespace vcnc {
namespace {

/// Chi-square, or part of what gains are alike by, for which a number may be as declared.
constexpr double kNeedless = 12, kNeedlessPart = 0.1;

}  // namespace

Appraisal::Appraisal(const ContestRules& rules, const FittedMachine& now)
    : rules_(rules),
      now_(now),
      linear_(now.linear()),
      ground_(rules.evidence, now.residual, linear_),
      doubt_(now.found() == 0 ? doubt_of(rules.options, now.rounding)
                              : doubt_of(rules.options, now.explained(), rules.base_of,
                                         ground_.held_out_of, now.rounding)),
      doubt_anywhere_(doubt_of(rules.options, now.rounding)),
      acting_(now.acting()) {
  if (any_at_rest())
    at_rest_ =
        chi2_at_rest(rules.evidence, less(now.residual, linear_.columns, ground_.step), acting_);
}

double Appraisal::band_of(double gain) const {
  return rules_.options.class_gain +
         rules_.options.class_share * rules_.excess(ground_.held_out - gain) +
         rules_.options.class_doubt *
             std::min(std::max(0.0, gain), std::accumulate(doubt_.begin(), doubt_.end(), 0.0));
}

double Appraisal::counts(const Contender& c) const {
  return counts(c.gain, c.fit.held_out_of, [&] {
    const LinearPart others = without(linear_, c.numbers);
    const bool of_all = c.fit.linear_step.size() == ground_.step.size();  // released along a column
    return less(c.fit.residual, of_all ? linear_.columns : others.columns, c.fit.linear_step);
  });
}

double Appraisal::counts(const FittedMachine& m) const {
  const LinearPart linear = m.linear();
  const Ground ground(rules_.evidence, m.residual, linear);
  return counts(ground_.held_out - m.held_out, ground.held_out_of,
                [&] { return less(m.residual, linear.columns, ground.step); });
}

bool Appraisal::counts_enough(const FittedMachine& m, std::size_t candidate) const {
  return counts(m) >
         needed_of({candidate}, Ground(rules_.evidence, m.residual, m.linear()).held_out_of);
}

double Appraisal::counts(double gain, const std::vector<double>& after,
                         const std::function<Column()>& left) const {
  std::vector<double> at_rest(after.size(), 0.0);
  if (!at_rest_.empty()) {
    at_rest = chi2_at_rest(rules_.evidence, left(), acting_);
    for (std::size_t c = 0; c < after.size(); ++c) at_rest[c] = at_rest_[c] - at_rest[c];
  }
  const auto of = [&](double all) {
    return counted(all, ground_.held_out_of, after, doubt_, doubt_anywhere_, at_rest);
  };
  // A tolerance that is not strained any more is no gain where none of the samples' counts.
  double of_samples = 0;
  for (std::size_t c = 0; c < after.size(); ++c) of_samples += ground_.held_out_of[c] - after[c];
  const double count = of(of_samples);
  return count <= 0 ? count : of(gain);
}

double Appraisal::needed_of(const Contender& c) const {
  if (c.released.empty()) return needed_of({c.candidate}, c.fit.held_out_of);
  return std::max(rules_.options.release_gain,
                  needed_at({drive_of(c.released, rules_.candidates)}, c.fit.held_out_of));
}

double Appraisal::needed_of(const std::vector<std::size_t>& together,
                            const std::vector<double>& after) const {
  std::set<std::string> drives;
  for (const std::size_t c : together)
    if (is_of_drive(rules_.candidates[c])) drives.insert(rules_.candidates[c].place);
  return needed_at(drives, after);
}

double Appraisal::needed_at(const std::set<std::string>& drives,
                            const std::vector<double>& after) const {
  const double needed = rules_.threshold(ground_.held_out_of, after);
  const std::set<std::string> found = drives_found(now_, rules_.candidates);
  if (std::none_of(drives.begin(), drives.end(),
                   [&](const std::string& drive) { return found.contains(drive); }))
    return needed;
  return std::max(
      needed, rules_.options.share_beside * rules_.left_where_gained(ground_.held_out_of, after));
}

/// Held-out gain per condition: an effect that shows under several must help under two.
bool Appraisal::under_two_conditions(const Contender& c) const {
  const Evidence& evidence = rules_.evidence;
  if (evidence.partition().conditions() < 2) return true;
  const LinearPart others = without(linear_, c.numbers);
  std::vector<const Column*> before{&now_.residual}, after{&c.fit.residual};
  for (const Column& n : others.columns) {
    before.push_back(&n);
    after.push_back(&n);
  }
  const BlockGrams g0 = evidence.grams(before), g1 = evidence.grams(after);
  const Eigen::VectorXd step0 =
      linear_step(evidence.sum(g0, Role::fitted), evidence.sum(g0, Role::held_out),
                  others.precision(), others.offset())
          .step;
  std::map<int, double> gains;
  for (std::size_t b = 0; b < g0.size(); ++b) {
    const RecordBlock& block = evidence.partition().blocks[b];
    if (block.held_out)
      gains[block.condition] += left_after(g0[b], step0) - left_after(g1[b], c.fit.linear_step);
  }
  double sum = 0, largest = 0;
  int helped = 0;
  for (const auto& [condition, gain] : gains) {
    sum += std::abs(gain);
    largest = std::max(largest, gain);
    helped += gain > 2;
  }
  // It may show under one condition only; then it must do no harm under the others.
  return helped >= 2 ||
         (helped == 1 && largest > 0.99 * sum && largest > 4 * rules_.options.least_gain);
}

std::set<std::string> Appraisal::needless_among(const std::vector<FreedNumber>& numbers,
                                                const std::vector<Column>& columns,
                                                double gain) const {
  if (numbers.size() < 2 || columns.size() != numbers.size()) return {};
  const std::vector<const Column*> own = pointers(columns);
  const RoleGrams products = bordered(ground_.grams, rules_.evidence.cross(ground_.columns, own),
                                      rules_.evidence.cross(own, own));
  // Those that the effect replaces are none any more.
  std::vector<FreedNumber> all;
  std::vector<Eigen::Index> which;
  std::vector<double> prior;
  for (std::size_t i = 0; i < linear_.numbers.size() + numbers.size(); ++i) {
    const bool linear = i < linear_.numbers.size();
    const FreedNumber& n = linear ? linear_.numbers[i] : numbers[i - linear_.numbers.size()];
    if (linear && has_key(numbers, n.number.key)) continue;
    all.push_back(n);
    which.push_back(static_cast<Eigen::Index>(i) + 1);
    prior.push_back(linear ? ground_.precision[static_cast<Eigen::Index>(i)] : 0);
  }
  Eigen::MatrixXd information = products.fitted(which, which) + products.held_out(which, which);
  information.diagonal() +=
      Eigen::Map<const Eigen::VectorXd>(prior.data(), static_cast<Eigen::Index>(prior.size()));
  return needless_of(numbers, all, information, now_.machine,
                     std::max(kNeedless, kNeedlessPart * band_of(gain)));
}

void Appraisal::find_needless(Contender& c) const {
  if (c.released.empty()) c.needless = needless_among(c.numbers, c.fit.columns, c.gain);
}

/// Whether there are samples at which nothing of what was found does anything.
bool Appraisal::any_at_rest() const {
  return !acting_.empty() && std::none_of(acting_.begin(), acting_.end(),
                                          [](const ActingSlices& a) { return a.empty(); });
}

}  // namespace vcnc
