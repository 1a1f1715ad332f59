#include "diagnosis/selection/machine_changes.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/selection/released_numbers.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kClearLoss = 4;  ///< times the least gain: no need to look closer
/// Times what two effects of one place make together that each makes and the other takes back.
constexpr double kCancels = 25;
constexpr double kSpoils = 3;    ///< times the rms of a signal before
constexpr double kAtTheEnd = 2;  ///< times the least that a shape may be

Explained minus(Explained x, const std::vector<double>& y) {
  for (std::size_t c = 0; c < x.size(); ++c) x[c] -= y[c];
  return x;
}

}  // namespace

bool take_each_other_back(double one, double other, double both) {
  return std::min(one, other) > kCancels * both;
}

MachineChanges::MachineChanges(Evidence& evidence, const Machine& declared,
                               const ContestRules& rules, const FittedMachine& base)
    : evidence_(evidence),
      declared_(declared),
      rules_(rules),
      base_(base),
      controller_(evidence.record(), evidence.replica().channels(), declared) {}

void MachineChanges::add(FittedMachine& m, const Contender& best,
                         const std::vector<std::size_t>& equivalent, double much) const {
  const Explained explained =
      minus(evidence_.chi2_of(m.residual, Role::held_out), best.fit.held_out_of);
  for (FreedNumber& n : m.nuisances.numbers) n.held = false;
  if (!best.released.empty()) {
    for (FreedNumber& n : m.nuisances.numbers)
      if (n.number.key == best.released) n.tolerance = 0;
    m.released.push_back({best.released, explained, equivalent});
    if (!best.fit.live.empty()) move_to(m, best.fit);
    add_common(evidence_, m, rules_.options.common);
    converge(evidence_, m);
    settle_in(evidence_, m, {rules_.floor + rules_.options.least_gain, much});
    return;
  }
  // Numbers belong to the candidate whose keys they have; a pair brings two.
  std::set<std::size_t> owners{best.candidate};
  for (const FreedNumber& n : best.numbers)
    for (std::size_t c = 0; c < rules_.candidates.size(); ++c)
      for (const FreeNumber& own : rules_.candidates[c].numbers)
        if (own.key == n.number.key) owners.insert(c);
  for (const std::size_t owner : owners) {
    AddedEffect added{.candidate = owner, .gain = best.gain, .explained = explained};
    for (const FreedNumber& n : best.numbers)
      for (const FreeNumber& own : rules_.candidates[owner].numbers)
        if (own.key == n.number.key) added.numbers.push_back(n);
    if (owner == best.candidate) added.class_with = equivalent;
    m.added.push_back(std::move(added));
  }
  // Numbers that other ones replace are no nuisances any more; fixed shapes stay as tried.
  m.nuisances = without(m.nuisances, best.numbers);
  move_to(m, best.fit);
  add_common(evidence_, m, rules_.options.common);
  converge(evidence_, m);
  settle_in(evidence_, m, {rules_.floor + rules_.options.least_gain, much});
}

void MachineChanges::move_to(FittedMachine& m, const Refit& fit) const {
  m.machine = fit.machine;
  m.held_out = fit.held_out;
  adopt(m.nuisances.numbers, fit.live);
  adopt(m.nuisances.numbers, fit.linear);
  for (AddedEffect& a : m.added) adopt(a.numbers, fit.linear);
  evidence_.anchor(m.machine);
}

FittedMachine MachineChanges::fitted_with(const FittedMachine& now, const Contender& contender,
                                          const std::vector<std::size_t>& equivalent,
                                          double much) const {
  FittedMachine m = now;
  add(m, contender, equivalent, much);
  drop(m);
  return m;
}

