#include "diagnosis/selection/contest.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "diagnosis/parallel.hpp"
#include "diagnosis/selection/intricacy.hpp"
#include "diagnosis/selection/released_numbers.hpp"

namespace vcnc {
namespace {

constexpr double kHopeless = 100;  ///< times what is to be explained: a loop that is unstable
constexpr double kPromise = 0.3;   ///< of what is needed: worth a refit
constexpr double kHope = 0.5;      ///< of what is needed: worth to be refitted to the end
constexpr double kLeaves = 0.05;   ///< part of what is left that a winner may leave
constexpr double kNearly = 0.99;   ///< part of a gain that may be as much when all is refitted
constexpr double kMany = 3;        ///< numbers
constexpr std::size_t kElsewhere = 2;
constexpr std::size_t kLifted = 6;  ///< declared numbers in pairs
constexpr std::size_t kFinalists = 3, kRivals = 4, kMoreRefits = 8;

void sort_by_worth(std::vector<Contender>& all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Contender& x, const Contender& y) { return x.worth() > y.worth(); });
}

}  // namespace

std::vector<Screened> by_what_counts(std::vector<Screened> all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Screened& x, const Screened& y) { return x.counted > y.counted; });
  return all;
}

std::vector<Screened> worth_a_refit(const std::vector<Screened>& screened,
                                    const DiagnosisOptions& options,
                                    const std::function<Family(const Screened&)>& family_of) {
  std::vector<Screened> list;
  std::map<Family, std::size_t> of_family;
  for (const Screened& s : screened) {
    if (s.counted < kPromise * options.least_gain) break;
    const Family family = family_of(s);
    const bool first = list.size() < options.refits;
    if (!first && (of_family[family] >= options.per_family || s.counted < 0.1 * list[0].counted))
      continue;
    ++of_family[family];
    list.push_back(s);
  }
  return list;
}

std::vector<Contender> Contest::contenders() {
  const std::vector<Screened> all_trials = screened_of(rules_.trials),
                              all_screened =
                                  by_what_counts(counted_by_samples(best_of_each(all_trials))),
                              list = worth_a_refit(
                                  all_screened, rules_.options, [&](const Screened&of) {
                                    return rules_.candidates[candidate_of(of)].family;
                                  });
  std::vector<Contender> all = refitted(list);
  finish(all);
  if (const std::vector<Screened> more = likes_of(all, all_screened, list); !more.empty()) {
    std::vector<Contender> others = refitted(more);
    std::move(others.begin(), others.end(), std::back_inserter(all));
    finish(all);
  }
  const double best = all.empty() ? 0 : all.front().gain;
  for (Contender& c : released_numbers(appraisal_, Released::where_pulled, best))
    all.push_back(std::move(c));
  for (Contender& c : all) {
    c.needed = appraisal_.needed_of(c);
    c.counts = appraisal_.counts(c);
  }
  std::erase_if(all, [&](const Contender& c) {
    return c.gain <= c.needed || c.counts <= c.needed ||
           !rules_.stands_out(appraisal_.ground().held_out_of, c.fit.held_out_of) ||
           (c.released.empty() && !appraisal_.under_two_conditions(c));
  });
  sort_by_worth(all);
  put_simplest_first(all);
  if (!all.empty()) begin_elsewhere(all.front(), all_trials);
  if (const double numbers = numbers_of_two(all); numbers > 0)
    look_ahead(all_screened, numbers, all);
  return all;
}

std::vector<Contender> Contest::rivals(double least, std::size_t but) const {
  std::vector<Screened> list = best_of_each(screened_of(rules_.trials));
  std::erase_if(list, [&](const Screened& s) { return s.gain < least || candidate_of(s) == but; });
  std::size_t few = std::min(list.size(), kRivals);
  while (few < std::min(list.size(), kMoreRefits) && list[few].gain > kNearly * list[0].gain) ++few;
  list.resize(few);
  std::vector<Contender> all = refitted(list);
  finish(all);
  for (Contender& c : released_numbers(appraisal_, Released::anywhere, least))
    if (c.gain >= least) all.push_back(std::move(c));
  for (Contender& c : all) {
    c.counts = appraisal_.counts(c);
    appraisal_.find_needless(c);
  }
  sort_by_worth(all);
  return all;
}

