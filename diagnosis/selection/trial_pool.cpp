#include "diagnosis/selection/trial_pool.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kPartInALine = 0.25;  ///< of the least gain: less, and a wave is not worth a trial

}  // namespace

double TrialPool::worth_of_line() const { return kPartInALine * rules_.options.least_gain; }

void TrialPool::simulate(const Needed& needed) {
  values_.emplace_back(rules_.evidence, declared_, base_.residual, worth_of_line());
  const std::vector<Trial> all = worth_trying(values_.front());
  const std::string doing =
      "simulating " + std::to_string(rules_.candidates.size()) + " candidates";
  rules_.trials =
      simulate_trials(rules_.evidence, base_.machine, base_.prediction, rules_.candidates, all,
                      [&](double s) { return rules_.go(doing, s); });
  const Ground ground(rules_.evidence, base_.residual, base_.nuisances);
  const DetectionLimits limits(rules_.evidence, ground, needed);
  find_detection_limits(limits, rules_.trials);
  try_detection_limits(
      rules_.evidence, base_.machine, base_.prediction, rules_.candidates, limits,
      [&](double s) { return rules_.go("trying detection limits", s); }, rules_.trials);
  at_base_ = rules_.trials;
}

void TrialPool::begin_again() {
  rules_.trials = known_ = at_base_;
  values_.erase(values_.begin() + 1, values_.end());
}

void TrialPool::look_again(const FittedMachine& now) {
  try_shapes_that_show(now);
  rules_.trials = known_;
  const std::set<std::string> drives = drives_found(now, rules_.candidates);
  std::set<std::size_t> found, blinding;
  for (const AddedEffect& a : now.added) {
    const std::string& effect = rules_.candidates[a.candidate].effect;
    const bool blinds = effect == RangeClip::text.name || effect == ContactLoss::text.name;
    (blinds ? blinding : found).insert(a.candidate);
  }
  std::vector<std::size_t> which;
  std::vector<Trial> again;
  for (std::size_t t = 0; t < known_.size(); ++t) {
    const Trial& trial = known_[t].trial;
    const Candidate& c = rules_.candidates[trial.candidate];
    const bool anew = blinding.empty() ? is_of_drive(c) && drives.contains(c.place) &&
                                             !found.contains(trial.candidate)
                                       : !blinding.contains(trial.candidate);
    if (!anew) continue;
    which.push_back(t);
    again.push_back(trial);
  }
  std::vector<TrialColumns> simulated =
      simulated_with(now, std::move(again), "simulating with what was found");
  for (std::size_t i = 0; i < which.size(); ++i) {
    const TrialColumns& before = rules_.trials[which[i]];
    simulated[i].detection_limit = before.detection_limit;
    simulated[i].later_than_linear = before.later_than_linear;
    rules_.trials[which[i]] = std::move(simulated[i]);
  }
}

void TrialPool::try_shapes_that_show(const FittedMachine& now) {
  if (rules_.excess(now.held_out) > rules_.options.least_gain) {
    TrialValuesOf values(rules_.evidence, declared_, now.residual, worth_of_line());
    for (const TrialValuesOf& known : values_) values.follow(known);
    values_.push_back(std::move(values));
  }
  for (const AddedEffect& a : now.added)
    values_.back().add_found(rules_.candidates[a.candidate], a.numbers);
  std::vector<Trial> fresh = worth_trying(values_.back());
  std::erase_if(fresh, [&](const Trial& trial) {
    return std::any_of(known_.begin(), known_.end(), [&](const TrialColumns& k) {
      return k.trial.candidate == trial.candidate && k.trial.values == trial.values;
    });
  });
  std::vector<TrialColumns> columns =
      simulated_with(now, std::move(fresh), "simulating shapes that show now");
  std::move(columns.begin(), columns.end(), std::back_inserter(known_));
}

std::vector<Trial> TrialPool::worth_trying(const TrialValuesOf& values) const {
  std::vector<Trial> all = trials(base_.machine, rules_.candidates, values);
  std::erase_if(all, [&](const Trial& t) {
    const std::vector<FreeNumber>& numbers = rules_.candidates[t.candidate].numbers;
    const bool goes_along = std::all_of(numbers.begin(), numbers.end(), [&](const FreeNumber& n) {
      return is_fixed(n) || has_key(base_.nuisances.numbers, n.key);
    });
    return goes_along || asleep(rules_.candidates[t.candidate]);
  });
  return all;
}

std::vector<TrialColumns> TrialPool::simulated_with(const FittedMachine& m,
                                                    std::vector<Trial> which,
                                                    const std::string& doing) const {
  if (which.empty()) return {};
  return simulate_trials(rules_.evidence, m.machine, m.prediction, rules_.candidates,
                         std::move(which), [&](double s) { return rules_.go(doing, s); });
}

bool TrialPool::asleep(const Candidate& c) const {
  const std::size_t axis = axis_named(c.place);
  if (axis == kAxisCount || !is_of_drive(c)) return false;
  if (std::count(rules_.options.vibrating.begin(), rules_.options.vibrating.end(), axis) > 0)
    return true;
  const MeasuredSignal* command = rules_.evidence.record().find(SignalKind::command, axis);
  if (!command) return false;
  const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
  return *high - *low < 1e-9;
}

}  // namespace vcnc
