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

#include "diagnosis/candidates/suspects.hpp"
#include "diagnosis/fit/needed_numbers.hpp"
#include "diagnosis/parallel.hpp"
#include "model/effects/list.hpp"

namespace vcnc {
namespace {

constexpr double kHopeless = 100;      ///< times what is to be explained: a loop that is unstable
constexpr int kGlance = 4;             ///< iterations to see what a candidate is worth
constexpr double kUsual = 1;           ///< decades about the typical size, or of tolerances
constexpr double kUsualShape = 2;      ///< decades about the typical period, speed or time
constexpr double kChance = 3;          ///< standard deviations of a sum of squares
constexpr double kOfTolerances = 0.3;  ///< numbers, for a decade of tolerances more
constexpr double kMoreUsual = 0.2;     ///< numbers: a declared one by 50 tolerances
constexpr double kNothing = 0.03;      ///< of a typical size
constexpr double kByAnArm = 0.1;  ///< numbers: of equals, what displaces is told, not what turns
/// Chi-square, or part of what gains are alike by, for which a number may be as declared.
constexpr double kNeedless = 12, kNeedlessPart = 0.1;
constexpr double kPromise = 0.3;    ///< of what is needed: worth a refit
constexpr double kHope = 0.5;       ///< of what is needed: worth to be refitted to the end
constexpr double kLeaves = 0.05;    ///< part of what is left that a winner may leave
constexpr double kNearly = 0.99;    ///< part of a gain that may be as much when all is refitted
constexpr double kWorthAFit = 0.5;  ///< of another gain, that sensitivities must promise
constexpr double kLongWay = 9;      ///< tolerances, where sensitivities are others
constexpr double kMany = 3;         ///< numbers
constexpr std::size_t kElsewhere = 2;
constexpr std::size_t kLifted = 6;  ///< declared numbers in pairs
constexpr std::size_t kFinalists = 3, kRivals = 4, kMoreRefits = 8;

/// Where so much is left.
double threshold_of(const DiagnosisOptions& options, double left) {
  return std::max({options.least_gain, options.least_share * left,
                   options.share_of_form * std::min(left, options.form)});
}

/// Channels where the residual loses something that goes from `before` to `after`.
std::vector<std::size_t> shown_in(const std::vector<double>& before,
                                  const std::vector<double>& after) {
  double gain = 0;
  for (std::size_t c = 0; c < before.size(); ++c) gain += std::max(0.0, before[c] - after[c]);
  std::vector<std::size_t> channels;
  for (std::size_t c = 0; c < before.size(); ++c)
    if (before[c] - after[c] > kConcerned * gain) channels.push_back(c);
  return channels;
}

/// Decades that a size is further from the typical one, which is 1, than is usual.
double unusual(double size, double usual) {
  return std::max(0.0, std::abs(std::log10(size)) - usual);
}

void sort_by_worth(std::vector<Contender>& all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Contender& x, const Contender& y) { return x.worth() > y.worth(); });
}

}  // namespace

bool may_be_released(const DiagnosisOptions& options, const FreedNumber& n) {
  return !n.common() && n.tolerance > 0 && !is_clamping(n.number.key) &&
         is_suspected(options.suspects, n.number.key);
}

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

double ContestRules::excess(double held_out) const { return std::max(0.0, held_out - floor); }

double ContestRules::threshold(double held_out) const {
  return threshold_of(options, excess(held_out));
}

double ContestRules::left_where_gained(const std::vector<double>& before,
                                       const std::vector<double>& after) const {
  double left = 0;
  for (const std::size_t c : shown_in(before, after))
    left += std::max(0.0, before[c] - floor_of[c]);
  return left;
}

double ContestRules::threshold(const std::vector<double>& before,
                               const std::vector<double>& after) const {
  return threshold_of(options, left_where_gained(before, after));
}

bool ContestRules::stands_out(const std::vector<double>& before,
                              const std::vector<double>& after) const {
  double gain = 0, above = 0, samples = 0;
  for (const std::size_t c : shown_in(before, after)) {
    gain += before[c] - after[c];
    above += before[c] - evidence.scatter(c, Role::held_out);
    samples += evidence.count(c, Role::held_out);
  }
  return above + kChance * std::sqrt(2 * samples) > 0.5 * gain;
}

