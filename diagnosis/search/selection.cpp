#include "diagnosis/search/selection.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>

#include "diagnosis/search/contest.hpp"
#include "diagnosis/search/controller_check.hpp"
#include "diagnosis/search/detection_limits.hpp"
#include "diagnosis/search/intervals.hpp"
#include "diagnosis/search/trial_values.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kClearLoss = 4;          ///< times the least gain: no need to look closer
constexpr std::size_t kAttempts = 3;      ///< contenders that are fitted together with all else
constexpr double kAsGood = 0.99;          ///< part of a gain that is as much before all is fitted
constexpr std::size_t kAlternatives = 1;  ///< other beginnings
constexpr double kMostLeft = 0.1;  ///< part of what was to be explained, to look for another one
constexpr double kHalf = 0.5;  ///< of what is left: for a further effect than few, or another one
/// Times what two effects of one place make together that each makes and the other takes back.
constexpr double kCancels = 25;
/// Part of what two effects make together that the smaller one must make, to be one of two.
constexpr double kOneOfTwo = 0.01;
constexpr double kUnlikely = 3;          ///< pull of a declared number
constexpr double kAtTheEnd = 2;          ///< times the least that a shape may be
constexpr double kClearlySimpler = 0.5;  ///< numbers
constexpr double kPartInALine = 0.25;  ///< of the least gain: less, and a wave is not worth a trial
constexpr double kNearLoss = 0.8;  ///< part of what an effect is worth that a rival must promise

Explained minus(Explained x, const std::vector<double>& y) {
  for (std::size_t c = 0; c < x.size(); ++c) x[c] -= y[c];
  return x;
}

class Search {
 public:
  Search(Evidence& evidence, const Machine& declared, const std::vector<Candidate>& candidates,
         const DiagnosisOptions& options, const KeepGoing& keep_going)
      : evidence_(evidence),
        declared_(declared),
        candidates_(candidates),
        options_(options),
        keep_going_(keep_going),
        controller_(evidence.record(), evidence.replica().channels(), declared) {}

