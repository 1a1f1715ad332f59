#include "diagnosis/screening/screening.hpp"

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

std::vector<Column> unpacked(const std::vector<PackedColumn>& columns) {
  std::vector<Column> all;
  for (const PackedColumn& c : columns) all.push_back(c.unpacked());
  return all;
}

struct Gain {
  double gain = 0, counted = 0;
  Eigen::VectorXd size;
};

/// Along the columns of the ground and others, from the products of all.
LinearStep step_of(const Ground& ground, const RoleGrams& all, Eigen::Index more) {
  return linear_step(all.fitted, all.held_out, padded(ground.precision, more),
                     padded(ground.offset, more));
}

/// Of columns with the products `across` with the ground and their `own`.
Gain gain_of(const Ground& ground, const Doubt& doubt, const RoleGrams& across,
             const RoleGrams& own) {
  const Eigen::Index more = own.fitted.rows();
  const RoleGrams all = bordered(ground.grams, across, own);
  const LinearStep full = step_of(ground, all, more);
  const double gain = ground.held_out - full.held_out;
  return {gain,
          gain > 0 && !doubt.empty()
              ? counted(gain, ground.held_out_of, left_after(all.held_out_of, full.step), doubt)
              : gain,
          full.step.tail(more)};
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
    all[t].consequence.resize(all[t].columns.size());
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
      const auto& [t, d] = jobs[j];
      all[t].columns[d] = PackedColumn(evidence.sensitivity(prediction, p, 1));
      all[t].consequence[d] = consequence(evidence, p, prediction);
      p.clear();
    }
    const double share = static_cast<double>(++done) / static_cast<double>(parts);
    if (!keep_going(share)) go = false;
  });
  const PackedColumn nothing(Column(Column::Channels(prediction.size())));
  parallel_for(all.size(), [&](std::size_t t) {
    for (PackedColumn& c : all[t].columns)
      if (!c.known()) c = nothing;
    const std::vector<Column> columns = unpacked(all[t].columns);
    all[t].own = evidence.cross(pointers(columns), pointers(columns));
  });
  return all;
}

void RememberedProducts::learn(const Evidence& evidence, const std::vector<const Column*>& others,
                               const std::vector<PackedColumn>& columns) {
  const auto known = [&](const Column* other) {
    return std::find_if(others_.begin(), others_.end(),
                        [&](const Column& c) { return c.shares(*other); });
  };
  std::vector<const Column*> missing;
  for (const Column* other : others)
    if (known(other) == others_.end()) missing.push_back(other);
  const std::vector<Column> own = missing.empty() ? std::vector<Column>{} : unpacked(columns);
  const RoleGrams fresh = evidence.cross(missing, pointers(own));
  const auto rows = static_cast<Eigen::Index>(others.size()),
             cols = static_cast<Eigen::Index>(columns.size());
  RoleGrams all = RoleGrams::none(rows, cols, fresh.held_out_of.size());
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto r = known(others[static_cast<std::size_t>(i)]);
    const bool old = r != others_.end();
    const RoleGrams& from = old ? products_ : fresh;
    const Eigen::Index row = old ? r - others_.begin() : next++;
    all.fitted.row(i) = from.fitted.row(row);
    all.held_out.row(i) = from.held_out.row(row);
    for (std::size_t c = 0; c < all.held_out_of.size(); ++c) {
      all.fitted_of[c].row(i) = from.fitted_of[c].row(row);
      all.held_out_of[c].row(i) = from.held_out_of[c].row(row);
    }
  }
  products_ = std::move(all);
  others_.clear();
  for (const Column* other : others) others_.push_back(*other);
}

std::vector<Screened> screen(const Evidence& evidence, const Ground& ground, const Doubt& doubt,
                             const std::vector<Candidate>& candidates,
                             std::vector<TrialColumns>& trials) {
  std::vector<Screened> all(trials.size());
  parallel_for(trials.size(), [&](std::size_t i) {
    all[i].trial = i;
    TrialColumns& t = trials[i];
    if (std::all_of(t.columns.begin(), t.columns.end(),
                    [](const PackedColumn& c) { return c.zero(); }))
      return;
    t.ground.learn(evidence, ground.columns, t.columns);
    Gain g = gain_of(ground, doubt, t.ground.products(), t.own);
    if (possible(candidates[t.trial.candidate], t.trial, g.size))
      all[i].gain = g.gain, all[i].counted = g.counted;
    all[i].size = std::move(g.size);
  });
  std::erase_if(all, [](const Screened& s) { return s.size.size() == 0; });
  std::stable_sort(all.begin(), all.end(),
                   [](const Screened& x, const Screened& y) { return x.gain > y.gain; });
  return all;
}

Column left_by(const Ground& ground, const TrialColumns& trial) {
  const RoleGrams all = bordered(ground.grams, trial.ground.products(), trial.own);
  std::vector<Column> columns;
  for (std::size_t i = 1; i < ground.columns.size(); ++i) columns.push_back(*ground.columns[i]);
  for (const PackedColumn& c : trial.columns) columns.push_back(c.unpacked());
  return less(*ground.columns.front(), columns, step_of(ground, all, trial.own.fitted.rows()).step);
}

Screened screen_pair(const Evidence& evidence, const Ground& ground, const Doubt& doubt,
                     const TrialColumns& a, const TrialColumns& b) {
  const std::vector<Column> of_a = unpacked(a.columns), of_b = unpacked(b.columns);
  const RoleGrams ab = evidence.cross(pointers(of_a), pointers(of_b));
  Gain g = gain_of(ground, doubt, beside(a.ground.products(), b.ground.products()),
                   bordered(a.own, ab, b.own));
  return {0, g.gain, g.counted, std::move(g.size)};
}

}  // namespace vcnc
