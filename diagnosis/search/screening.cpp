#include "diagnosis/search/screening.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "diagnosis/search/parallel.hpp"

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

std::vector<const Column*> pointers(const std::vector<Column>& columns) {
  std::vector<const Column*> all;
  for (const Column& c : columns) all.push_back(&c);
  return all;
}

struct Gain {
  double gain = 0;
  Eigen::VectorXd size;
};

/// Of columns with the products `across` with the ground and their `own`.
Gain gain_of(const Ground& ground, const RoleGrams& across, const RoleGrams& own) {
  const Eigen::Index more = own.fitted.rows();
  const LinearStep full =
      linear_step(bordered(ground.grams.fitted, across.fitted, own.fitted),
                  bordered(ground.grams.held_out, across.held_out, own.held_out),
                  padded(ground.precision, more), padded(ground.offset, more));
  return {ground.held_out - full.held_out, full.step.tail(more)};
}

Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(a.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
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
    for (std::size_t d = 0; d < all[t].columns.size(); ++d) jobs.emplace_back(t, d);
  }
  // Those of one place together: they move the same axis.
  std::stable_sort(jobs.begin(), jobs.end(), [&](const auto& x, const auto& y) {
    const auto place = [&](const auto& job) -> const std::string& {
      return candidates[all[job.first].trial.candidate].place;
    };
    return place(x) < place(y);
  });
  const std::size_t parts = (jobs.size() + Evidence::kTogether - 1) / Evidence::kTogether;
  std::atomic<bool> go = true;
  std::atomic<std::size_t> done = 0;
  parallel_for(parts, [&](std::size_t part) {
    if (!go) return;
    const std::size_t first = part * Evidence::kTogether,
                      last = std::min(first + Evidence::kTogether, jobs.size());
    std::vector<Machine> changed;
    for (std::size_t j = first; j < last; ++j) {
      const Trial& trial = all[jobs[j].first].trial;
      changed.push_back(
          machine_of(base, candidates[trial.candidate], trial, trial.directions[jobs[j].second]));
    }
    std::vector<Prediction> predictions = evidence.predict_all(changed);
    for (std::size_t j = first; j < last; ++j) {
      Prediction& p = predictions[j - first];
      all[jobs[j].first].columns[jobs[j].second] = evidence.sensitivity(prediction, p, 1);
      p.clear();
    }
    const double share = static_cast<double>(++done) / static_cast<double>(parts);
    if (!keep_going(share)) go = false;
  });
  const Column nothing(Column::Channels(prediction.size()));
  parallel_for(all.size(), [&](std::size_t t) {
    for (Column& c : all[t].columns)
      if (c.size() == 0) c = nothing;
    const std::vector<const Column*> own = pointers(all[t].columns);
    all[t].own = evidence.cross(own, own);
  });
  return all;
}

void RememberedProducts::learn(const Evidence& evidence, const std::vector<const Column*>& others,
                               const std::vector<Column>& columns) {
  const auto known = [&](const Column* other) {
    return std::find_if(others_.begin(), others_.end(),
                        [&](const Column& c) { return c.shares(*other); });
  };
  std::vector<const Column*> missing;
  for (const Column* other : others)
    if (known(other) == others_.end()) missing.push_back(other);
  const RoleGrams fresh = evidence.cross(missing, pointers(columns));
  const auto rows = static_cast<Eigen::Index>(others.size()),
             cols = static_cast<Eigen::Index>(columns.size());
  RoleGrams all{Eigen::MatrixXd(rows, cols), Eigen::MatrixXd(rows, cols)};
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto r = known(others[static_cast<std::size_t>(i)]);
    const bool old = r != others_.end();
    const RoleGrams& from = old ? products_ : fresh;
    const Eigen::Index row = old ? r - others_.begin() : next++;
    all.fitted.row(i) = from.fitted.row(row);
    all.held_out.row(i) = from.held_out.row(row);
  }
  products_ = std::move(all);
  others_.clear();
  for (const Column* other : others) others_.push_back(*other);
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
    t.ground.learn(evidence, ground.columns, t.columns);
    const RoleGrams& across = t.ground.products();
    double information = 0;  // of the best direction, in steps
    for (std::size_t d = 0; d < t.columns.size(); ++d) {
      const auto at = static_cast<Eigen::Index>(d);
      const double all = t.own.fitted(at, at) + t.own.held_out(at, at);
      const Eigen::VectorXd nc = (across.fitted + across.held_out).block(1, at, n, 1);
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
                             std::vector<TrialColumns>& trials) {
  std::vector<Screened> all(trials.size());
  parallel_for(trials.size(), [&](std::size_t i) {
    all[i].trial = i;
    TrialColumns& t = trials[i];
    if (std::all_of(t.columns.begin(), t.columns.end(), [](const Column& c) { return c.zero(); }))
      return;
    t.ground.learn(evidence, ground.columns, t.columns);
    Gain g = gain_of(ground, t.ground.products(), t.own);
    if (possible(candidates[t.trial.candidate], t.trial, g.size)) all[i].gain = g.gain;
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
  const RoleGrams &with_a = a.ground.products(), &with_b = b.ground.products(),
                  ab = evidence.cross(pointers(a.columns), pointers(b.columns));
  Gain g = gain_of(ground,
                   {beside(with_a.fitted, with_b.fitted), beside(with_a.held_out, with_b.held_out)},
                   {bordered(a.own.fitted, ab.fitted, b.own.fitted),
                    bordered(a.own.held_out, ab.held_out, b.own.held_out)});
  size = std::move(g.size);
  return g.gain;
}

}  // namespace vcnc