  SelectionResult run() {
    go("fitting the declared machine", 0);
    const FittedMachine fitted = fit_declared(evidence_, declared_, options_.against);
    result_.base = within_tolerance(fitted);
    rules_.floor_of = noise_floor(evidence_, result_.base.residual, options_.form_of_channel);
    rules_.floor = result_.floor =
        std::accumulate(rules_.floor_of.begin(), rules_.floor_of.end(), 0.0);
    rules_.base_of = evidence_.chi2_of(result_.base.residual, Role::held_out);
    result_.base.rounding = evidence_.made_by_steps(result_.base.prediction);
    simulate(fitted);
    result_.found = result_.base;
    if (going_) {
      Contest contest(rules_, result_.base);
      const std::vector<Contender> contenders = contest.contenders();
      result_.found = climbed(contenders, contest, result_.ladder);
      for (const Contender& other : alternatives(contenders)) {
        if (!going_ || result_.found.held_out < options_.model_form * result_.floor) break;
        if (imitates(result_.found)) break;
        std::vector<LadderStep> ladder;
        FittedMachine found = climbed({other}, contest, ladder);
        if (!going_ || found.held_out > result_.found.held_out - options_.least_gain) continue;
        result_.found = std::move(found);
        result_.ladder = std::move(ladder);
      }
      // Where nothing is found, it was a matter of tolerance after all.
      if (result_.found.found() == 0) result_.found = result_.base = fitted;
      evidence_.anchor(result_.found.machine);
      if (result_.found.found() > 0)
        result_.beside_found = limits_beside(rules_, result_.base, result_.found, needed());
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

  FittedMachine within_tolerance(const FittedMachine& m) {
    return vcnc::within_tolerance(
        evidence_, m, options_.out_of_tolerance,
        [&](const FreedNumber& n) { return may_be_released(options_, n); });
  }

  /// The base machine with one of the contenders, and then one effect after the other until none
  /// gains enough.
  FittedMachine climbed(const std::vector<Contender>& contenders, const Contest& first,
                        std::vector<LadderStep>& ladder) {
    FittedMachine now = result_.base;
    result_.trials = known_ = at_base_;
    values_.erase(values_.begin() + 1, values_.end());
    evidence_.anchor(now.machine);
    if (!accept_one(now, now, contenders, first)) return now;
    Found before;
    while (going_) {
      now.rounding = rounding_of(now);
      look_again(now);
      exchange(now);
      join(now);
      for (std::size_t i = 0; i < now.added.size(); ++i)
        if (now.added[i].acts.empty()) weigh(now, i);  // one that took a place
      now.rounding = rounding_of(now);
      ladder.push_back(step_of(now, ladder.size()));
      if (now.found() >= options_.max_effects) break;
      if (found_in(now) == before) break;
      before = found_in(now);
      if (imitates(now)) break;
      const FittedMachine from = within_tolerance(now);
      Contest contest(rules_, from);
      const std::vector<Contender> next = contest.contenders();
      if (now.found() >= options_.few_effects && !next.empty() &&
          next.front().gain < kHalf * rules_.excess(from.held_out))
        break;
      if (!accept_one(now, from, next, contest)) break;
    }
    hold_unlikely(now, first);
    return now;
  }

  /// Declared numbers that are pulled to where they hardly are, for next to nothing, stay as
  /// declared: what an effect of the same drive lacks or has too much of, they would make up for.
  void hold_unlikely(FittedMachine& m, const Contest& contest) {
    FittedMachine held = vcnc::within_tolerance(evidence_, m, kUnlikely, [&](const FreedNumber& n) {
      return may_be_released(options_, n);
    });
    const double nothing = contest.band_of(contest.held_out());  // as if nothing were left
    if (going_ && held.found() > 0 && contest.counts(held) >= contest.counts(m) - nothing &&
        holds_up(held))
      m = std::move(held);
    for (FreedNumber& n : m.nuisances.numbers) n.held = false;
    evidence_.anchor(m.machine);
  }

  /// What encoders make beyond what is reckoned with, and what recorded steps may make.
  std::vector<double> rounding_of(const FittedMachine& now) const {
    std::vector<double> all = evidence_.made_by_steps(now.prediction);
    const std::vector<double> encoders = evidence_.rounding_beyond_reckoned(now.machine);
    for (std::size_t c = 0; c < encoders.size(); ++c) all[c] += encoders[c];
    return all;
  }

  /// Whether one law without a name does what the names so far do not.
  bool imitates(const FittedMachine& now) {
    const double all = rules_.excess(result_.base.held_out);
    if (now.added.empty() || !options_.suspects.empty() ||
        rules_.excess(now.held_out) < kMostLeft * all)
      return false;
    if (!result_.law_alone && go("looking for a law without a name", 0))
      result_.law_alone =
          best_law(evidence_, result_.base, doubt_of(options_, result_.base.rounding), options_);
    if (!result_.law_alone) return false;
    const double gain = result_.law_alone->gain, named = result_.base.held_out - now.held_out;
    const bool many = now.added.size() >= kImitation;
    return gain > (1 - kMostLeft) * all ||
           (gain > kMostLeft * all && gain > (many ? 1 : 2) * named);
  }

  /// Other ways to begin, where the best one explains most but not all: of two effects, the one
  /// that explains most at first may be neither.
  std::vector<Contender> alternatives(const std::vector<Contender>& contenders) const {
    std::vector<Contender> all;
    if (rules_.excess(result_.found.held_out) > kMostLeft * rules_.excess(result_.base.held_out))
      return all;
    for (std::size_t i = 1; i < contenders.size() && all.size() < kAlternatives; ++i)
      if (contenders[i].released.empty() && contenders[i].gain > kNearLoss * contenders[0].gain)
        all.push_back(contenders[i]);
    return all;
  }

  /// Adds the best contender of a contest about what `from` leaves that is still worth it when
  /// everything has been fitted together.
  bool accept_one(FittedMachine& now, const FittedMachine& from,
                  const std::vector<Contender>& contenders, const Contest& contest) {
    for (std::size_t i = 0; i < std::min(kAttempts, contenders.size()) && going_; ++i) {
      FittedMachine trial =
          fitted_with(from, contenders[i],
                      i == 0 ? contest.equivalents(contenders) : std::vector<std::size_t>{});
      if (is_another_law(trial)) trial = with_dry_friction(std::move(trial));
      if (from.held_out - trial.held_out > contenders[i].needed && !says_the_same(trial, now) &&
          holds_up(trial)) {
        now = best_of_as_good(from, std::move(trial), contenders, i, contest);
        return true;
      }
      evidence_.anchor(from.machine);
    }
    evidence_.anchor(now.machine);
    return false;
  }

  /// Candidates that were added, keys that were released.
  using Found = std::pair<std::set<std::size_t>, std::set<std::string>>;
  static Found found_in(const FittedMachine& m) {
    Found found;
    for (const AddedEffect& e : m.added) found.first.insert(e.candidate);
    for (const ReleasedNumber& r : m.released) found.second.insert(r.key);
    return found;
  }
  /// Whether the same was found in both: what was added to what `from` held back went again when
  /// declared numbers were pulled once more.
  static bool says_the_same(const FittedMachine& a, const FittedMachine& b) {
    return found_in(a) == found_in(b);
  }

  /// Whether its effects are told by what else is known of them than what they explain together.
  bool holds_up(const FittedMachine& m) const {
    return !cancels(m) && !is_another_law(m) && !contradicts_controller(m);
  }

  /// Whether a friction went to the end at which its law is another one: a drag that builds up over
  /// no speed is dry friction.
  bool is_another_law(const AddedEffect& a) const {
    return candidates_[a.candidate].family == Family::friction &&
           std::any_of(a.numbers.begin(), a.numbers.end(), [](const FreedNumber& n) {
             return n.shape && n.number.min > 0 && n.value < kAtTheEnd * n.number.min;
           });
  }
  bool is_another_law(const FittedMachine& m) const {
    return std::any_of(m.added.begin(), m.added.end(),
                       [&](const AddedEffect& a) { return is_another_law(a); });
  }

  /// With dry friction of that size in place of such a law, all fitted again.
  FittedMachine with_dry_friction(FittedMachine m) {
    for (AddedEffect& a : m.added) {
      const std::string& place = candidates_[a.candidate].place;
      const auto dry = std::find_if(
          candidates_.begin(), candidates_.end(),
          [&](const Candidate& c) { return c.effect == "coulomb" && c.place == place; });
      if (!is_another_law(a) || dry == candidates_.end()) continue;
      const auto candidate = static_cast<std::size_t>(dry - candidates_.begin());
      const bool there = std::any_of(m.added.begin(), m.added.end(), [&](const AddedEffect& b) {
        return b.candidate == candidate;
      });
      const FreeNumber& level = dry->numbers.front();
      if (there || has_key(m.nuisances.numbers, level.key)) continue;
      const double size = a.numbers.front().value;
      for (const FreeNumber& n : candidates_[a.candidate].numbers)
        move_number(m.machine, n.key, number_of(declared_, n.key));
      move_number(m.machine, level.key, size);
      a = {.candidate = candidate,
           .numbers = {{.number = level, .value = size, .centre = 0}},
           .explained = a.explained};
    }
    evidence_.anchor(m.machine);
    converge(evidence_, m);
    settle_in(evidence_, m, {rules_.floor + options_.least_gain});
    drop(m);
    hold_again(m);
    anchor_at(evidence_, m);
    return m;
  }

  /// Whether the controller's own signals say that a gain is not what it is told to be, or all of
  /// an axis together are not: it stands for a force (controller_check.hpp).
  bool contradicts_controller(const FittedMachine& m) const {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      std::vector<std::size_t> of_loops;
      for (const AddedEffect& a : m.added)
        if (candidates_[a.candidate].of_loops && candidates_[a.candidate].place == kAxisNames[axis])
          of_loops.push_back(a.candidate);
      if (of_loops.empty()) continue;
      const Prediction with = evidence_.predict(m.machine);
      std::vector<std::vector<std::size_t>> doubted;
      for (const std::size_t one : of_loops) doubted.push_back({one});
      if (of_loops.size() > 1) doubted.push_back(of_loops);
      for (const std::vector<std::size_t>& some : doubted) {
        Machine without = m.machine;
        for (const std::size_t c : some)
          for (const FreeNumber& n : candidates_[c].numbers)
            move_number(without, n.key, number_of(declared_, n.key));
        const auto b = controller_.of(axis, evidence_.predict(without), with);
        if (b && b->contradicts()) return true;
      }
    }
    return false;
  }

  /// Whether two effects of one place take each other back.
  bool cancels(const FittedMachine& m) const {
    const auto lost = [&](const FittedMachine& less) {
      return evidence_.chi2(less.residual, Role::held_out) - m.held_out;
    };
    for (std::size_t i = 0; i < m.added.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        if (candidates_[m.added[i].candidate].place != candidates_[m.added[j].candidate].place)
          continue;
        const FittedMachine one = taken_out(m, i, Common::held);
        const double both = std::max(lost(taken_out(one, j, Common::held)), options_.least_gain);
        if (take_each_other_back(lost(one), lost(taken_out(m, j, Common::held)), both)) return true;
      }
    return false;
  }

  /// `trial`, which has the contender `than`, or one of those that did as well, if it clearly does
  /// better when all is fitted, or if it is a declared number that does as well and says less.
  FittedMachine best_of_as_good(const FittedMachine& now, FittedMachine trial,
                                const std::vector<Contender>& contenders, std::size_t than,
                                const Contest& contest) {
    const Contender* chosen = &contenders[than];
    const bool leaves = rules_.excess(trial.held_out) > options_.least_gain;
    also_fitted_ = {trial};
    double present = counted_within(trial, contest);
    for (const Contender* other : as_good(contenders, than, leaves)) {
      FittedMachine instead =
          also_fitted_.emplace_back(fitted_with(now, *other, {}, far_more_than(trial)));
      const double more = std::max(1.0, 1.0 + static_cast<double>(other->numbers.size()) -
                                            static_cast<double>(chosen->numbers.size()));
      const double counts = counted_within(instead, contest), band = contest.band_of(other->gain);
      // Of one kind, it must explain half of what the present one leaves.
      const bool far_better =
          other->released.empty() != chosen->released.empty() ||
          trial.held_out - instead.held_out >= kHalf * rules_.excess(trial.held_out);
      const bool simpler = !other->released.empty() && counts > present - band &&
                           contest.intricacy(*other) + (present - counts) / band <
                               contest.intricacy(*chosen) - kClearlySimpler;
      if (!simpler && !(far_better && counts >= present + more * options_.class_gain)) continue;
      if (!holds_up(instead) || !is_certain(instead)) continue;
      present = counts;
      trial = std::move(instead);
      chosen = other;
    }
    evidence_.anchor(trial.machine);
    return trial;
  }

  /// The same with all declared numbers within their tolerances: what pulls them further explains
  /// less than it seems to, and what does not is not to give way to it. Anchored at `m` then.
  double counted_within(const FittedMachine& m, const Contest& contest) {
    const double counts = contest.counts(within_tolerance(m));
    evidence_.anchor(m.machine);
    return counts;
  }

  /// With a contender, everything fitted together.
  FittedMachine fitted_with(const FittedMachine& now, const Contender& contender,
                            const std::vector<std::size_t>& equivalent,
                            double much = std::numeric_limits<double>::infinity()) {
    FittedMachine m = now;
    add(m, contender, equivalent, much);
    drop(m);
    hold_again(m);
    anchor_at(evidence_, m);
    return m;
  }

  /// Those after a contender that did as well: an effect instead of a declared number out of
  /// tolerance, or the other way round, and any at all where the contender `leaves` something. What
  /// each asks of all other numbers shows when these are fitted, too, of declared numbers most:
  /// what an effect with more numbers has of its own, they have of others of their drive.
  static std::vector<const Contender*> as_good(const std::vector<Contender>& contenders,
                                               std::size_t than, bool leaves) {
    const Contender& best = contenders[than];
    std::vector<const Contender*> all;
    for (std::size_t i = than + 1; i < contenders.size() && all.size() < kAttempts; ++i)
      if (contenders[i].counts >
              (contenders[i].released.empty() ? kAsGood : kNearLoss) * best.counts &&
          (leaves || contenders[i].released.empty() != best.released.empty()))
        all.push_back(&contenders[i]);
    return all;
  }

  /// What the first effect must reach.
  Needed needed() const {
    Needed n{options_.least_gain, doubt_of(options_, result_.base.rounding), {}};
    n.consequence = {std::max(options_.least_contour_um, options_.form_um), 0,
                     options_.least_of_noise};
    return n;
  }

  /// Trials with these values. What goes along in every fit is no news: see releases().
  std::vector<Trial> worth_trying(const TrialValuesOf& values) const {
    std::vector<Trial> all = trials(result_.base.machine, candidates_, values);
    std::erase_if(all, [&](const Trial& t) {
      const std::vector<FreeNumber>& numbers = candidates_[t.candidate].numbers;
      const bool goes_along = std::all_of(numbers.begin(), numbers.end(), [&](const FreeNumber& n) {
        return is_fixed(n) || has_key(result_.base.nuisances.numbers, n.key);
      });
      return goes_along || asleep(candidates_[t.candidate]);
    });
    return all;
  }

  double worth_of_line() const { return kPartInALine * options_.least_gain; }

  /// `fitted`: the declared machine with all numbers in and out of tolerance.
  void simulate(const FittedMachine& fitted) {
    if (!going_) return;
    values_.emplace_back(evidence_, declared_, result_.base.residual, worth_of_line());
    const std::vector<Trial> all = worth_trying(values_.front());
    const std::string doing = "simulating " + std::to_string(candidates_.size()) + " candidates";
    result_.trials = simulate_trials(evidence_, result_.base.machine, result_.base.prediction,
                                     candidates_, all, [&](double s) { return go(doing, s); });
    const Ground ground(evidence_, result_.base.residual, result_.base.nuisances);
    const DetectionLimits limits(evidence_, ground, needed());
    find_detection_limits(limits, result_.trials);
    try_detection_limits(
        evidence_, result_.base.machine, result_.base.prediction, candidates_, limits,
        [&](double s) { return go("trying detection limits", s); }, result_.trials);
    at_base_ = result_.trials;
    const Ground of_all(evidence_, fitted.residual, fitted.nuisances);
    result_.release_limits = DetectionLimits(evidence_, of_all, needed())
                                 .of_releases(fitted.nuisances.numbers, fitted.nuisances.numbers,
                                              options_.out_of_tolerance);
  }

  /// What an effect of a drive does depends on the others that it has (play rattles where nothing
  /// rubs): of axes at whose drive something was found, trials are simulated anew with that, and
  /// all of them where a probe was found to tell nothing for a while. And a large effect hides the
  /// waves of a small one: shapes that only show now are tried as well.
  void look_again(const FittedMachine& now) {
    try_shapes_that_show(now);
    result_.trials = known_;
    const std::set<std::string> drives = drives_found(now, candidates_);
    std::set<std::size_t> found, blinding;
    for (const AddedEffect& a : now.added) {
      const std::string& effect = candidates_[a.candidate].effect;
      const bool blinds = effect == RangeClip::text.name || effect == ContactLoss::text.name;
      (blinds ? blinding : found).insert(a.candidate);
    }
    std::vector<std::size_t> which;
    std::vector<Trial> again;
    for (std::size_t t = 0; t < known_.size(); ++t) {
      const Trial& trial = known_[t].trial;
      const Candidate& c = candidates_[trial.candidate];
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
      const TrialColumns& before = result_.trials[which[i]];
      simulated[i].detection_limit = before.detection_limit;
      simulated[i].later_than_linear = before.later_than_linear;
      result_.trials[which[i]] = std::move(simulated[i]);
    }
  }

  /// Adds trials with shapes that no residual showed before, and with those that were found.
  void try_shapes_that_show(const FittedMachine& now) {
    if (rules_.excess(now.held_out) > options_.least_gain) {
      TrialValuesOf values(evidence_, declared_, now.residual, worth_of_line());
      for (const TrialValuesOf& known : values_) values.follow(known);
      values_.push_back(std::move(values));
    }
    for (const AddedEffect& a : now.added)
      values_.back().add_found(candidates_[a.candidate], a.numbers);
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

  std::vector<TrialColumns> simulated_with(const FittedMachine& m, std::vector<Trial> which,
                                           const std::string& doing) {
    if (which.empty()) return {};
    return simulate_trials(evidence_, m.machine, m.prediction, candidates_, std::move(which),
                           [&](double s) { return go(doing, s); });
  }

  /// A drive whose axis never moves shows nothing of its servo, friction or mechanics; of one that
  /// vibrates by itself nothing can be compared.
  bool asleep(const Candidate& c) const {
    const auto name = std::find(kAxisNames.begin(), kAxisNames.end(), c.place);
    if (name == kAxisNames.end()) return false;
    if (!is_of_drive(c)) return false;
    const auto axis = static_cast<std::size_t>(name - kAxisNames.begin());
    if (std::count(options_.vibrating.begin(), options_.vibrating.end(), axis) > 0) return true;
    const MeasuredSignal* command = evidence_.record().find(SignalKind::command, axis);
    if (!command) return false;
    const auto [low, high] = std::minmax_element(command->value.begin(), command->value.end());
    return *high - *low < 1e-9;
  }

  /// What a rival leaves that need not be fitted to the end.
  double far_more_than(const FittedMachine& m) const {
    return m.held_out + rules_.excess(m.held_out) + kClearLoss * options_.least_gain;
  }

  /// `much`: what is left where it is no use to fit on.
  void add(FittedMachine& m, const Contender& best, const std::vector<std::size_t>& equivalent,
           double much = std::numeric_limits<double>::infinity()) {
    const Explained explained =
        minus(evidence_.chi2_of(m.residual, Role::held_out), best.fit.held_out_of);
    for (FreedNumber& n : m.nuisances.numbers) n.held = false;
    if (!best.released.empty()) {
      for (FreedNumber& n : m.nuisances.numbers)
        if (n.number.key == best.released) n.tolerance = 0;
      m.released.push_back({best.released, explained, equivalent});
      if (!best.fit.live.empty()) move_to(m, best.fit);
      add_common(evidence_, m, options_.common);
      converge(evidence_, m);
      settle_in(evidence_, m, {rules_.floor + options_.least_gain, much});
      return;
    }
    // Numbers belong to the candidate whose keys they have; a pair brings two.
    std::set<std::size_t> owners{best.candidate};
    for (const FreedNumber& n : best.numbers)
      for (std::size_t c = 0; c < candidates_.size(); ++c)
        for (const FreeNumber& own : candidates_[c].numbers)
          if (own.key == n.number.key) owners.insert(c);
    for (const std::size_t owner : owners) {
      AddedEffect added{.candidate = owner, .gain = best.gain, .explained = explained};
      for (const FreedNumber& n : best.numbers)
        for (const FreeNumber& own : candidates_[owner].numbers)
          if (own.key == n.number.key) added.numbers.push_back(n);
      if (owner == best.candidate) added.class_with = equivalent;
      m.added.push_back(std::move(added));
    }
    // Numbers that other ones replace are no nuisances any more; fixed shapes stay as tried.
    m.nuisances = without(m.nuisances, best.numbers);
    move_to(m, best.fit);
    add_common(evidence_, m, options_.common);
    converge(evidence_, m);
    settle_in(evidence_, m, {rules_.floor + options_.least_gain, much});
  }

  /// Takes over where a contender was fitted to.
  void move_to(FittedMachine& m, const Refit& fit) {
    m.machine = fit.machine;
    m.held_out = fit.held_out;
    adopt(m.nuisances.numbers, fit.live);
    adopt(m.nuisances.numbers, fit.linear);
    for (AddedEffect& a : m.added) adopt(a.numbers, fit.linear);
    evidence_.anchor(m.machine);
  }

  /// Removes what the others can do without, and says what each one is worth.
  void drop(FittedMachine& m) {
    while (going_) {
      std::vector<double> loss(m.added.size());
      for (std::size_t i = 0; i < m.added.size(); ++i) loss[i] = weigh(m, i);
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

  /// Declared numbers that were released when effects were still missing get their tolerance back
  /// where that costs little.
  void hold_again(FittedMachine& m) {
    for (std::size_t i = m.released.size(); i-- > 0;) {
      FittedMachine held = m.holding(m.released[i].key, result_.base);
      const Ground ground(evidence_, held.residual, held.linear());
      m.released[i].explained =
          minus(ground.held_out_of, evidence_.chi2_of(m.residual, Role::held_out));
      if (ground.held_out - m.held_out > options_.release_gain) continue;
      for (FreedNumber& n : held.nuisances.numbers) n.held = false;
      held.held_out = ground.held_out;
      converge(evidence_, held);
      m = std::move(held);
    }
  }

  /// What one added effect is worth: without it, all others moved along their columns.
  double weigh(FittedMachine& m, std::size_t i) const {
    const FittedMachine less = taken_out(m, i, Common::held);
    m.added[i].acts = acting_slices(evidence_.record(), m.residual, less.residual);
    const Ground ground(evidence_, less.residual, less.linear());
    m.added[i].explained = minus(ground.held_out_of, evidence_.chi2_of(m.residual, Role::held_out));
    return m.added[i].gain = ground.held_out - m.held_out;
  }

  /// What becomes of common numbers at whose drive nothing is any more.
  enum class Common { held, free };
  /// Without one of its effects, everything else as it was.
  FittedMachine taken_out(const FittedMachine& m, std::size_t i, Common common) const {
    FittedMachine less = m.without_effect(i);
    for (const FreeNumber& n : candidates_[m.added[i].candidate].numbers)
      move_number(less.machine, n.key, number_of(declared_, n.key));
    if (common == Common::held) hold_common(less);
    less.prediction = evidence_.predict(less.machine);
    less.residual = evidence_.residual(less.prediction);
    less.held_out = Ground(evidence_, less.residual, less.linear()).held_out;
    return less;
  }

  /// What was accepted when other things were still missing may be a stand-in. When one gave way,
  /// the others are judged anew: what does as well as they was found beside the stand-in.
  void exchange(FittedMachine& m) {
    std::size_t exchanges = m.found() + 1;
    for (std::size_t i = 0; i < m.found() && going_;)
      if (gives_way(m, i, exchanges > 0)) {
        --exchanges;
        i = 0;
      } else {
        evidence_.anchor(m.machine);
        ++i;
      }
  }

  /// An effect is taken out, or a released number held again, and all candidates and declared
  /// numbers compete for the place, with those common numbers that it had. Those that do as well
  /// become its class; whether another one took the place.
  bool gives_way(FittedMachine& m, std::size_t i, bool may_give_way) {
    AddedEffect* effect = i < m.added.size() ? &m.added[i] : nullptr;
    ReleasedNumber* number = effect ? nullptr : &m.released[i - m.added.size()];
    FittedMachine less =
        effect ? taken_out(m, i, Common::free) : m.holding(number->key, result_.base);
    Contest contest(rules_, less);
    const double lost = contest.held_out() - m.held_out;
    if (effect) effect->needless = contest.needless_among(effect->numbers, m.columns_of(i), lost);
    std::vector<Contender> rivals =
        contest.rivals(kNearLoss * lost, effect ? effect->candidate : candidates_.size());
    if (number)
      std::erase_if(rivals, [&](const Contender& r) { return r.released == number->key; });
    std::vector<std::size_t>& alike = effect ? effect->class_with : number->class_with;
    alike.clear();
    for (const Contender& r : rivals)
      if (r.released.empty() && r.gain > std::max(lost - contest.band_of(lost), 0.5 * lost))
        alike.push_back(r.candidate);
    if (!may_give_way) return false;
    const double worth =
        contest.counts(m) - 4 * static_cast<double>(effect ? effect->numbers.size() : 1);
    const auto simpler = [&](const Contender& r) {
      return effect ? contest.says_it_simpler(r, *effect, lost)
                    : contest.is_more_usual(r, number_of_key(m, number->key), lost);
    };
    // What is missing still, one that has more numbers may imitate a little of.
    const double imitated = kHalf * rules_.excess(m.held_out);
    const auto clearly = [&](const Contender& r) {
      return effect && contest.intricacy(r) > contest.intricacy(*effect) ? imitated : 0;
    };
    const auto better = std::find_if(rivals.begin(), rivals.end(), [&](const Contender& r) {
      return simpler(r) || r.worth() >= worth + clearly(r);
    });
    if (better != rivals.end()) {
      // What takes the place of a declared number says more, and must do clearly better: else
      // the number took its place again.
      const double allowed_loss = simpler(*better) ? contest.band_of(lost)
                                  : number         ? -contest.band_of(lost)
                                                   : -options_.least_gain;
      const double least = counted_within(m, contest) - allowed_loss;
      FittedMachine instead = less;
      add(instead, *better, {});
      if (holds_up(instead) && is_certain(instead) && counted_within(instead, contest) >= least) {
        m = std::move(instead);
        return true;
      }
      rivals.erase(better);
    }
    return effect && exchange_for_as_good(m, i, less, rivals, contest, lost);
  }

  /// Two effects of one place of which another one does all, but for what a model of it may be
  /// wrong by, are that one: errors of two measuring systems that leave what the one has against
  /// the other. The smaller one must make more than that is.
  void join(FittedMachine& m) {
    for (std::size_t i = 0; i < m.added.size(); ++i)
      for (std::size_t j = i + 1; j < m.added.size() && going_; ++j)
        if (candidates_[m.added[i].candidate].place == candidates_[m.added[j].candidate].place &&
            became_one(m, i, j))
          return;
  }

  bool became_one(FittedMachine& m, std::size_t i, std::size_t j) {
    const FittedMachine less = taken_out(taken_out(m, j, Common::free), i, Common::free);
    const Contest contest(rules_, less);
    const double lost = contest.held_out() - m.held_out,
                 wrong = std::max(options_.class_gain, options_.share_of_found * lost);
    if (std::min(m.added[i].gain, m.added[j].gain) < std::max(kOneOfTwo * lost, 2 * wrong))
      return false;
    for (const Contender& r : contest.rivals(kNearLoss * lost, candidates_.size())) {
      if (!r.released.empty() || r.gain < kAsGood * lost || r.candidate == m.added[i].candidate ||
          r.candidate == m.added[j].candidate)
        continue;
      FittedMachine instead = less;
      add(instead, r, {}, far_more_than(m));
      if (instead.held_out - m.held_out > wrong || !holds_up(instead) || !is_certain(instead))
        continue;
      m = std::move(instead);
      exchange(m);
      return true;
    }
    evidence_.anchor(m.machine);
    return false;
  }

  static const FreedNumber& number_of_key(const FittedMachine& m, const std::string& key) {
    return *std::find_if(m.nuisances.numbers.begin(), m.nuisances.numbers.end(),
                         [&](const FreedNumber& n) { return n.number.key == key; });
  }

  /// Whether what was added last is not as declared for certain: else it is not told, and what is
  /// in its place would be.
  bool is_certain(const FittedMachine& m) const {
    if (m.added.empty()) return true;
    const bool inexact = is_inexact(evidence_, options_, rules_.floor, m.held_out);
    return !may_be_as_declared(m.added.back(), declared_, intervals_of(evidence_, m, inexact));
  }

  /// Sensitivities tell a large gain to some per mille only: rivals that promise as much are fitted
  /// in full. Those that do as well are of one class with the effect; whether one of them that says
  /// it more simply has taken its place.
  bool exchange_for_as_good(FittedMachine& m, std::size_t i, const FittedMachine& less,
                            const std::vector<Contender>& rivals, const Contest& contest,
                            double lost) {
    const double band = contest.band_of(lost), present = counted_within(m, contest);
    std::optional<FittedMachine> simplest;
    double least = contest.intricacy(m.added[i]);
    std::vector<std::size_t> alike = m.added[i].class_with;
    for (const Contender& r : rivals) {
      if (!going_ || !r.released.empty() || r.gain < kAsGood * lost ||
          std::count(alike.begin(), alike.end(), r.candidate) > 0)
        continue;
      FittedMachine instead = less;
      if (const FittedMachine* known = fitted_before(less, r.candidate))
        instead = *known;
      else
        add(instead, r, {}, far_more_than(m));
      const double less_counts = present - counted_within(instead, contest);
      if (less_counts > band || instead.added.empty() || !holds_up(instead)) continue;
      alike.push_back(r.candidate);
      AddedEffect& last = instead.added.back();
      last.needless =
          contest.needless_among(last.numbers, instead.columns_of(instead.added.size() - 1), lost);
      const double intricacy = contest.intricacy(last) + less_counts / band;
      if (intricacy > least - kClearlySimpler) continue;
      least = intricacy;
      simplest = std::move(instead);
    }
    m.added[i].class_with = alike;
    if (!simplest) return false;
    alike.push_back(m.added[i].candidate);
    m = std::move(*simplest);
    std::erase(alike, m.added.back().candidate);
    m.added.back().class_with = alike;
    evidence_.anchor(m.machine);
    return true;
  }

  /// `m` with one more candidate, as it was fitted in full when the last effect was accepted; null:
  /// it was not.
  const FittedMachine* fitted_before(const FittedMachine& m, std::size_t candidate) const {
    const auto found =
        std::find_if(also_fitted_.begin(), also_fitted_.end(), [&](const FittedMachine& f) {
          return f.added.size() == m.added.size() + 1 && f.added.back().candidate == candidate &&
                 f.released.size() == m.released.size() &&
                 std::equal(m.added.begin(), m.added.end(), f.added.begin(),
                            [](const AddedEffect& x, const AddedEffect& y) {
                              return x.candidate == y.candidate;
                            }) &&
                 std::equal(m.released.begin(), m.released.end(), f.released.begin(),
                            [](const ReleasedNumber& x, const ReleasedNumber& y) {
                              return x.key == y.key;
                            });
        });
    return found == also_fitted_.end() ? nullptr : &*found;
  }

  FittedMachine removed(const FittedMachine& m, std::size_t i) const {
    FittedMachine less = m;
    less.added.erase(less.added.begin() + static_cast<std::ptrdiff_t>(i));
    for (const FreeNumber& n : candidates_[m.added[i].candidate].numbers)
      move_number(less.machine, n.key, number_of(declared_, n.key));
    hold_common(less);
    converge(evidence_, less);
    return less;
  }

  LadderStep step_of(const FittedMachine& m, std::size_t before) const {
    LadderStep r{
        m.added.empty() ? "" : candidates_[m.added.back().candidate].name(), m.held_out, {}};
    if (!m.released.empty() && before >= m.added.size()) r.name = m.released.back().key;
    for (std::size_t c = 0; c < evidence_.replica().channels().size(); ++c)
      r.rms.push_back(evidence_.rms(m.prediction, c, Role::held_out));
    return r;
  }

  Evidence& evidence_;
  const Machine& declared_;
  const std::vector<Candidate>& candidates_;
  const DiagnosisOptions& options_;
  const KeepGoing& keep_going_;
  ControllerCheck controller_;
  SelectionResult result_;
  std::vector<TrialColumns> at_base_;  ///< the trials of the base machine
  std::vector<TrialColumns> known_;    ///< and those with shapes that showed later in this climb
  std::vector<TrialValuesOf> values_;  ///< what at_base_ and then known_ were made with
  std::vector<FittedMachine> also_fitted_;  ///< with a contender that the last one was chosen over
  ContestRules rules_{
      evidence_, candidates_,
      options_,  result_.trials,
      {},        0,
      {},        [this](const std::string& doing, double share) { return go(doing, share); }};
  std::mutex guard_;
  bool going_ = true;
};

}  // namespace

bool take_each_other_back(double one, double other, double both) {
  return std::min(one, other) > kCancels * both;
}

std::vector<double> noise_floor(const Evidence& evidence, const Column& residual,
                                const std::vector<double>& form_of_channel) {
  std::vector<double> floor;
  for (std::size_t c = 0; c < residual.size(); ++c) {
    const double form = form_of_channel.empty() ? 0 : form_of_channel[c];
    floor.push_back(std::min(evidence.count(c, Role::held_out) + form,
                             evidence.chi2(residual, c, Role::held_out)));
  }
  return floor;
}

SelectionResult select_effects_of(Evidence& evidence, const Machine& declared,
                                  const std::vector<Candidate>& candidates,
                                  const DiagnosisOptions& options, const KeepGoing& keep_going) {
  return Search(evidence, declared, candidates, options, keep_going).run();
}

}  // namespace vcnc
