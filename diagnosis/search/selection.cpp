#include "diagnosis/search/selection.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>
#include <set>

#include "diagnosis/search/parallel.hpp"
#include "diagnosis/search/trial_values.hpp"
#include "model/axes.hpp"
#include "model/effects/list.hpp"

namespace vcnc {
namespace {

Family family_of(const std::string& effect) {
  Family family = Family::nc;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (Effect::text.name == effect) family = Effect::text.family;
  });
  return family;
}

bool has_key(const std::vector<FreedNumber>& numbers, const std::string& key) {
  return std::any_of(numbers.begin(), numbers.end(),
                     [&](const FreedNumber& n) { return n.number.key == key; });
}

void adopt(std::vector<FreedNumber>& numbers, const std::vector<FreedNumber>& from) {
  for (FreedNumber& n : numbers)
    for (const FreedNumber& f : from)
      if (f.number.key == n.number.key) n.value = f.value;
}

/// Takes over what a refit found and computes everything at it.
void settle(const Evidence& evidence, FittedMachine& m, const Refit& f) {
  m.machine = f.machine;
  for (AddedEffect& a : m.added) adopt(a.numbers, f.live);
  adopt(m.nuisances.numbers, f.linear);
  adopt(m.nuisances.numbers, f.live);
  m.prediction = evidence.predict(m.machine);
  m.residual = evidence.residual(m.prediction);
  m.columns = f.columns;
  const Ground ground(evidence, m.residual, m.linear());
  m.held_out = ground.held_out;
}

/// Chi-square of the fitted laps with what the numbers are off their declaration.
double misfit(const Evidence& evidence, const Column& residual,
              const std::vector<FreedNumber>& numbers) {
  double sum = evidence.chi2(residual, Role::fitted);
  for (const FreedNumber& n : numbers) sum += n.pull() * n.pull();
  return sum;
}

/// Declared numbers are not believed to be off by more than this many tolerances, wherever the
/// sensitivities point to; further ones are released or compete as effects.
constexpr double kFarthestPull = 20;

/// Part of the way from `from` to `to`.
std::vector<FreedNumber> between(const std::vector<FreedNumber>& from, std::vector<FreedNumber> to,
                                 double share) {
  for (FreedNumber& n : to) {
    for (const FreedNumber& f : from)
      if (f.number.key == n.number.key) n.value = f.value + share * (n.value - f.value);
    if (n.tolerance > 0) {
      const double reach = kFarthestPull * n.tolerance;
      n.value = std::clamp(n.value, n.centre - reach, n.centre + reach);
    }
    n.value = std::clamp(n.value, std::min(n.number.min, n.number.max),
                         std::max(n.number.min, n.number.max));
  }
  return to;
}

/// Goes as far towards a refit as makes the misfit smaller: sensitivities are not everywhere what
/// they are where they were taken. False: not a step.
bool step_towards(const Evidence& evidence, FittedMachine& m, const Refit& f, double& least) {
  std::vector<FreedNumber> old = m.nuisances.numbers;
  for (const FreedNumber& n : m.numbers()) old.push_back(n);
  for (const double share : {1.0, 0.5, 0.2, 0.05}) {
    Refit part = f;
    part.linear = between(old, f.linear, share);
    part.live = between(old, f.live, share);
    part.machine = with(with(m.machine, part.live), part.linear);
    FittedMachine trial = m;
    settle(evidence, trial, part);
    const double now = misfit(evidence, trial.residual, trial.nuisances.numbers);
    if (!(now < least)) continue;
    least = now;
    m = std::move(trial);
    return true;
  }
  return false;
}

/// A refit that went nowhere.
Refit stayed(const FittedMachine& m, Refit f) {
  f.machine = m.machine;
  f.linear = m.nuisances.numbers;
  f.live = m.numbers();
  return f;
}

void linearise_nuisances(const Evidence& evidence, FittedMachine& m) {
  m.nuisances.columns = columns_of(evidence, m.machine, m.prediction, m.nuisances.numbers);
}