Contest::Contest(const ContestRules& rules, const FittedMachine& now)
    : rules_(rules),
      now_(now),
      linear_(now.linear()),
      ground_(rules.evidence, now.residual, linear_),
      doubt_(now.found() == 0 ? doubt_of(rules.options, now.rounding)
                              : doubt_of(rules.options, now.explained(), rules.base_of,
                                         ground_.held_out_of, now.rounding)),
      doubt_anywhere_(doubt_of(rules.options, now.rounding)),
      acting_(now.acting()) {
  if (any_at_rest())
    at_rest_ =
        chi2_at_rest(rules.evidence, less(now.residual, linear_.columns, ground_.step), acting_);
}

std::vector<Contender> Contest::contenders() {
  const std::vector<Screened> all_trials = screen(rules_.evidence, ground_, doubt_,
                                                  rules_.candidates, rules_.trials),
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
  for (Contender& c : releases(Released::where_pulled, best)) all.push_back(std::move(c));
  for (Contender& c : all) {
    c.needed = needed_of(c);
    c.counts = counts(c);
  }
  std::erase_if(all, [&](const Contender& c) {
    return c.gain <= c.needed || c.counts <= c.needed ||
           !rules_.stands_out(ground_.held_out_of, c.fit.held_out_of) ||
           (c.released.empty() && !under_two_conditions(c));
  });
  sort_by_worth(all);
  put_simplest_first(all);
  if (!all.empty()) begin_elsewhere(all.front(), all_trials);
  if (const double numbers = numbers_of_two(all); numbers > 0)
    look_ahead(all_screened, numbers, all);
  return all;
}

std::vector<Contender> Contest::rivals(double least, std::size_t but) const {
  std::vector<Screened> list =
      best_of_each(screen(rules_.evidence, ground_, doubt_, rules_.candidates, rules_.trials));
  std::erase_if(list, [&](const Screened& s) { return s.gain < least || candidate_of(s) == but; });
  std::size_t few = std::min(list.size(), kRivals);
  while (few < std::min(list.size(), kMoreRefits) && list[few].gain > kNearly * list[0].gain) ++few;
  list.resize(few);
  std::vector<Contender> all = refitted(list);
  finish(all);
  for (Contender& c : releases(Released::anywhere, least))
    if (c.gain >= least) all.push_back(std::move(c));
  for (Contender& c : all) {
    c.counts = counts(c);
    find_needless(c);
  }
  sort_by_worth(all);
  return all;
}

bool Contest::says_it_simpler(const Contender& rival, const AddedEffect& effect,
                              double gain) const {
  if (rival.released.empty() || rival.gain < gain - band_of(gain)) return false;
  return intricacy(rival) + (gain - rival.gain) / band_of(gain) < intricacy(effect);
}

bool Contest::is_more_usual(const Contender& rival, const FreedNumber& number, double gain) const {
  const double band = band_of(gain), less = gain - rival.gain;
  return rival.released.empty() && less < band &&
         intricacy(rival) + std::max(0.0, less) / band < intricacy(number) - kMoreUsual;
}

double Contest::intricacy(const AddedEffect& effect) const {
  Contender same;
  same.candidate = effect.candidate;
  same.numbers = effect.numbers;
  same.needless = effect.needless;
  return intricacy(same);
}

std::vector<std::size_t> Contest::equivalents(const std::vector<Contender>& contenders) const {
  std::vector<std::size_t> all;
  const auto most =
      std::max_element(contenders.begin(), contenders.end(),
                       [](const Contender& x, const Contender& y) { return x.counts < y.counts; });
  const double band = band_of(most->gain);
  for (std::size_t i = 1; i < contenders.size(); ++i)
    if (contenders[i].released.empty() && contenders[i].counts > most->counts - band &&
        contenders[i].counts > 0.5 * most->counts)
      all.push_back(contenders[i].candidate);
  return all;
}

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

double Contest::band_of(double gain) const {
  return rules_.options.class_gain +
         rules_.options.class_share * rules_.excess(ground_.held_out - gain) +
         rules_.options.class_doubt *
             std::min(std::max(0.0, gain), std::accumulate(doubt_.begin(), doubt_.end(), 0.0));
}