std::vector<std::size_t> Contest::equivalents(const std::vector<Contender>& contenders) const {
  std::vector<std::size_t> all;
  const auto most =
      std::max_element(contenders.begin(), contenders.end(),
                       [](const Contender& x, const Contender& y) { return x.counts < y.counts; });
  const double band = appraisal_.band_of(most->gain);
  for (std::size_t i = 1; i < contenders.size(); ++i)
    if (contenders[i].released.empty() && contenders[i].counts > most->counts - band &&
        contenders[i].counts > 0.5 * most->counts)
      all.push_back(contenders[i].candidate);
  return all;
}

std::vector<Screened> Contest::screened_of(std::vector<TrialColumns>& trials) const {
  return screen(rules_.evidence, appraisal_.ground(), appraisal_.doubt(), rules_.candidates,
                trials);
}

std::vector<Screened> Contest::counted_by_samples(std::vector<Screened> screened) const {
  if (!appraisal_.by_samples()) return screened;
  parallel_for(screened.size(), [&](std::size_t i) {
    Screened& s = screened[i];
    if (s.gain < kPromise * rules_.options.least_gain || s.counted >= s.gain) return;
    const Column left = left_by(appraisal_.ground(), rules_.trials[s.trial]);
    s.counted = appraisal_.counts(s.gain, rules_.evidence.chi2_of(left, Role::held_out),
                                  [&] { return left; });
  });
  return screened;
}

double Contest::intricacy_of(const Contender& c) const { return intricacy(rules_.candidates, c); }

std::size_t Contest::candidate_of(const Screened& s) const {
  return rules_.trials[s.trial].trial.candidate;
}

/// The best trial of every candidate but of what is found already, best first.
std::vector<Screened> Contest::best_of_each(const std::vector<Screened>& trials) const {
  std::vector<Screened> best;
  std::vector<char> seen(rules_.candidates.size(), false);
  for (const AddedEffect& a : now_.added) seen[a.candidate] = true;
  for (const Screened& s : trials)
    if (!std::exchange(seen[candidate_of(s)], true)) best.push_back(s);
  return best;
}

std::vector<Contender> Contest::refitted(const std::vector<Screened>& list) const {
  std::vector<Contender> all(list.size());
  std::atomic<std::size_t> done = 0;
  rules_.evidence.each_together(list.size(), [&](std::size_t i) {
    if (!rules_.go("refitting " + std::to_string(list.size()) + " candidates",
                   static_cast<double>(done) / static_cast<double>(list.size())))
      return;
    all[i] = contender({&rules_.trials[list[i].trial]}, list[i].size, list[i].gain);
    ++done;
  });
  // What was stopped before it was tried.
  std::erase_if(all, [](const Contender& c) { return c.fit.held_out_of.empty(); });
  return all;
}

/// What was left out of a list though its promise is like the best gain.
std::vector<Screened> Contest::likes_of(const std::vector<Contender>& all,
                                        const std::vector<Screened>& screened,
                                        const std::vector<Screened>& list) const {
  std::vector<Screened> more;
  if (all.empty()) return more;
  const double best = all.front().gain;
  if (best < rules_.threshold(appraisal_.held_out())) return more;
  for (const Screened& s : screened) {
    if (more.size() == kMoreRefits) break;
    if (s.gain < std::min(best - 2 * appraisal_.band_of(best), kNearly * best)) continue;
    if (std::none_of(list.begin(), list.end(),
                     [&](const Screened& l) { return l.trial == s.trial; }))
      more.push_back(s);
  }
  return more;
}