constexpr int kLinearisations = 3;  ///< at most, of the declared machine
constexpr double kSettled = 5;      ///< chi-square that no further one is worth
constexpr int kGlance = 4;          ///< iterations to see what a candidate is worth
constexpr double kClearLoss = 4;    ///< times the least gain: no need to look closer
constexpr std::size_t kFinalists = 3, kRivals = 4, kMoreRefits = 8;

/// What a candidate came to.
struct Contender {
  std::size_t candidate = 0;
  std::vector<FreedNumber> numbers;
  Refit fit;
  double gain = 0;
  std::string released;  ///< key of a declared number whose tolerance is lifted; else empty
  bool converged = false;
};

class Search {
 public:
  Search(Evidence& evidence, const Machine& declared, const std::vector<Candidate>& candidates,
         const DiagnosisOptions& options, const KeepGoing& keep_going)
      : evidence_(evidence),
        declared_(declared),
        candidates_(candidates),
        options_(options),
        keep_going_(keep_going) {}

  SelectionResult run() {
    go("fitting the declared machine", 0);
    result_.base = fit_declared(evidence_, declared_);
    floor_ = result_.floor =
        noise_floor(evidence_, result_.base.residual, options_.form_of_channel);
    FittedMachine& now = result_.found = result_.base;
    simulate();
    while (now.added.size() + now.released.size() < options_.max_effects && going_) {
      std::vector<Contender> contenders = contend(now);
      if (contenders.empty()) break;
      const std::vector<std::size_t> equivalent = equivalents(now, contenders);
      const double before = now.held_out;
      FittedMachine trial = now;
      add(trial, contenders, equivalent);
      if (!(before - trial.held_out > threshold(before))) {
        evidence_.anchor(now.machine);
        break;
      }
      now = std::move(trial);
      drop(now);
      if (!(before - now.held_out > threshold(before))) break;  // it was dropped again
      exchange(now);
      tell_rung(now);
    }
    result_.interrupted = !going_;
    return std::move(result_);
  }

 private:
  bool go(const std::string& doing, double share) {
    const std::lock_guard lock(guard_);
    if (going_ && keep_going_ && !keep_going_({doing, share})) going_ = false;
    return going_;
  }

  double excess(double held_out) const { return std::max(0.0, held_out - floor_); }
  double threshold(double held_out) const {
    const double left = excess(held_out);
    return std::max({options_.least_gain, options_.least_share * left,
                     options_.share_of_form * std::min(left, options_.form)});
  }

  void simulate() {
    if (!going_) return;
    std::vector<Trial> all =
        trials(result_.base.machine, candidates_, TrialValuesOf(evidence_, result_.base.residual));
    // What goes along in every fit is no news: see releases().
    std::erase_if(all, [&](const Trial& t) {
      const std::vector<FreeNumber>& numbers = candidates_[t.candidate].numbers;
      const bool goes_along = std::all_of(numbers.begin(), numbers.end(), [&](const FreeNumber& n) {
        return has_key(result_.base.nuisances.numbers, n.key);
      });
      return goes_along || asleep(candidates_[t.candidate]);
    });
    const std::string doing = "simulating " + std::to_string(candidates_.size()) + " candidates";
    result_.trials = simulate_trials(evidence_, result_.base.machine, result_.base.prediction,
                                     candidates_, all, [&](double s) { return go(doing, s); });
    const Ground ground(evidence_, result_.base.residual, result_.base.nuisances);
    find_detection_limits(evidence_, ground, result_.trials);
  }

  /// A drive whose axis never moves shows nothing of its servo, friction or mechanics.
  bool asleep(const Candidate& c) const {
    const auto name = std::find(kAxisNames.begin(), kAxisNames.end(), c.place);
    if (name == kAxisNames.end()) return false;
    const Family family = family_of(c.effect);
    if (family != Family::servo && family != Family::friction && family != Family::mechanics)
      return false;
    const MeasuredSignal* command = evidence_.record().find(
        SignalKind::command, static_cast<std::size_t>(name - kAxisNames.begin()));
    if (!command) return false;
    const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
    return *high - *low < 1e-9;
  }