/// What was left out of a list though its promise is like the best gain.
std::vector<Screened> Contest::likes_of(const std::vector<Contender>& all,
                                        const std::vector<Screened>& screened,
                                        const std::vector<Screened>& list) const {
  std::vector<Screened> more;
  if (all.empty()) return more;
  const double best = all.front().gain;
  if (best < rules_.threshold(ground_.held_out)) return more;
  for (const Screened& s : screened) {
    if (more.size() == kMoreRefits) break;
    if (s.gain < std::min(best - 2 * band_of(best), kNearly * best)) continue;
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
  const double most = all.front().counts, band = band_of(all.front().gain);
  for (Contender& c : all)
    if (c.counts > most - band) find_needless(c);
  // A number that is never quite absent is one of an effect: where that does as well with all its
  // numbers, it is told, so that what is known of one of them does not hang on the others'
  // defaults.
  std::set<std::string> owned;
  for (const Contender& e : all)
    for (const FreedNumber& n : e.numbers)
      if (e.released.empty() && e.counts > most - band) owned.insert(n.number.key);
  std::erase_if(all, [&](const Contender& c) { return owned.contains(c.released); });
  // What counts less by the band weighs like one number more.
  const auto cost = [&](const Contender& c) { return intricacy(c) + (most - c.counts) / band; };
  auto simplest = all.begin();
  for (auto c = all.begin(); c != all.end(); ++c)
    if (c->counts > most - band && cost(*c) < cost(*simplest)) simplest = c;
  std::rotate(all.begin(), simplest, simplest + 1);
}

std::set<std::string> Contest::needless_among(const std::vector<FreedNumber>& numbers,
                                              const std::vector<Column>& columns,
                                              double gain) const {
  if (numbers.size() < 2 || columns.size() != numbers.size()) return {};
  const std::vector<const Column*> own = pointers(columns);
  const RoleGrams products = bordered(ground_.grams, rules_.evidence.cross(ground_.columns, own),
                                      rules_.evidence.cross(own, own));
  // Those that the effect replaces are none any more.
  std::vector<FreedNumber> all;
  std::vector<Eigen::Index> which;
  std::vector<double> prior;
  for (std::size_t i = 0; i < linear_.numbers.size() + numbers.size(); ++i) {
    const bool linear = i < linear_.numbers.size();
    const FreedNumber& n = linear ? linear_.numbers[i] : numbers[i - linear_.numbers.size()];
    if (linear && has_key(numbers, n.number.key)) continue;
    all.push_back(n);
    which.push_back(static_cast<Eigen::Index>(i) + 1);
    prior.push_back(linear ? ground_.precision[static_cast<Eigen::Index>(i)] : 0);
  }
  Eigen::MatrixXd information = products.fitted(which, which) + products.held_out(which, which);
  information.diagonal() +=
      Eigen::Map<const Eigen::VectorXd>(prior.data(), static_cast<Eigen::Index>(prior.size()));
  return needless_of(numbers, all, information, now_.machine,
                     std::max(kNeedless, kNeedlessPart * band_of(gain)));
}

void Contest::find_needless(Contender& c) const {
  if (c.released.empty()) c.needless = needless_among(c.numbers, c.fit.columns, c.gain);
}

/// Numbers that are something, and two for every further tenth or tenfold of a usual size, or of a
/// shape (a screw of 12 mm is no grating). Of declared numbers that do the same, the one by the
/// fewest tolerances.
double Contest::intricacy(const Contender& c) const {
  if (!c.released.empty()) return intricacy(c.numbers.front());
  double largest = 0, odd_shape = 0;
  std::size_t numbers = c.numbers.size();
  for (const FreedNumber& n : c.numbers)
    for (const FreeNumber& own : rules_.candidates[c.candidate].numbers) {
      if (own.key != n.number.key || is_phase(own) || own.typical == 0) continue;
      const double size = c.needless.contains(own.key) ? 0 : std::abs(n.value / own.typical);
      if (!n.shape) {
        largest = std::max(largest, size);
        numbers -= size < kNothing;
      } else if (own.min > 0 && own.typical > 0) {
        odd_shape = std::max(odd_shape, unusual(size, kUsualShape));
      }
    }
  const bool by_an_arm = rules_.candidates[c.candidate].effect == AngularErrors::text.name;
  return static_cast<double>(numbers) + (by_an_arm ? kByAnArm : 0) +
         2 * ((largest > 0 ? unusual(largest, kUsual) : 0) + odd_shape);
}

double Contest::intricacy(const FreedNumber& declared) {
  const double tolerances = std::abs(declared.value - declared.centre) / declared.number.typical;
  return 1 + kOfTolerances * std::max(0.0, std::log10(tolerances) - kUsual);
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
    c.fit = refit(
        rules_.evidence, c.begun, c.numbers, without(linear_, c.numbers),
        {.max_iterations = kGlance, .begin = Begin::far, .hopeless = kHopeless * ground_.fitted});
    c.numbers = c.fit.live;
    c.gain = ground_.held_out - c.fit.held_out;
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
    c.fit = refit(rules_.evidence, c.begun, c.numbers, without(linear_, c.numbers));
    c.numbers = c.fit.live;
    c.gain = ground_.held_out - c.fit.held_out;
  });
}

