#include "diagnosis/screening/detection_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "diagnosis/parallel.hpp"

namespace vcnc {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kDeviations = 5;  ///< of a number that is seen at all

/// What all laps and the tolerances tell of the declared numbers, of full rank.
Eigen::MatrixXd information_of(const Ground& ground) {
  const Eigen::Index n = ground.precision.size();
  Eigen::MatrixXd a = (ground.grams.fitted + ground.grams.held_out).block(1, 1, n, n);
  a.diagonal() += ground.precision;
  a.diagonal().array() += 1e-10 * (1e-6 + a.diagonal().array());
  return a;
}

/// Steps at which one consequence at least is what is needed.
double steps_to_reach(const Consequence& needed, const Consequence& per_step) {
  return std::min(needed.contour_um / per_step.contour_um,
                  needed.of_noise_but_readings / per_step.of_noise_but_readings);
}

/// In the unit of the first number of a trial.
double in_its_unit(const Trial& trial, double steps) {
  const Direction& first = trial.directions.front();
  if (!first.whole) return steps * std::abs(first.step);
  return steps <= 1 ? std::abs(trial.values[first.number] + first.step) : kNever;
}

constexpr double kFar = 10;   ///< times below what was simulated, so that it is tried
constexpr double kClose = 2;  ///< a limit is known to this factor

/// The least limit of a candidate, in steps of the direction that shows it.
struct Bracket {
  std::size_t trial = 0;  ///< index into the columns
  double linear = 0;      ///< what it was taken for
  double unseen = 0;      ///< the largest size at which it is not told; 0: none known
  double seen = 1;        ///< the smallest at which it is

  bool closed() const { return seen <= kClose * unseen; }
  double next() const { return unseen > 0 ? std::sqrt(unseen * seen) : linear; }
  /// Tried at `size`, from where the limit is `least` if linear.
  void narrow(double size, double least) {
    if (unseen == 0 && least <= kClose * size)
      seen = unseen = std::max(size, least);
    else
      (least <= size ? seen : unseen) = size;
  }
};

/// A trial of one size of the direction that shows first.
Trial at_size(const TrialColumns& t, double steps) {
  Trial trial = t.trial;
  Direction direction = trial.directions[t.shows_first];
  direction.step *= steps;
  trial.directions = {direction};
  return trial;
}

/// In steps of the first direction.
double limit_in_steps(const TrialColumns& t) {
  return t.detection_limit / std::abs(t.trial.directions.front().step);
}

std::vector<Bracket> far_below(const std::vector<TrialColumns>& trials) {
  std::map<std::size_t, std::size_t> least;  // trial of each candidate
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const TrialColumns& t = trials[i];
    if (t.trial.directions.front().whole || !std::isfinite(t.detection_limit)) continue;
    const auto [best, first] = least.try_emplace(t.trial.candidate, i);
    if (t.detection_limit < trials[best->second].detection_limit) best->second = i;
  }
  std::vector<Bracket> all;
  for (const auto& [candidate, i] : least)
    if (const double steps = limit_in_steps(trials[i]); steps * kFar < 1)
      all.push_back({.trial = i, .linear = steps});
  return all;
}

}  // namespace

DetectionLimits::DetectionLimits(const Evidence& evidence, const Ground& ground, Needed needed)
    : evidence_(evidence),
      ground_(ground),
      needed_(std::move(needed)),
      information_(information_of(ground)) {}

double DetectionLimits::steps_to(const std::vector<double>& per_step,
                                 const std::vector<double>& at_rest) const {
  const auto of = [](const std::vector<double>& v, std::size_t c) {
    return c < v.size() ? v[c] : 0.0;
  };
  double all = 0, left = 0;
  for (const double p : per_step) all += std::max(0.0, p);
  for (std::size_t c = 0; c < per_step.size(); ++c)
    if (per_step[c] > kConcerned * all) left += std::max(0.0, of(needed_.left, c));
  const double least = std::max(needed_.counted_gain, needed_.share / (1 - needed_.share) * left);
  const auto counts = [&](double squared) {
    double sum = 0;
    for (std::size_t c = 0; c < per_step.size(); ++c) {
      const double gain = std::max(0.0, per_step[c] * squared);
      const double while_acting = (1 - of(at_rest, c)) * gain;
      sum += gain - std::min({gain, of(needed_.doubt, c),
                              at_rest.empty() ? gain : while_acting + of(needed_.anywhere, c)});
    }
    return sum;
  };
  double low = 1e-24, high = 1e24;
  if (counts(high) < least) return kNever;
  while (high / low > 1.0001) {
    const double middle = std::sqrt(low * high);
    (counts(middle) < least ? low : high) = middle;
  }
  return std::sqrt(high);
}

std::vector<double> DetectionLimits::part_at_rest(const Column& column) const {
  std::vector<double> part = chi2_at_rest(evidence_, column, needed_.acting);
  const std::vector<double> all = evidence_.chi2_of(column, Role::held_out);
  for (std::size_t c = 0; c < part.size(); ++c) part[c] = all[c] > 0 ? part[c] / all[c] : 0;
  return part;
}

