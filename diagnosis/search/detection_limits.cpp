#include "diagnosis/search/detection_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "diagnosis/search/parallel.hpp"

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

/// Steps at which as much gain counts as is needed, from the gain of one step in each channel.
double steps_to(const std::vector<double>& per_step, const Needed& needed) {
  const auto counts = [&](double squared) {
    double sum = 0;
    for (std::size_t c = 0; c < per_step.size(); ++c)
      sum += std::max(0.0, per_step[c] * squared - (needed.doubt.empty() ? 0 : needed.doubt[c]));
    return sum;
  };
  double low = 1e-24, high = 1e24;
  if (counts(high) < needed.counted_gain) return kNever;
  while (high / low > 1.0001) {
    const double middle = std::sqrt(low * high);
    (counts(middle) < needed.counted_gain ? low : high) = middle;
  }
  return std::sqrt(high);
}

/// Steps at which one consequence at least is what is needed.
double steps_to(const Consequence& per_step, const Consequence& needed) {
  return std::min(needed.contour_um / per_step.contour_um,
                  needed.of_noise_but_readings / per_step.of_noise_but_readings);
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

void find_detection_limits(const Evidence& evidence, const Ground& ground, const Needed& needed,
                           std::vector<TrialColumns>& trials) {
  const Eigen::Index n = ground.precision.size();
  const Eigen::LDLT<Eigen::MatrixXd> factor(information_of(ground));
  parallel_for(trials.size(), [&](std::size_t i) {
    TrialColumns& t = trials[i];
    t.ground.learn(evidence, ground.columns, t.columns);
    const RoleGrams& across = t.ground.products();
    double steps = kNever;
    for (std::size_t d = 0; d < t.columns.size(); ++d) {
      const auto at = static_cast<Eigen::Index>(d);
      const double all = t.own.fitted(at, at) + t.own.held_out(at, at);
      const Eigen::VectorXd nc = (across.fitted + across.held_out).block(1, at, n, 1);
      const Eigen::VectorXd others = n > 0 ? Eigen::VectorXd(factor.solve(nc)) : nc;
      const double left = all - nc.dot(others);
      // What is left of a column that the others can make up is rounding.
      if (!(left > 1e-6 * all)) continue;
      std::vector<double> per_step;  // gain in each channel
      for (std::size_t c = 0; c < across.held_out_of.size(); ++c)
        per_step.push_back(t.own.held_out_of[c](at, at) -
                           2 * others.dot(across.held_out_of[c].block(1, at, n, 1).col(0)) +
                           others.dot(ground.grams.held_out_of[c].block(1, 1, n, n) * others));
      const double of_this = std::max({kDeviations / std::sqrt(left), steps_to(per_step, needed),
                                       steps_to(t.consequence[d], needed.consequence)});
      if (of_this < steps) steps = of_this, t.shows_first = d;
    }
    const Direction& first = t.trial.directions.front();
    if (first.whole)
      t.detection_limit = steps <= 1 ? std::abs(t.trial.values[first.number] + first.step) : kNever;
    else
      t.detection_limit = steps * std::abs(first.step);
  });
}

void try_detection_limits(const Evidence& evidence, const Machine& base,
                          const Prediction& prediction, const std::vector<Candidate>& candidates,
                          const Ground& ground, const Needed& needed,
                          const std::function<bool(double)>& keep_going,
                          std::vector<TrialColumns>& trials) {
  std::vector<Bracket> open = far_below(trials);
  while (!open.empty()) {
    std::vector<Trial> sizes;
    for (const Bracket& b : open) sizes.push_back(at_size(trials[b.trial], b.next()));
    std::vector<TrialColumns> tried =
        simulate_trials(evidence, base, prediction, candidates, std::move(sizes), keep_going);
    if (!keep_going(1)) return;
    find_detection_limits(evidence, ground, needed, tried);
    for (std::size_t i = 0; i < open.size(); ++i) {
      Bracket& b = open[i];
      b.narrow(b.next(), b.next() * limit_in_steps(tried[i]));
      if (!b.closed()) continue;
      const std::size_t of = trials[b.trial].trial.candidate;
      for (TrialColumns& t : trials)
        if (t.trial.candidate == of) t.detection_limit *= b.seen / b.linear;
    }
    std::erase_if(open, [](const Bracket& b) { return b.closed(); });
  }
}

std::vector<double> release_limits(const Ground& ground, const std::vector<FreedNumber>& numbers,
                                   double pull, double gain) {
  const Eigen::Index n = ground.precision.size();
  const Eigen::MatrixXd inverse =
      information_of(ground).ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)));
  std::vector<double> limits(numbers.size(), kNever);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double prior = ground.precision[at], information = 1 / inverse(at, at) - prior;
    if (prior <= 0 || information <= 1e-6 * prior) continue;
    // What data and tolerance agree on is information / (information + prior) of the change.
    const double pulled = pull / std::sqrt(prior) * (information + prior) / information;
    const double gained = std::sqrt(gain / information);
    limits[i] = std::max(pulled, gained) * numbers[i].number.typical;
  }
  return limits;
}

}  // namespace vcnc