/// The first law, where it leaves something, may fit better from another of its shapes: the next
/// best trials of the winner are refitted as well.
void Contest::begin_elsewhere(Contender& best, const std::vector<Screened>& trials) const {
  if (!now_.added.empty() || !best.released.empty() ||
      rules_.excess(ground_.held_out - best.gain) < kLeaves * rules_.excess(ground_.held_out))
    return;
  std::vector<Contender> others;
  std::size_t tried = 0;
  for (const Screened& s : trials) {
    if (candidate_of(s) != best.candidate || tried++ == 0) continue;  // it began at the first
    if (others.size() == kElsewhere || !rules_.go("trying other shapes", 0)) break;
    others.push_back(contender({&rules_.trials[s.trial]}, s.size, s.gain));
    others.back().needed = needed_of(others.back());
  }
  finish(others);
  for (Contender& c : others) c.counts = counts(c);
  for (Contender& c : others)
    if (c.fit.fitted < best.fit.fitted && c.gain > best.gain) best = std::move(c);
}

/// A declared number whose tolerance is lifted competes with the effects: one that pulls at it, or,
/// where something was taken out that may have stood for it, any that then leaves it. Those that
/// may gain as much as another one are refitted.
std::vector<Contender> Contest::releases(Released which, double as_much) const {
  std::vector<Contender> all;
  for (std::size_t i = 0; i < now_.nuisances.numbers.size(); ++i) {
    const FreedNumber& n = now_.nuisances.numbers[i];
    const double far = rules_.options.out_of_tolerance;
    if (!may_be_released(rules_.options, n) ||
        (which == Released::where_pulled && !n.held && std::abs(n.pull()) < far))
      continue;
    Eigen::VectorXd precision = ground_.precision;
    precision[static_cast<Eigen::Index>(i)] = 0;
    const LinearStep s =
        linear_step(ground_.grams.fitted, ground_.grams.held_out, precision, linear_.offset());
    const double value = n.value + s.step[static_cast<Eigen::Index>(i)] * n.number.typical;
    if (value < n.number.min || value > n.number.max ||
        std::abs(value - n.centre) < far * n.tolerance)
      continue;
    Contender c;
    c.released = n.number.key;
    c.numbers = {n};
    c.gain = ground_.held_out - s.held_out;
    c.fit.held_out_of = left_after(ground_.grams.held_out_of, s.step);
    c.fit.residual = now_.residual;
    c.fit.linear_step = s.step;
    all.push_back(std::move(c));
    all.back().numbers.front().value = value;
    all.back().numbers.front().held = false;
  }
  refit_released(all, kWorthAFit * as_much);
  return all;
}

/// A long way off its declaration a number may do better than sensitivities tell.
void Contest::refit_released(std::vector<Contender>& all, double least) const {
  rules_.evidence.each_together(all.size(), [&](std::size_t i) {
    Contender& c = all[i];
    const FreedNumber& n = c.numbers.front();
    if (c.gain < least || std::abs(n.value - n.centre) < kLongWay * n.tolerance) return;
    c.numbers.front().tolerance = 0;
    Refit fit = refit(rules_.evidence, now_.machine, c.numbers, without(linear_, c.numbers),
                      {.max_iterations = kGlance});
    const double gain = ground_.held_out - fit.held_out;
    if (gain <= c.gain) return;
    c.gain = gain;
    c.numbers = fit.live;
    c.fit = std::move(fit);
  });
}