FittedMachine MachineChanges::with_dry_friction(FittedMachine m) const {
  for (AddedEffect& a : m.added) {
    const std::string& place = rules_.candidates[a.candidate].place;
    const auto dry =
        std::find_if(rules_.candidates.begin(), rules_.candidates.end(),
                     [&](const Candidate& c) { return c.effect == "coulomb" && c.place == place; });
    if (!is_another_law(a) || dry == rules_.candidates.end()) continue;
    const auto candidate = static_cast<std::size_t>(dry - rules_.candidates.begin());
    const bool there = std::any_of(m.added.begin(), m.added.end(),
                                   [&](const AddedEffect& b) { return b.candidate == candidate; });
    const FreeNumber& level = dry->numbers.front();
    if (there || has_key(m.nuisances.numbers, level.key)) continue;
    const double size = a.numbers.front().value;
    for (const FreeNumber& n : rules_.candidates[a.candidate].numbers)
      move_number(m.machine, n.key, number_of(declared_, n.key));
    move_number(m.machine, level.key, size);
    a = {.candidate = candidate,
         .numbers = {{.number = level, .value = size, .centre = 0}},
         .explained = a.explained};
  }
  evidence_.anchor(m.machine);
  converge(evidence_, m);
  settle_in(evidence_, m, {rules_.floor + rules_.options.least_gain});
  drop(m);
  return m;
}

void MachineChanges::drop(FittedMachine& m) const {
  drop_effects(m);
  hold_again(m);
  anchor_at(evidence_, m);
}

void MachineChanges::drop_uncounted(FittedMachine& m) const {
  drop(m);
  for (std::size_t i = 0; i < m.added.size();) {
    const FittedMachine less = taken_out(m, i, Common::held);
    if (Appraisal(rules_, less).counts_enough(m, m.added[i].candidate)) {
      ++i;
      continue;
    }
    m = removed(m, i);
    drop(m);
    i = 0;
  }
}

void MachineChanges::drop_effects(FittedMachine& m) const {
  while (true) {
    std::vector<double> loss(m.added.size());
    for (std::size_t i = 0; i < m.added.size(); ++i) loss[i] = weigh(m, i);
    if (m.added.empty()) return;
    const auto least =
        static_cast<std::size_t>(std::min_element(loss.begin(), loss.end()) - loss.begin());
    if (loss[least] > kClearLoss * rules_.options.least_gain) return;
    FittedMachine less = removed(m, least);
    m.added[least].gain = less.held_out - m.held_out;
    if (m.added[least].gain >= rules_.options.least_gain) return;
    m = std::move(less);
  }
}

void MachineChanges::hold_again(FittedMachine& m) const {
  for (std::size_t i = m.released.size(); i-- > 0;) {
    FittedMachine held = m.holding(m.released[i].key, base_);
    const Ground ground(evidence_, held.residual, held.linear());
    m.released[i].explained =
        minus(ground.held_out_of, evidence_.chi2_of(m.residual, Role::held_out));
    if (ground.held_out - m.held_out > rules_.options.release_gain) continue;
    for (FreedNumber& n : held.nuisances.numbers) n.held = false;
    held.held_out = ground.held_out;
    converge(evidence_, held);
    m = std::move(held);
  }
}

double MachineChanges::weigh(FittedMachine& m, std::size_t i) const {
  const FittedMachine less = taken_out(m, i, Common::held);
  m.added[i].acts = acting_slices(evidence_.record(), m.residual, less.residual);
  const Ground ground(evidence_, less.residual, less.linear());
  m.added[i].explained = minus(ground.held_out_of, evidence_.chi2_of(m.residual, Role::held_out));
  return m.added[i].gain = ground.held_out - m.held_out;
}

FittedMachine MachineChanges::taken_out(const FittedMachine& m, std::size_t i,
                                        Common common) const {
  FittedMachine less = m.without_effect(i);
  for (const FreeNumber& n : rules_.candidates[m.added[i].candidate].numbers)
    move_number(less.machine, n.key, number_of(declared_, n.key));
  if (common == Common::held) hold_common(less);
  less.prediction = evidence_.predict(less.machine);
  less.residual = evidence_.residual(less.prediction);
  less.held_out = Ground(evidence_, less.residual, less.linear()).held_out;
  return less;
}

FittedMachine MachineChanges::removed(const FittedMachine& m, std::size_t i) const {
  FittedMachine less = m;
  less.added.erase(less.added.begin() + static_cast<std::ptrdiff_t>(i));
  for (const FreeNumber& n : rules_.candidates[m.added[i].candidate].numbers)
    move_number(less.machine, n.key, number_of(declared_, n.key));
  hold_common(less);
  converge(evidence_, less);
  return less;
}