  /// Screened candidates worth a refit.
  std::vector<Screened> shortlist(const std::vector<Screened>& screened) const {
    std::vector<Screened> list;
    std::map<Family, std::size_t> of_family;
    for (const Screened& s : screened) {
      if (s.gain < 0.3 * options_.least_gain) break;
      const Family family = family_of(candidates_[candidate_of(s)].effect);
      const bool first = list.size() < options_.refits;
      if (!first && (of_family[family] >= options_.per_family || s.gain < 0.1 * list[0].gain))
        continue;
      ++of_family[family];
      list.push_back(s);
    }
    return list;
  }

  std::size_t candidate_of(const Screened& s) const {
    return result_.trials[s.trial].trial.candidate;
  }

  /// The refitted candidates that gain enough, best first.
  std::vector<Contender> contend(const FittedMachine& now) {
    const LinearPart linear = now.linear();
    const Ground ground(evidence_, now.residual, linear);
    std::vector<Screened> screened = screen(evidence_, ground, candidates_, result_.trials);
    std::erase_if(screened, [&](const Screened& s) {
      return std::any_of(now.added.begin(), now.added.end(),
                         [&](const AddedEffect& a) { return a.candidate == candidate_of(s); });
    });
    const std::vector<Screened> list = shortlist(screened);
    std::vector<Contender> all = refitted(now, linear, ground, list);
    finish(now, linear, ground, all);
    if (const std::vector<Screened> more = likes_of(ground, all, screened, list); !more.empty()) {
      std::vector<Contender> others = refitted(now, linear, ground, more);
      std::move(others.begin(), others.end(), std::back_inserter(all));
      finish(now, linear, ground, all);
    }
    for (Contender& c : releases(now, linear, ground)) all.push_back(std::move(c));
    const double needed = threshold(ground.held_out);
    std::erase_if(all, [&](const Contender& c) {
      return c.gain <= needed ||
             (c.released.empty() && (counted_gain(now, linear, ground, c) <= needed ||
                                     !under_two_conditions(now, linear, c)));
    });
    std::stable_sort(all.begin(), all.end(),
                     [](const Contender& x, const Contender& y) { return worth(x) > worth(y); });
    put_simplest_first(ground, all);
    if (all.empty() || all.front().gain < 0.5 * excess(ground.held_out))
      look_ahead(now, linear, ground, screened, all);
    return all;
  }

  std::vector<Contender> refitted(const FittedMachine& now, const LinearPart& linear,
                                  const Ground& ground, const std::vector<Screened>& list) {
    std::vector<Contender> all(list.size());
    std::atomic<std::size_t> done = 0;
    evidence_.each_together(list.size(), [&](std::size_t i) {
      if (!going_) return;
      all[i] = contender(now, linear, ground, {list[i].trial}, list[i].size, list[i].gain);
      go("refitting " + std::to_string(list.size()) + " candidates",
         static_cast<double>(++done) / static_cast<double>(list.size()));
    });
    return all;
  }

  /// Gains that differ by less are alike when the best is `gain`.
  double band_of(const Ground& ground, double gain) const {
    return options_.class_gain + options_.class_share * excess(ground.held_out - gain);
  }

  /// What was left out of a list though its promise is like the best gain.
  std::vector<Screened> likes_of(const Ground& ground, const std::vector<Contender>& all,
                                 const std::vector<Screened>& screened,
                                 const std::vector<Screened>& list) const {
    std::vector<Screened> more;
    if (all.empty()) return more;
    const double best = all.front().gain;
    if (best < threshold(ground.held_out)) return more;
    for (const Screened& s : screened) {
      if (more.size() == kMoreRefits || s.gain < best - 2 * band_of(ground, best)) break;
      if (std::none_of(list.begin(), list.end(),
                       [&](const Screened& l) { return l.trial == s.trial; }))
        more.push_back(s);
    }
    return more;
  }

