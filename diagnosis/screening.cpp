#include "diagnosis/screening.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "diagnosis/parallel.hpp"

namespace vcnc {
namespace {

/// Precision and offset of the linear numbers, and nothing known of `more` further ones.
Eigen::VectorXd padded(const Eigen::VectorXd& v, Eigen::Index more) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size() + more);
  out.head(v.size()) = v;
  return out;
}

Eigen::MatrixXd bordered(const Eigen::MatrixXd& a, const Eigen::MatrixXd& cross,
                         const Eigen::MatrixXd& b) {
  Eigen::MatrixXd all(a.rows() + b.rows(), a.cols() + b.cols());
  all << a, cross, cross.transpose(), b;
  return all;
}

std::vector<const Column*> columns_of(const std::vector<const TrialColumns*>& trials) {
  std::vector<const Column*> all;
  for (const TrialColumns* t : trials)
    for (const Column& c : t->columns) all.push_back(&c);
  return all;
}

struct Gain {
  double gain = 0;
  Eigen::VectorXd size;
};

Gain gain_of(const Evidence& evidence, const Ground& ground,
             const std::vector<const TrialColumns*>& trials) {
  const std::vector<const Column*> columns = columns_of(trials);
  const RoleGrams across = evidence.cross(ground.columns, columns);
  const RoleGrams own = evidence.cross(columns, columns);
  const auto more = static_cast<Eigen::Index>(columns.size());
  const LinearStep full =
      linear_step(bordered(ground.grams.fitted, across.fitted, own.fitted),
                  bordered(ground.grams.held_out, across.held_out, own.held_out),
                  padded(ground.precision, more), padded(ground.offset, more));
  return {ground.held_out - full.held_out, full.step.tail(more)};
}

/// Whether the sizes are of a kind the candidate can have.
bool possible(const Candidate& candidate, const Trial& trial, const Eigen::VectorXd& size) {
  const bool two = std::any_of(trial.directions.begin(), trial.directions.end(),
                               [](const Direction& d) { return d.quadrature; });
  if (two) return true;
  bool any = false;
  for (std::size_t d = 0; d < trial.directions.size(); ++d) {
    const Direction& direction = trial.directions[d];
    const double at =
        trial.values[direction.number] + size[static_cast<Eigen::Index>(d)] * direction.step;
    const FreeNumber& n = candidate.numbers[direction.number];
    const double slack = 1e-3 * std::abs(n.typical);
    any = any || (at >= n.min - slack && at <= n.max + slack);
  }
  return any;
}

}  // namespace

std::vector<TrialColumns> simulate_trials(const Evidence& evidence, const Machine& base,
                                          const Prediction& prediction,
                                          const std::vector<Candidate>& candidates,
                                          std::vector<Trial> trials,
                                          const std::function<bool(double)>& keep_going) {
  std::vector<TrialColumns> all(trials.size());
  std::vector<std::pair<std::size_t, std::size_t>> jobs;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    all[t].trial = std::move(trials[t]);
    all[t].columns.resize(all[t].trial.directions.size());
    for (Column& c : all[t].columns) c.resize(prediction.size());
    for (std::size_t d = 0; d < all[t].columns.size(); ++d) jobs.emplace_back(t, d);
  }
  std::atomic<bool> go = true;
  std::atomic<std::size_t> done = 0;
  parallel_for(jobs.size(), [&](std::size_t j) {
    if (!go) return;
    const auto [t, d] = jobs[j];
    const Trial& trial = all[t].trial;
    const Machine changed =
        machine_of(base, candidates[trial.candidate], trial, trial.directions[d]);
    all[t].columns[d] = evidence.sensitivity(prediction, evidence.predict(changed), 1);
    const double share = static_cast<double>(++done) / static_cast<double>(jobs.size());
    if (!keep_going(share)) go = false;
  });
  return all;
}

Ground::Ground(const Evidence& evidence, const Column& residual, const LinearPart& linear)
    : columns{&residual}, precision(linear.precision()), offset(linear.offset()) {
  for (const Column& c : linear.columns) columns.push_back(&c);
  const BlockGrams blocks = evidence.grams(columns);
  grams = {evidence.sum(blocks, Role::fitted), evidence.sum(blocks, Role::held_out)};
  held_out = linear_step(grams.fitted, grams.held_out, precision, offset).held_out;
}

void find_detection_limits(const Evidence& evidence, const Ground& ground,
                           std::vector<TrialColumns>& trials) {
  const Eigen::Index n = ground.precision.size();
  Eigen::MatrixXd a = (ground.grams.fitted + ground.grams.held_out).block(1, 1, n, n);
  a.diagonal() += ground.precision;
  a.diagonal().array() += 1e-10 * (1e-6 + a.diagonal().array());
  const Eigen::LDLT<Eigen::MatrixXd> factor(a);
  parallel_for(trials.size(), [&](std::size_t i) {
    TrialColumns& t = trials[i];
    const RoleGrams across = evidence.cross(ground.columns, columns_of({&t}));
    double information = 0;  // of the best direction, in steps
    for (std::size_t d = 0; d < t.columns.size(); ++d) {
      const RoleGrams own = evidence.cross({&t.columns[d]}, {&t.columns[d]});
      const double all = own.fitted(0, 0) + own.held_out(0, 0);
      const Eigen::VectorXd nc =
          (across.fitted + across.held_out).block(1, static_cast<Eigen::Index>(d), n, 1);
      const double left = all - (n > 0 ? nc.dot(factor.solve(nc)) : 0);
      // What is left of a column that the others can make up is rounding.
      if (left > 1e-6 * all) information = std::max(information, left);
    }
    if (information > 0)
      t.detection_limit = 5 / std::sqrt(information) * std::abs(t.trial.directions.front().step);
  });
}

std::vector<Screened> screen(const Evidence& evidence, const Ground& ground,
                             const std::vector<Candidate>& candidates,
                             const std::vector<TrialColumns>& trials) {
  std::vector<Screened> all(trials.size());
  parallel_for(trials.size(), [&](std::size_t i) {
    all[i].trial = i;
    const bool excited =
        std::any_of(trials[i].columns.begin(), trials[i].columns.end(), [](const Column& c) {
          return std::any_of(c.begin(), c.end(), [](const auto& z) { return !z.empty(); });
        });
    if (!excited) return;
    Gain g = gain_of(evidence, ground, {&trials[i]});
    const Trial& trial = trials[i].trial;
    if (possible(candidates[trial.candidate], trial, g.size)) all[i].gain = g.gain;
    all[i].size = std::move(g.size);
  });
  std::vector<Screened> best;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Screened* of = nullptr;
    for (const Screened& s : all)
      if (trials[s.trial].trial.candidate == c && s.size.size() > 0 && (!of || s.gain > of->gain))
        of = &s;
    if (of) best.push_back(*of);
  }
  std::stable_sort(best.begin(), best.end(),
                   [](const Screened& x, const Screened& y) { return x.gain > y.gain; });
  return best;
}

double pair_gain(const Evidence& evidence, const Ground& ground, const TrialColumns& a,
                 const TrialColumns& b, Eigen::VectorXd& size) {
  Gain g = gain_of(evidence, ground, {&a, &b});
  size = std::move(g.size);
  return g.gain;
}

}  // namespace vcnc
