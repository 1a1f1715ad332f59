#include "diagnosis/replica/clipped_replica.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/machine.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kKept = 64;  // readings

double end_of_scale(const Machine& machine) { return machine.effects.get<RangeClip>().limit; }

}  // namespace

Prediction ClippedReplica::predict(const Machine& hypothesis) const {
  return std::move(predict_all({hypothesis})[0]);
}

std::vector<Prediction> ClippedReplica::predict_all(const std::vector<Machine>& hypotheses) const {
  std::vector<Machine> all = hypotheses;
  for (const Machine& h : hypotheses) {
    if (end_of_scale(h) == 0) continue;
    all.push_back(h);
    all.back().effects.get<RangeClip>() = {};
  }
  std::vector<Prediction> predictions = replica_.predict_all(all);
  std::size_t without = hypotheses.size();
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const double limit = end_of_scale(hypotheses[i]);
    if (limit == 0) continue;
    for (std::size_t c = 0; c < taken_off_.size(); ++c)
      if (!taken_off_[c].empty())
        predictions[i][c] = clipped(predictions[i][c], predictions[without][c], c, limit);
    ++without;
  }
  predictions.resize(hypotheses.size());
  return predictions;
}

SharedSeries ClippedReplica::clipped(const SharedSeries& with, const SharedSeries& without,
                                     std::size_t channel, double limit) const {
  if (with.shares(without)) return with;
  const std::lock_guard lock(guard_);
  for (const Clipped& known : latest_)
    if (known.with.shares(with) && known.without.shares(without) && known.limit == limit)
      return known.result;
  const std::vector<double>& off = taken_off_[channel];
  std::vector<double> result = with;
  for (std::size_t k = 0; k < result.size(); ++k) {
    const double u = without[k], e = off[k];
    if (!std::isfinite(e) || std::max(std::abs(u), std::abs(u + e)) <= limit) continue;
    result[k] += std::clamp(u + e, -limit, limit) - e - std::clamp(u, -limit, limit);
  }
  if (latest_.size() == kKept) latest_.erase(latest_.begin());
  latest_.push_back({with, without, limit, SharedSeries(std::move(result))});
  return latest_.back().result;
}

}  // namespace vcnc