  /// Of those that do as well as the first, the one with the fewest numbers, of a size nearest to
  /// the typical one.
  void put_simplest_first(const Ground& ground, std::vector<Contender>& all) const {
    if (all.empty() || !all.front().released.empty()) return;
    const double band = band_of(ground, all.front().gain);
    auto simplest = all.begin();
    for (auto c = all.begin(); c != all.end(); ++c)
      if (c->released.empty() && c->gain > all.front().gain - band &&
          intricacy(*c) < intricacy(*simplest))
        simplest = c;
    std::rotate(all.begin(), simplest, simplest + 1);
  }

  /// Numbers, and two for every tenth or tenfold of the typical size.
  double intricacy(const Contender& c) const {
    double largest = 0;
    for (const FreedNumber& n : c.numbers)
      for (const FreeNumber& own : candidates_[c.candidate].numbers)
        if (own.key == n.number.key && !n.shape && !is_phase(own) && own.typical != 0)
          largest = std::max(largest, std::abs(n.value / own.typical));
    const double unusual = largest > 0 ? std::abs(std::log10(largest)) : 0;
    return static_cast<double>(c.numbers.size()) + 2 * unusual;
  }

  /// Gain less what further numbers give by chance.
  static double worth(const Contender& c) {
    return c.gain - 4 * static_cast<double>(c.numbers.size());
  }

  Contender contender(const FittedMachine& now, const LinearPart& linear, const Ground& ground,
                      const std::vector<std::size_t>& trials, const Eigen::VectorXd& size,
                      double promised) {
    Contender best;
    // From where the sensitivities point to, and from a third of the way: some effects are not
    // linear and disappoint.
    for (const double share : {1.0, 0.3}) {
      Contender c;
      Eigen::Index at = 0;
      for (const std::size_t t : trials) {
        const Trial& trial = result_.trials[t].trial;
        const auto width = static_cast<Eigen::Index>(trial.directions.size());
        const std::vector<FreedNumber> numbers = start_of(
            candidates_[trial.candidate], trial, Eigen::VectorXd(share * size.segment(at, width)));
        c.numbers.insert(c.numbers.end(), numbers.begin(), numbers.end());
        at += width;
      }
      c.candidate = result_.trials[trials.front()].trial.candidate;
      const LinearPart others = without(linear, c.numbers);
      c.fit = refit(evidence_, now.machine, c.numbers, others, kGlance);
      c.numbers = c.fit.live;
      c.gain = ground.held_out - c.fit.held_out;
      const bool first = share == 1.0;
      if (first || c.gain > best.gain) best = std::move(c);
      if (best.gain > 0.5 * promised) break;
    }
    return best;
  }

  /// Converges those contenders that may yet be the best.
  void finish(const FittedMachine& now, const LinearPart& linear, const Ground& ground,
              std::vector<Contender>& all) {
    std::stable_sort(all.begin(), all.end(),
                     [](const Contender& x, const Contender& y) { return x.gain > y.gain; });
    const double best = all.empty() ? 0 : all.front().gain;
    std::size_t finalists = 0;
    while (finalists < all.size() && all[finalists].gain >= 0.5 * best &&
           (finalists < kFinalists || all[finalists].gain >= best - options_.class_gain))
      ++finalists;
    evidence_.each_together(finalists, [&](std::size_t i) {
      if (!going_) return;
      Contender& c = all[i];
      if (c.converged) return;
      c.converged = true;
      c.fit = refit(evidence_, now.machine, c.numbers, without(linear, c.numbers));
      c.numbers = c.fit.live;
      c.gain = ground.held_out - c.fit.held_out;
    });
  }