/// Of those that do as well as the first, the one with the fewest numbers, of a size nearest to
/// the typical one.
void Contest::put_simplest_first(std::vector<Contender>& all) const {
  if (all.empty()) return;
  const double most = all.front().counts, band = appraisal_.band_of(all.front().gain);
  for (Contender& c : all)
    if (c.counts > most - band) appraisal_.find_needless(c);
  // A number that is never quite absent is one of an effect: where that does as well with all its
  // numbers, it is told, so that what is known of one of them does not hang on the others'
  // defaults.
  std::set<std::string> owned;
  for (const Contender& e : all)
    for (const FreedNumber& n : e.numbers)
      if (e.released.empty() && e.counts > most - band) owned.insert(n.number.key);
  std::erase_if(all, [&](const Contender& c) { return owned.contains(c.released); });
  // What counts less by the band weighs like one number more.
  const auto cost = [&](const Contender& c) { return intricacy_of(c) + (most - c.counts) / band; };
  auto simplest = all.begin();
  for (auto c = all.begin(); c != all.end(); ++c)
    if (c->counts > most - band && cost(*c) < cost(*simplest)) simplest = c;
  std::rotate(all.begin(), simplest, simplest + 1);
}

Contender Contest::contender(const std::vector<const TrialColumns*>& trials,
                             const Eigen::VectorXd& size, double promised) const {
  Contender best;
  // From where the sensitivities point to, and from a third of the way: some effects are not
  // linear and disappoint.
  for (const double share : {1.0, 0.3}) {
    Contender c;
    c.begun = now_.machine;
    Eigen::Index at = 0;
    for (const TrialColumns* t : trials) {
      const Trial& trial = t->trial;
      const auto width = static_cast<Eigen::Index>(trial.directions.size());
      const std::vector<FreedNumber> numbers =
          start_of(rules_.candidates[trial.candidate], trial,
                   Eigen::VectorXd(share * size.segment(at, width)),
                   Eigen::VectorXd(t->own.fitted.diagonal().cwiseSqrt()));
      c.numbers.insert(c.numbers.end(), numbers.begin(), numbers.end());
      set_whole_numbers(c.begun, rules_.candidates[trial.candidate], trial);
      at += width;
    }
    c.candidate = trials.front()->trial.candidate;
    c.fit = refit(rules_.evidence, c.begun, c.numbers, without(appraisal_.linear(), c.numbers),
                  {.max_iterations = kGlance,
                   .begin = Begin::far,
                   .hopeless = kHopeless * appraisal_.ground().fitted});
    c.numbers = c.fit.live;
    c.gain = appraisal_.held_out() - c.fit.held_out;
    const bool first = share == 1.0;
    if (first || c.gain > best.gain) best = std::move(c);
    if (best.gain > 0.5 * promised) break;
  }
  return best;
}

/// Converges those contenders that may yet be the best.
void Contest::finish(std::vector<Contender>& all) const {
  std::stable_sort(all.begin(), all.end(),
                   [](const Contender& x, const Contender& y) { return x.gain > y.gain; });
  const double best = all.empty() ? 0 : all.front().gain;
  const double least = std::max(0.5 * best, kHope * rules_.options.least_gain);
  std::size_t finalists = 0;
  while (finalists < all.size() && all[finalists].gain >= least &&
         (finalists < kFinalists || all[finalists].gain >= best - rules_.options.class_gain ||
          (finalists < kMoreRefits && all[finalists].gain >= kNearly * best)))
    ++finalists;
  rules_.evidence.each_together(finalists, [&](std::size_t i) {
    Contender& c = all[i];
    if (c.converged || !rules_.go("refitting the best", 0)) return;
    c.converged = true;
    c.fit = refit(rules_.evidence, c.begun, c.numbers, without(appraisal_.linear(), c.numbers));
    c.numbers = c.fit.live;
    c.gain = appraisal_.held_out() - c.fit.held_out;
  });
}

/// The first law, where it leaves something, may fit better from another of its shapes: the next
/// best trials of the winner are refitted as well.
void Contest::begin_elsewhere(Contender& best, const std::vector<Screened>& trials) const {
  if (!now_.added.empty() || !best.released.empty() ||
      rules_.excess(appraisal_.held_out() - best.gain) <
          kLeaves * rules_.excess(appraisal_.held_out()))
    return;
  std::vector<Contender> others;
  std::size_t tried = 0;
  for (const Screened& s : trials) {
    if (candidate_of(s) != best.candidate || tried++ == 0) continue;  // it began at the first
    if (others.size() == kElsewhere || !rules_.go("trying other shapes", 0)) break;
    others.push_back(contender({&rules_.trials[s.trial]}, s.size, s.gain));
    others.back().needed = appraisal_.needed_of(others.back());
  }
  finish(others);
  for (Contender& c : others) c.counts = appraisal_.counts(c);
  for (Contender& c : others)
    if (c.fit.fitted < best.fit.fitted && c.gain > best.gain) best = std::move(c);
}