double Contest::needed_of(const Contender& c) const {
  if (c.released.empty()) return needed_of({c.candidate}, c.fit.held_out_of);
  return std::max(rules_.options.release_gain,
                  needed_at({drive_of(c.released, rules_.candidates)}, c.fit.held_out_of));
}

double Contest::needed_of(const std::vector<std::size_t>& together,
                          const std::vector<double>& after) const {
  std::set<std::string> drives;
  for (const std::size_t c : together)
    if (is_of_drive(rules_.candidates[c])) drives.insert(rules_.candidates[c].place);
  return needed_at(drives, after);
}

double Contest::needed_at(const std::set<std::string>& drives,
                          const std::vector<double>& after) const {
  const double needed = rules_.threshold(ground_.held_out_of, after);
  const std::set<std::string> found = drives_found(now_, rules_.candidates);
  if (std::none_of(drives.begin(), drives.end(),
                   [&](const std::string& drive) { return found.contains(drive); }))
    return needed;
  return std::max(
      needed, rules_.options.share_beside * rules_.left_where_gained(ground_.held_out_of, after));
}

double Contest::counts(const Contender& c) const {
  return counts(c.gain, c.fit.held_out_of, [&] {
    const LinearPart others = without(linear_, c.numbers);
    const bool of_all = c.fit.linear_step.size() == ground_.step.size();  // released along a column
    return less(c.fit.residual, of_all ? linear_.columns : others.columns, c.fit.linear_step);
  });
}

double Contest::counts(const FittedMachine& m) const {
  const LinearPart linear = m.linear();
  const Ground ground(rules_.evidence, m.residual, linear);
  return counts(ground_.held_out - m.held_out, ground.held_out_of,
                [&] { return less(m.residual, linear.columns, ground.step); });
}

bool Contest::counts_enough(const FittedMachine& m, std::size_t candidate) const {
  return counts(m) >
         needed_of({candidate}, Ground(rules_.evidence, m.residual, m.linear()).held_out_of);
}

double Contest::counts(double gain, const std::vector<double>& after,
                       const std::function<Column()>& left) const {
  std::vector<double> at_rest(after.size(), 0.0);
  if (!at_rest_.empty()) {
    at_rest = chi2_at_rest(rules_.evidence, left(), acting_);
    for (std::size_t c = 0; c < after.size(); ++c) at_rest[c] = at_rest_[c] - at_rest[c];
  }
  const auto of = [&](double all) {
    return counted(all, ground_.held_out_of, after, doubt_, doubt_anywhere_, at_rest);
  };
  // A tolerance that is not strained any more is no gain where none of the samples' counts.
  double of_samples = 0;
  for (std::size_t c = 0; c < after.size(); ++c) of_samples += ground_.held_out_of[c] - after[c];
  const double count = of(of_samples);
  return count <= 0 ? count : of(gain);
}

/// Whether there are samples at which nothing of what was found does anything.
bool Contest::any_at_rest() const {
  return !acting_.empty() && std::none_of(acting_.begin(), acting_.end(),
                                          [](const ActingSlices& a) { return a.empty(); });
}

std::vector<Screened> Contest::counted_by_samples(std::vector<Screened> screened) const {
  if (at_rest_.empty()) return screened;
  parallel_for(screened.size(), [&](std::size_t i) {
    Screened& s = screened[i];
    if (s.gain < kPromise * rules_.options.least_gain || s.counted >= s.gain) return;
    const Column left = left_by(ground_, rules_.trials[s.trial]);
    s.counted = counts(s.gain, rules_.evidence.chi2_of(left, Role::held_out), [&] { return left; });
  });
  return screened;
}