  /// A declared number whose tolerance is lifted competes with the effects.
  std::vector<Contender> releases(const FittedMachine& now, const LinearPart& linear,
                                  const Ground& ground) const {
    std::vector<Contender> all;
    for (std::size_t i = 0; i < now.nuisances.numbers.size(); ++i) {
      const FreedNumber& n = now.nuisances.numbers[i];
      if (std::abs(n.pull()) < options_.out_of_tolerance ||
          n.number.key.starts_with("effects.setup."))
        continue;
      Eigen::VectorXd precision = ground.precision;
      precision[static_cast<Eigen::Index>(i)] = 0;
      const LinearStep s =
          linear_step(ground.grams.fitted, ground.grams.held_out, precision, linear.offset());
      Contender c;
      c.released = n.number.key;
      c.numbers = {n};
      c.gain = ground.held_out - s.held_out;
      all.push_back(std::move(c));
    }
    return all;
  }

  /// Held-out gain less the share of what is found already that its model may be wrong by.
  double counted_gain(const FittedMachine& now, const LinearPart& linear, const Ground& ground,
                      const Contender& c) const {
    const std::vector<double>& form = options_.form_of_channel;
    if (form.empty() && (now.added.empty() || options_.share_of_found == 0)) return c.gain;
    const LinearPart others = without(linear, c.numbers);
    const Eigen::VectorXd step =
        linear_step(ground.grams.fitted, ground.grams.held_out, ground.precision, ground.offset)
            .step;
    const Column before = less(now.residual, linear.columns, step),
                 after = less(c.fit.residual, others.columns, c.fit.linear_step);
    double counted = c.gain;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const double left = evidence_.chi2(before, i, Role::held_out);
      const double gain = left - evidence_.chi2(after, i, Role::held_out);
      const double explained =
          std::max(0.0, evidence_.chi2(result_.base.residual, i, Role::held_out) - left);
      const double doubtful = options_.share_of_found * explained +
                              (form.empty() ? 0 : options_.taken_of_form * form[i]);
      counted -= std::clamp(gain, 0.0, doubtful);
    }
    return counted;
  }

  /// Held-out gain per condition: an effect that shows under several must help under two.
  bool under_two_conditions(const FittedMachine& now, const LinearPart& linear,
                            const Contender& c) const {
    if (evidence_.partition().conditions() < 2) return true;
    const LinearPart others = without(linear, c.numbers);
    std::vector<const Column*> before{&now.residual}, after{&c.fit.residual};
    for (const Column& n : others.columns) {
      before.push_back(&n);
      after.push_back(&n);
    }
    const BlockGrams g0 = evidence_.grams(before), g1 = evidence_.grams(after);
    const Eigen::VectorXd step0 =
        linear_step(evidence_.sum(g0, Role::fitted), evidence_.sum(g0, Role::held_out),
                    others.precision(), others.offset())
            .step;
    const auto left = [](const Eigen::MatrixXd& g, const Eigen::VectorXd& s) {
      const Eigen::Index n = s.size();
      return g(0, 0) - 2 * s.dot(g.block(1, 0, n, 1).col(0)) + s.dot(g.block(1, 1, n, n) * s);
    };
    std::map<int, double> gains;
    for (std::size_t b = 0; b < g0.size(); ++b) {
      const Block& block = evidence_.partition().blocks[b];
      if (block.held_out)
        gains[block.condition] += left(g0[b], step0) - left(g1[b], c.fit.linear_step);
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
           (helped == 1 && largest > 0.99 * sum && largest > 4 * options_.least_gain);
  }

  void look_ahead(const FittedMachine& now, const LinearPart& linear, const Ground& ground,
                  const std::vector<Screened>& screened, std::vector<Contender>& all) {
    const std::size_t n = std::min(options_.pairs_of, screened.size());
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = i + 1; j < n; ++j) pairs.emplace_back(i, j);
    std::vector<double> gains(pairs.size());
    std::vector<Eigen::VectorXd> sizes(pairs.size());
    parallel_for(pairs.size(), [&](std::size_t p) {
      const auto [i, j] = pairs[p];
      gains[p] = pair_gain(evidence_, ground, result_.trials[screened[i].trial],
                           result_.trials[screened[j].trial], sizes[p]);
    });
    if (pairs.empty() || !going_) return;
    const auto best =
        static_cast<std::size_t>(std::max_element(gains.begin(), gains.end()) - gains.begin());
    const double single = all.empty() ? 0 : all.front().gain;
    const double least = std::max(threshold(ground.held_out), 0.1 * excess(ground.held_out));
    if (gains[best] < single + least) return;
    const auto [i, j] = pairs[best];
    Contender c = contender(now, linear, ground, {screened[i].trial, screened[j].trial},
                            sizes[best], gains[best]);
    if (counted_gain(now, linear, ground, c) > single + least)
      all.insert(all.begin(), std::move(c));
  }

  /// Indices of contenders that do as well as the first.
  std::vector<std::size_t> equivalents(const FittedMachine&,
                                       const std::vector<Contender>& contenders) const {
    std::vector<std::size_t> all;
    const auto most =
        std::max_element(contenders.begin(), contenders.end(),
                         [](const Contender& x, const Contender& y) { return x.gain < y.gain; });
    const double remaining = excess(most->released.empty() ? most->fit.held_out : floor_);
    const double band = options_.class_gain + options_.class_share * remaining;
    for (std::size_t i = 1; i < contenders.size(); ++i)
      if (contenders[i].released.empty() && contenders[i].gain > most->gain - band &&
          contenders[i].gain > 0.5 * most->gain)
        all.push_back(contenders[i].candidate);
    return all;
  }

  void add(FittedMachine& m, const std::vector<Contender>& contenders,
           const std::vector<std::size_t>& equivalent) {
    const Contender& best = contenders.front();
    if (!best.released.empty()) {
      for (FreedNumber& n : m.nuisances.numbers)
        if (n.number.key == best.released) n.tolerance = 0;
      m.released.push_back(best.released);
      converge(evidence_, m);
      return;
    }
    // Numbers belong to the candidate whose keys they have; a pair brings two.
    std::set<std::size_t> owners{best.candidate};
    for (const FreedNumber& n : best.numbers)
      for (std::size_t c = 0; c < candidates_.size(); ++c)
        for (const FreeNumber& own : candidates_[c].numbers)
          if (own.key == n.number.key) owners.insert(c);
    for (const std::size_t owner : owners) {
      AddedEffect added{.candidate = owner, .numbers = {}, .gain = best.gain, .class_with = {}};
      for (const FreedNumber& n : best.numbers)
        for (const FreeNumber& own : candidates_[owner].numbers)
          if (own.key == n.number.key) added.numbers.push_back(n);
      if (owner == best.candidate) added.class_with = equivalent;
      m.added.push_back(std::move(added));
    }
    m.machine = best.fit.machine;
    m.held_out = best.fit.held_out;
    // Numbers that other ones replace are no nuisances any more; fixed shapes stay as tried.
    m.nuisances = without(m.nuisances, best.numbers);
    adopt(m.nuisances.numbers, best.fit.linear);
    for (AddedEffect& a : m.added) adopt(a.numbers, best.fit.linear);
    evidence_.anchor(m.machine);
    converge(evidence_, m);
  }

  /// Removes what the others can do without, and says what each one is worth.
  void drop(FittedMachine& m) {
    while (going_) {
      std::vector<double> loss(m.added.size());
      for (std::size_t i = 0; i < m.added.size(); ++i)
        m.added[i].gain = loss[i] = loss_without(m, i);
      if (m.added.empty()) return;
      const auto least =
          static_cast<std::size_t>(std::min_element(loss.begin(), loss.end()) - loss.begin());
      if (loss[least] > kClearLoss * options_.least_gain) return;
      FittedMachine less = removed(m, least);
      m.added[least].gain = less.held_out - m.held_out;
      if (m.added[least].gain >= options_.least_gain) return;
      m = std::move(less);
    }
  }

  /// What one added effect is worth: without it, all others moved along their columns.
  double loss_without(const FittedMachine& m, std::size_t i) const {
    const FittedMachine less = taken_out(m, i);
    const Ground ground(evidence_, less.residual, less.linear());
    return ground.held_out - m.held_out;
  }

  /// Without one of its effects, everything else as it was.
  FittedMachine taken_out(const FittedMachine& m, std::size_t i) const {
    FittedMachine less = m;
    std::size_t first = 0;
    for (std::size_t j = 0; j < i; ++j) first += m.added[j].numbers.size();
    const auto from = less.columns.begin() + static_cast<std::ptrdiff_t>(first);
    less.columns.erase(from, from + static_cast<std::ptrdiff_t>(m.added[i].numbers.size()));
    less.added.erase(less.added.begin() + static_cast<std::ptrdiff_t>(i));
    for (const FreeNumber& n : candidates_[m.added[i].candidate].numbers)
      move_number(less.machine, n.key, number_of(declared_, n.key));
    less.prediction = evidence_.predict(less.machine);
    less.residual = evidence_.residual(less.prediction);
    less.held_out = Ground(evidence_, less.residual, less.linear()).held_out;
    return less;
  }

  /// Effects that were accepted when others were still missing may be stand-ins: each is taken out
  /// and all candidates compete for its place.
  void exchange(FittedMachine& m) {
    for (std::size_t i = 0; i < m.added.size() && going_; ++i) {
      if (m.added.size() < 2) return;
      const FittedMachine less = taken_out(m, i);
      const LinearPart linear = less.linear();
      const Ground ground(evidence_, less.residual, linear);
      const double lost = ground.held_out - m.held_out;
      std::vector<Screened> screened = screen(evidence_, ground, candidates_, result_.trials);
      std::erase_if(screened, [&](const Screened& s) {
        return s.gain < 0.8 * lost ||
               std::any_of(m.added.begin(), m.added.end(),
                           [&](const AddedEffect& a) { return a.candidate == candidate_of(s); });
      });
      if (screened.size() > kRivals) screened.resize(kRivals);
      std::vector<Contender> rivals(screened.size());
      evidence_.each_together(screened.size(), [&](std::size_t r) {
        const Screened& s = screened[r];
        rivals[r] = contender(less, linear, ground, {s.trial}, s.size, s.gain);
      });
      std::stable_sort(rivals.begin(), rivals.end(),
                       [](const Contender& x, const Contender& y) { return worth(x) > worth(y); });
      const double band = options_.class_gain + options_.class_share * excess(m.held_out);
      m.added[i].class_with.clear();
      for (const Contender& r : rivals)
        if (r.gain > std::max(lost - band, 0.5 * lost))
          m.added[i].class_with.push_back(r.candidate);
      if (rivals.empty() ||
          worth(rivals.front()) < lost - 4 * static_cast<double>(m.added[i].numbers.size()))
        continue;
      FittedMachine other = less;
      add(other, {rivals.front()}, {});
      if (other.held_out > m.held_out - options_.least_gain) {
        evidence_.anchor(m.machine);
        continue;
      }
      m = std::move(other);
    }
  }

  FittedMachine removed(const FittedMachine& m, std::size_t i) const {
    FittedMachine less = m;
    less.added.erase(less.added.begin() + static_cast<std::ptrdiff_t>(i));
    for (const FreeNumber& n : candidates_[m.added[i].candidate].numbers)
      move_number(less.machine, n.key, number_of(declared_, n.key));
    converge(evidence_, less);
    return less;
  }
  void tell_rung(const FittedMachine& m) {
    result_.rung_chi2.push_back(m.held_out);
    std::string name = m.added.empty() ? "" : candidates_[m.added.back().candidate].name();
    if (!m.released.empty() && result_.rung_name.size() >= m.added.size()) name = m.released.back();
    result_.rung_name.push_back(name);
    std::vector<double> rms;
    for (std::size_t c = 0; c < evidence_.replica().channels().size(); ++c)
      rms.push_back(evidence_.rms(m.prediction, c, Role::held_out));
    result_.rung_rms.push_back(std::move(rms));
  }

  Evidence& evidence_;
  const Machine& declared_;
  const std::vector<Candidate>& candidates_;
  const DiagnosisOptions& options_;
  const KeepGoing& keep_going_;
  double floor_ = 0;
  SelectionResult result_;
  std::mutex guard_;
  bool going_ = true;
};

}  // namespace