/// What a pair may have: more than anybody has where the best one explains less than half, else
/// fewer than that, if it has many (a straightness with a wave is a little of everything).
double Contest::numbers_of_two(const std::vector<Contender>& all) const {
  if (all.empty() || all.front().gain < 0.5 * rules_.excess(appraisal_.held_out()))
    return std::numeric_limits<double>::infinity();
  const double numbers = intricacy_of(all.front());
  return numbers > kMany ? numbers : 0;
}

/// The best pair of screened candidates and declared numbers with less than `numbers` where it does
/// far better than any one, or as well as one that says more.
void Contest::look_ahead(const std::vector<Screened>& screened, double numbers,
                         std::vector<Contender>& all) const {
  struct One {
    const TrialColumns* trial;
    double counted;
    std::size_t candidate() const { return trial->trial.candidate; }
  };
  const auto numbers_of = [&](const One& one) {
    const std::vector<FreeNumber>& of = rules_.candidates[one.candidate()].numbers;
    return static_cast<double>(std::count_if(
        of.begin(), of.end(), [](const FreeNumber& n) { return !is_fixed(n) && !is_phase(n); }));
  };
  std::vector<One> ones;
  for (std::size_t i = 0; i < std::min(rules_.options.pairs_of, screened.size()); ++i)
    ones.push_back({&rules_.trials[screened[i].trial], screened[i].counted});
  std::vector<TrialColumns> declared = lifted_numbers(appraisal_);
  std::vector<Screened> of_numbers = by_what_counts(screened_of(declared));
  of_numbers.resize(std::min(kLifted, of_numbers.size()));
  for (const Screened& s : of_numbers) ones.push_back({&declared[s.trial], s.counted});
  std::vector<std::pair<One, One>> pairs;
  for (std::size_t i = 0; i < ones.size(); ++i)
    for (std::size_t j = i + 1; j < ones.size(); ++j)
      if (ones[i].candidate() != ones[j].candidate() &&
          numbers_of(ones[i]) + numbers_of(ones[j]) < numbers)
        pairs.emplace_back(ones[i], ones[j]);
  std::vector<Screened> together(pairs.size());
  parallel_for(pairs.size(), [&](std::size_t p) {
    together[p] = screen_pair(rules_.evidence, appraisal_.ground(), appraisal_.doubt(),
                              *pairs[p].first.trial, *pairs[p].second.trial);
  });
  const double single = all.empty() ? 0 : all.front().counts;
  const double least =
      std::max(rules_.threshold(appraisal_.held_out()), 0.1 * rules_.excess(appraisal_.held_out()));
  const bool fewer = std::isfinite(numbers);
  const double enough = fewer ? single - appraisal_.band_of(all.front().gain) : single + least;
  std::optional<std::size_t> best;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    // One that does nothing beside another makes no pair of it.
    const double either = std::max(pairs[p].first.counted, pairs[p].second.counted);
    if (together[p].counted >= std::max(enough, either + least) &&
        (!best || together[p].counted > together[*best].counted))
      best = p;
  }
  if (!best || !rules_.go("looking at pairs", 0)) return;
  const auto& [one, other] = pairs[*best];
  Contender c = contender({one.trial, other.trial}, together[*best].size, together[*best].gain);
  c.needed = appraisal_.needed_of({one.candidate(), other.candidate()}, c.fit.held_out_of);
  c.counts = appraisal_.counts(c);
  if (c.counts > enough && (!fewer || intricacy_of(c) < numbers) &&
      is_out_of_tolerance(appraisal_, c.numbers) &&
      rules_.stands_out(appraisal_.ground().held_out_of, c.fit.held_out_of))
    all.insert(all.begin(), std::move(c));
}

}  // namespace vcnc
