#include "diagnosis/selection/limits_beside.hpp"

#include <algorithm>
#include <set>
#include <string>

#include "diagnosis/parallel.hpp"

namespace vcnc {
namespace {

Needed needed_beside(const ContestRules& rules, const FittedMachine& found,
                     const std::vector<double>& left, Needed needed) {
  needed.share = rules.options.least_share;
  for (std::size_t c = 0; c < left.size(); ++c) needed.left.push_back(left[c] - rules.floor_of[c]);
  if (found.found() == 0) return needed;
  needed.anywhere = doubt_of(rules.options, found.rounding);
  needed.doubt = doubt_of(rules.options, found.explained(), rules.base_of, left, found.rounding);
  needed.acting = found.acting();
  const auto always = [](const ActingSlices& a) { return a.empty(); };
  if (std::any_of(needed.acting.begin(), needed.acting.end(), always)) needed.acting.clear();
  return needed;
}

/// At a drive where something was found, and elsewhere.
struct Limits {
  Limits(const ContestRules& rules, const Ground& ground, const FittedMachine& found, Needed needed)
      : candidates(rules.candidates),
        drives(drives_found(found, rules.candidates)),
        elsewhere(rules.evidence, ground, needed),
        at_drive(rules.evidence, ground, [&] {
          needed.share = std::max(needed.share, rules.options.share_beside);
          return needed;
        }()) {}

  const DetectionLimits& of(const std::string& drive) const {
    return drives.contains(drive) ? at_drive : elsewhere;
  }
  double of(TrialColumns& t) const {
    const Candidate& c = candidates[t.trial.candidate];
    return (is_of_drive(c) ? of(c.place) : elsewhere).in_its_unit(t);
  }

  const std::vector<Candidate>& candidates;
  std::set<std::string> drives;
  DetectionLimits elsewhere, at_drive;
};

/// Without its i-th finding, everything else as it was.
FittedMachine without_finding(const FittedMachine& m, std::size_t i) {
  if (i < m.added.size()) return m.without_effect(i);
  FittedMachine less = m;
  less.released.erase(less.released.begin() + static_cast<std::ptrdiff_t>(i - m.added.size()));
  return less;
}

/// Whether a finding has a number.
bool has_number(const FittedMachine& m, std::size_t i, const std::string& key) {
  if (i >= m.added.size()) return m.released[i - m.added.size()].key == key;
  return std::any_of(m.added[i].numbers.begin(), m.added[i].numbers.end(),
                     [&](const FreedNumber& n) { return n.number.key == key; });
}

}  // namespace

LimitsBeside limits_beside(const ContestRules& rules, const FittedMachine& base,
                           const FittedMachine& found, const Needed& first) {
  const std::vector<FreedNumber>& declared = base.nuisances.numbers;
  LimitsBeside all{std::vector<double>(rules.trials.size()), std::vector<double>(declared.size())};
  std::vector<char> trial_known(rules.trials.size(), false), number_known(declared.size(), false);
  const LinearPart linear = found.linear();
  const Ground ground(rules.evidence, found.residual, linear);
  const auto fill = [&](const FittedMachine& beside, const auto& of_trial, const auto& of_number) {
    const Needed needed = needed_beside(rules, beside, ground.held_out_of, first);
    const LinearPart others = beside.linear();
    const Ground of_others(rules.evidence, found.residual, others);
    const Limits of_trials(rules, of_others, beside, needed),
        of_numbers(rules, ground, beside, needed);
    parallel_for(rules.trials.size(), [&](std::size_t t) {
      if (trial_known[t] || !of_trial(rules.trials[t].trial)) return;
      trial_known[t] = true;
      all.of_trials[t] = of_trials.of(rules.trials[t]);
    });
    for (std::size_t i = 0; i < declared.size(); ++i) {
      const std::string& key = declared[i].number.key;
      if (number_known[i] || !of_number(key)) continue;
      number_known[i] = true;
      all.of_releases[i] =
          of_numbers.of(drive_of(key, rules.candidates))
              .of_releases(linear.numbers, {declared[i]}, rules.options.out_of_tolerance)
              .front();
    }
  };
  for (std::size_t i = 0; i < found.found(); ++i)
    fill(
        without_finding(found, i),
        [&](const Trial& t) {
          return i < found.added.size() && t.candidate == found.added[i].candidate;
        },
        [&](const std::string& key) { return has_number(found, i, key); });
  fill(
      found, [](const Trial&) { return true; }, [](const std::string&) { return true; });
  return all;
}

}  // namespace vcnc