std::vector<FreedNumber> FittedMachine::numbers() const {
  std::vector<FreedNumber> all;
  for (const AddedEffect& a : added) all.insert(all.end(), a.numbers.begin(), a.numbers.end());
  return all;
}

LinearPart FittedMachine::linear() const {
  LinearPart all = nuisances;
  const std::vector<FreedNumber> more = numbers();
  for (std::size_t i = 0; i < more.size() && i < columns.size(); ++i) {
    all.numbers.push_back(more[i]);
    all.columns.push_back(columns[i]);
  }
  return all;
}

void converge(const Evidence& evidence, FittedMachine& m) {
  constexpr int kRounds = 3;
  double before = m.held_out;
  double least =
      misfit(evidence, evidence.residual(evidence.predict(m.machine)), m.nuisances.numbers);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<FreedNumber> live = m.numbers();
    const Refit f = refit(evidence, m.machine, live, without(m.nuisances, live), 8);
    if (!step_towards(evidence, m, f, least)) {
      if (round == 0) settle(evidence, m, stayed(m, f));
      break;
    }
    const double now = m.held_out;
    if (std::abs(before - now) < 1 + 1e-4 * std::abs(now - evidence.count(Role::held_out))) break;
    before = now;
  }
}

FittedMachine fit_declared(Evidence& evidence, const Machine& declared) {
  return fit_numbers(evidence, declared, nuisances(declared));
}