DetectionLimits::Limit DetectionLimits::of(TrialColumns& t) const {
  const Eigen::Index n = ground_.precision.size();
  t.ground.learn(evidence_, ground_.columns, t.columns);
  const RoleGrams& across = t.ground.products();
  Limit least;
  for (std::size_t d = 0; d < t.columns.size(); ++d) {
    const auto at = static_cast<Eigen::Index>(d);
    const double all = t.own.fitted(at, at) + t.own.held_out(at, at);
    const Eigen::VectorXd nc = (across.fitted + across.held_out).block(1, at, n, 1);
    const Eigen::VectorXd others = n > 0 ? Eigen::VectorXd(information_.solve(nc)) : nc;
    const double left = all - nc.dot(others);
    // What is left of a column that the others can make up is rounding.
    if (!(left > 1e-6 * all)) continue;
    std::vector<double> per_step;  // gain in each channel
    for (std::size_t c = 0; c < across.held_out_of.size(); ++c)
      per_step.push_back(t.own.held_out_of[c](at, at) -
                         2 * others.dot(across.held_out_of[c].block(1, at, n, 1).col(0)) +
                         others.dot(ground_.grams.held_out_of[c].block(1, 1, n, n) * others));
    const double seen = std::max(kDeviations / std::sqrt(left),
                                 steps_to_reach(needed_.consequence, t.consequence[d]));
    double counted = steps_to(per_step, {});
    if (!needed_.acting.empty() && counted > seen)
      counted = steps_to(per_step, part_at_rest(t.columns[d].unpacked()));
    if (const double steps = std::max(seen, counted); steps < least.steps) least = {steps, d};
  }
  return least;
}

std::vector<double> DetectionLimits::of_releases(const std::vector<FreedNumber>& linear,
                                                 const std::vector<FreedNumber>& numbers,
                                                 double pull) const {
  const Eigen::Index n = ground_.precision.size();
  const Eigen::MatrixXd inverse =
      information_.solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)));
  std::vector<double> limits(numbers.size(), kNever);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto same = std::find_if(linear.begin(), linear.end(), [&](const FreedNumber& l) {
      return l.number.key == numbers[i].number.key;
    });
    if (same == linear.end() || !(numbers[i].tolerance > 0)) continue;
    const auto at = static_cast<Eigen::Index>(same - linear.begin());
    const double typical = numbers[i].number.typical, tolerance = numbers[i].tolerance / typical;
    const double prior = 1 / (tolerance * tolerance);
    const double information = 1 / inverse(at, at) - ground_.precision[at];
    if (information <= 1e-6 * prior) continue;
    const Eigen::VectorXd step = inverse.col(at) / inverse(at, at);  // the others go along
    std::vector<double> per_step;
    for (const Eigen::MatrixXd& g : ground_.grams.held_out_of)
      per_step.push_back(step.dot(g.block(1, 1, n, n) * step));
    // What data and tolerance agree on is information / (information + prior) of the change.
    const double pulled = pull * tolerance * (information + prior) / information;
    limits[i] =
        std::max({pulled, kDeviations / std::sqrt(information), steps_to(per_step, {})}) * typical;
  }
  return limits;
}

double DetectionLimits::in_its_unit(TrialColumns& t) const {
  return t.later_than_linear * vcnc::in_its_unit(t.trial, of(t).steps);
}

void find_detection_limits(const DetectionLimits& limits, std::vector<TrialColumns>& trials) {
  parallel_for(trials.size(), [&](std::size_t i) {
    TrialColumns& t = trials[i];
    const DetectionLimits::Limit limit = limits.of(t);
    t.shows_first = limit.direction;
    t.detection_limit = in_its_unit(t.trial, limit.steps);
  });
}

void try_detection_limits(const Evidence& evidence, const Machine& base,
                          const Prediction& prediction, const std::vector<Candidate>& candidates,
                          const DetectionLimits& limits,
                          const std::function<bool(double)>& keep_going,
                          std::vector<TrialColumns>& trials) {
  std::vector<Bracket> open = far_below(trials);
  while (!open.empty()) {
    std::vector<Trial> sizes;
    for (const Bracket& b : open) sizes.push_back(at_size(trials[b.trial], b.next()));
    std::vector<TrialColumns> tried =
        simulate_trials(evidence, base, prediction, candidates, std::move(sizes), keep_going);
    if (!keep_going(1)) return;
    find_detection_limits(limits, tried);
    for (std::size_t i = 0; i < open.size(); ++i) {
      Bracket& b = open[i];
      b.narrow(b.next(), b.next() * limit_in_steps(tried[i]));
      if (!b.closed()) continue;
      const std::size_t of = trials[b.trial].trial.candidate;
      for (TrialColumns& t : trials)
        if (t.trial.candidate == of) {
          t.later_than_linear = b.seen / b.linear;
          t.detection_limit *= t.later_than_linear;
        }
    }
    std::erase_if(open, [](const Bracket& b) { return b.closed(); });
  }
}

}  // namespace vcnc