/// Held-out gain per condition: an effect that shows under several must help under two.
bool Contest::under_two_conditions(const Contender& c) const {
  const Evidence& evidence = rules_.evidence;
  if (evidence.partition().conditions() < 2) return true;
  const LinearPart others = without(linear_, c.numbers);
  std::vector<const Column*> before{&now_.residual}, after{&c.fit.residual};
  for (const Column& n : others.columns) {
    before.push_back(&n);
    after.push_back(&n);
  }
  const BlockGrams g0 = evidence.grams(before), g1 = evidence.grams(after);
  const Eigen::VectorXd step0 =
      linear_step(evidence.sum(g0, Role::fitted), evidence.sum(g0, Role::held_out),
                  others.precision(), others.offset())
          .step;
  std::map<int, double> gains;
  for (std::size_t b = 0; b < g0.size(); ++b) {
    const RecordBlock& block = evidence.partition().blocks[b];
    if (block.held_out)
      gains[block.condition] += left_after(g0[b], step0) - left_after(g1[b], c.fit.linear_step);
  }
  double sum = 0, largest = 0;
  int helped = 0;
  for (const auto& [condition, gain] : gains) {
    sum += std::abs(gain);
    largest = std::max(largest, gain);
    helped += gain > 2;
  }
  // It may show under one condition only; then it must do no harm under the others.
  return helped >= 2 ||
         (helped == 1 && largest > 0.99 * sum && largest > 4 * rules_.options.least_gain);
}

/// What a pair may have: more than anybody has where the best one explains less than half, else
/// fewer than that, if it has many (a straightness with a wave is a little of everything).
double Contest::numbers_of_two(const std::vector<Contender>& all) const {
  if (all.empty() || all.front().gain < 0.5 * rules_.excess(ground_.held_out))
    return std::numeric_limits<double>::infinity();
  const double numbers = intricacy(all.front());
  return numbers > kMany ? numbers : 0;
}

/// Declared numbers whose tolerance may be lifted, each the only one of an effect.
std::vector<TrialColumns> Contest::lifted() const {
  std::vector<TrialColumns> all;
  for (std::size_t c = 0; c < rules_.candidates.size(); ++c) {
    const std::vector<FreeNumber>& numbers = rules_.candidates[c].numbers;
    const auto moves = [](const FreeNumber& n) { return !is_fixed(n); };
    const auto own = std::find_if(numbers.begin(), numbers.end(), moves);
    if (std::count_if(numbers.begin(), numbers.end(), moves) != 1) continue;
    for (std::size_t i = 0; i < now_.nuisances.numbers.size(); ++i) {
      const FreedNumber& n = now_.nuisances.numbers[i];
      if (n.number.key != own->key || !may_be_released(rules_.options, n)) continue;
      TrialColumns t;
      t.trial.candidate = c;
      for (const FreeNumber& f : numbers)
        t.trial.values.push_back(f.key == n.number.key ? n.value : number_of(now_.machine, f.key));
      t.trial.directions = {
          {.number = static_cast<std::size_t>(own - numbers.begin()), .step = n.number.typical}};
      const std::vector<const Column*> column{&now_.nuisances.columns[i]};
      t.columns = {PackedColumn(*column.front())};
      t.own = rules_.evidence.cross(column, column);
      all.push_back(std::move(t));
    }
  }
  return all;
}

/// Whether all of them that were declared are where they hardly are by their tolerances.
bool Contest::is_out_of_tolerance(const std::vector<FreedNumber>& numbers) const {
  for (const FreedNumber& n : numbers)
    for (const FreedNumber& declared : now_.nuisances.numbers)
      if (n.number.key == declared.number.key &&
          std::abs(n.value - declared.centre) <
              rules_.options.out_of_tolerance * declared.tolerance)
        return false;
  return true;
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
  std::vector<TrialColumns> declared = lifted();
  std::vector<Screened> of_numbers =
      by_what_counts(screen(rules_.evidence, ground_, doubt_, rules_.candidates, declared));
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
    together[p] = screen_pair(rules_.evidence, ground_, doubt_, *pairs[p].first.trial,
                              *pairs[p].second.trial);
  });
  const double single = all.empty() ? 0 : all.front().counts;
  const double least =
      std::max(rules_.threshold(ground_.held_out), 0.1 * rules_.excess(ground_.held_out));
  const bool fewer = std::isfinite(numbers);
  const double enough = fewer ? single - band_of(all.front().gain) : single + least;
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
  c.needed = needed_of({one.candidate(), other.candidate()}, c.fit.held_out_of);
  c.counts = counts(c);
  if (c.counts > enough && (!fewer || intricacy(c) < numbers) && is_out_of_tolerance(c.numbers) &&
      rules_.stands_out(ground_.held_out_of, c.fit.held_out_of))
    all.insert(all.begin(), std::move(c));
}

}  // namespace vcnc