FittedMachine MachineChanges::within_tolerance(const FittedMachine& m, double tolerances) const {
  return vcnc::within_tolerance(evidence_, m, tolerances, may_be_out);
}

double MachineChanges::counted_within(const FittedMachine& m, const Appraisal& appraisal) const {
  std::optional<FittedMachine> within;
  return counted_within(m, appraisal, within);
}

double MachineChanges::counted_within(const FittedMachine& m, const Appraisal& appraisal,
                                      std::optional<FittedMachine>& within) const {
  if (!within) within = within_tolerance(m, rules_.options.out_of_tolerance);
  const double counts = appraisal.counts(*within);
  evidence_.anchor(m.machine);
  return counts;
}

double MachineChanges::far_more_than(const FittedMachine& m) const {
  return m.held_out + rules_.excess(m.held_out) + kClearLoss * rules_.options.least_gain;
}

bool MachineChanges::holds_up(const FittedMachine& m) const {
  return !spoils(m) && !cancels(m) && !is_another_law(m) && !contradicts_controller(m);
}

bool MachineChanges::spoils(const FittedMachine& m) const {
  const std::vector<ComparedChannel>& channels = evidence_.replica().channels();
  for (std::size_t c = 0; c < channels.size(); ++c)
    if (!is_reading(channels[c].kind) &&
        evidence_.rms(m.prediction, c, Role::held_out) >
            kSpoils * std::max(evidence_.rms(base_.prediction, c, Role::held_out),
                               evidence_.reckoned_with(c)))
      return true;
  return false;
}

bool MachineChanges::cancels(const FittedMachine& m) const {
  const auto lost = [&](const FittedMachine& less) {
    return evidence_.chi2(less.residual, Role::held_out) - m.held_out;
  };
  for (std::size_t i = 0; i < m.added.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (rules_.candidates[m.added[i].candidate].place !=
          rules_.candidates[m.added[j].candidate].place)
        continue;
      const FittedMachine one = taken_out(m, i, Common::held);
      const double both =
          std::max(lost(taken_out(one, j, Common::held)), rules_.options.least_gain);
      if (take_each_other_back(lost(one), lost(taken_out(m, j, Common::held)), both)) return true;
    }
  return false;
}

bool MachineChanges::is_another_law(const AddedEffect& a) const {
  return rules_.candidates[a.candidate].family == Family::friction &&
         std::any_of(a.numbers.begin(), a.numbers.end(), [](const FreedNumber& n) {
           return n.shape && n.number.min > 0 && n.value < kAtTheEnd * n.number.min;
         });
}
bool MachineChanges::is_another_law(const FittedMachine& m) const {
  return std::any_of(m.added.begin(), m.added.end(),
                     [&](const AddedEffect& a) { return is_another_law(a); });
}

bool MachineChanges::contradicts_controller(const FittedMachine& m) const {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    std::vector<std::size_t> of_loops;
    for (const AddedEffect& a : m.added)
      if (rules_.candidates[a.candidate].of_loops &&
          rules_.candidates[a.candidate].place == kAxisNames[axis])
        of_loops.push_back(a.candidate);
    if (of_loops.empty()) continue;
    const Prediction with = evidence_.predict(m.machine);
    std::vector<std::vector<std::size_t>> doubted;
    for (const std::size_t one : of_loops) doubted.push_back({one});
    if (of_loops.size() > 1) doubted.push_back(of_loops);
    for (const std::vector<std::size_t>& some : doubted) {
      Machine without = m.machine;
      for (const std::size_t c : some)
        for (const FreeNumber& n : rules_.candidates[c].numbers)
          move_number(without, n.key, number_of(declared_, n.key));
      const auto b = controller_.of(axis, evidence_.predict(without), with);
      if (b && b->contradicts()) return true;
    }
  }
  return false;
}

bool MachineChanges::is_certain(const FittedMachine& m) const {
  if (m.added.empty()) return true;
  const bool inexact = is_inexact(evidence_, rules_.options, rules_.floor, m.held_out);
  return !may_be_as_declared(m.added.back(), declared_, intervals_of(evidence_, m, inexact));
}

}  // namespace vcnc