FittedMachine fit_numbers(Evidence& evidence, const Machine& declared,
                          std::vector<FreedNumber> numbers) {
  FittedMachine m;
  m.machine = declared;
  m.nuisances.numbers = std::move(numbers);
  m.prediction = evidence.predict(declared);
  linearise_nuisances(evidence, m);
  // What the run cannot show stays at its declaration.
  LinearPart shown;
  for (std::size_t i = 0; i < m.nuisances.numbers.size(); ++i) {
    if (m.nuisances.columns[i].zero()) continue;
    shown.numbers.push_back(m.nuisances.numbers[i]);
    shown.columns.push_back(std::move(m.nuisances.columns[i]));
  }
  m.nuisances = std::move(shown);
  converge(evidence, m);
  evidence.anchor(m.machine);
  converge(evidence, m);
  for (int round = 0; round < kLinearisations; ++round) {
    const double before = m.held_out;
    linearise_nuisances(evidence, m);
    converge(evidence, m);
    if (before - m.held_out < kSettled) break;
  }
  return m;
}

double noise_floor(const Evidence& evidence, const Column& residual,
                   const std::vector<double>& form_of_channel) {
  double floor = 0;
  for (std::size_t c = 0; c < residual.size(); ++c) {
    const double form = form_of_channel.empty() ? 0 : form_of_channel[c];
    floor += std::min(evidence.count(c, Role::held_out) + form,
                      evidence.chi2(residual, c, Role::held_out));
  }
  return floor;
}

SelectionResult select_effects_of(Evidence& evidence, const Machine& declared,
                                  const std::vector<Candidate>& candidates,
                                  const DiagnosisOptions& options, const KeepGoing& keep_going) {
  return Search(evidence, declared, candidates, options, keep_going).run();
}

}  // namespace vcnc
