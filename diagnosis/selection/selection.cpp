#include "diagnosis/selection/selection.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>

#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/look_about.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/screening/detection_limits.hpp"
#include "diagnosis/selection/contest.hpp"
#include "diagnosis/selection/exchange.hpp"
#include "diagnosis/selection/intricacy.hpp"
#include "diagnosis/selection/machine_changes.hpp"
#include "diagnosis/selection/trial_pool.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kAttempts = 3;      ///< contenders that are fitted together with all else
constexpr std::size_t kAlternatives = 1;  ///< other beginnings
constexpr double kMostLeft = 0.1;  ///< part of what was to be explained, to look for another one
constexpr double kUnlikely = 3;    ///< pull of a declared number

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
    const FittedMachine fitted = fit_declared(evidence_, declared_, options_.against);
    result_.base = changes_.within_tolerance(fitted, options_.out_of_tolerance);
    rules_.floor_of = noise_floor(evidence_, result_.base.residual, options_.form_of_channel);
    rules_.floor = result_.floor =
        std::accumulate(rules_.floor_of.begin(), rules_.floor_of.end(), 0.0);
    rules_.base_of = evidence_.chi2_of(result_.base.residual, Role::held_out);
    result_.base.rounding = evidence_.made_by_steps(result_.base.prediction);
    if (going_) trials_.simulate(needed());
    result_.release_limits = release_limits(fitted);
    best_.machine = result_.base;
    if (going_) unless_stopped([this] { search(); });
    for (FreedNumber& n : best_.machine.nuisances.numbers) n.held = false;
    result_.found = best_.machine;
    result_.ladder = best_.ladder;
    if (!going_ && result_.ladder.size() < result_.found.found())  // before it was settled
      result_.ladder.push_back(step_of(result_.found, result_.ladder.size()));
    // Where nothing is found, it was a matter of tolerance after all.
    if (result_.found.found() == 0) result_.found = result_.base = fitted;
    evidence_.anchor(result_.found.machine);
    if (going_)
      unless_stopped([this] {
        const bool inexact = is_inexact(evidence_, options_, rules_.floor, result_.found.held_out);
        look_about(evidence_, result_.found, rough_numbers(), inexact, options_.least_gain);
      });
    if (going_ && result_.found.found() > 0)
      unless_stopped([this] {
        result_.beside_found = limits_beside(rules_, result_.base, result_.found, needed());
      });
    result_.interrupted = !going_;
    return std::move(result_);
  }

 private:
  /// What a search came to, and by which steps.
  struct Climb {
    FittedMachine machine;
    std::vector<LadderStep> ladder;
  };

  bool go(const std::string& doing, double share) {
    const std::lock_guard lock(guard_);
    now_ = {doing, share};
    return asked();
  }
  /// The same in the midst of what is done.
  bool goes_on() {
    const std::lock_guard lock(guard_);
    return asked();
  }
  bool asked() {
    if (going_ && keep_going_ && !keep_going_(now_)) going_ = false;
    return going_;
  }

  /// Does something that may be stopped at any prediction.
  template <class F>
  void unless_stopped(F&& f) {
    evidence_.stop_when([this] { return !goes_on(); });
    try {
      f();
    } catch (const Stopped&) {
    }
    evidence_.stop_when({});
  }

  /// Keys of amplitudes that decide how an axis sticks, slips or rattles.
  std::vector<std::string> rough_numbers() const {
    std::vector<std::string> keys;
    for (const AddedEffect& a : result_.found.added) {
      const Family family = candidates_[a.candidate].family;
      if (family != Family::friction && family != Family::mechanics) continue;
      for (const FreedNumber& n : a.numbers)
        if (!n.shape && !is_phase(n.number)) keys.push_back(n.number.key);
    }
    return keys;
  }

  /// What is found, as far as it is settled, stands in `best_`.
  void search() {
    Contest contest(rules_, result_.base);
    const std::vector<Contender> contenders = contest.contenders();
    climb(contenders, contest, best_);
    for (const Contender& other : alternatives(contenders)) {
      if (best_.machine.held_out < options_.model_form * result_.floor) break;
      if (imitates(best_.machine)) break;
      Climb instead{result_.base, {}};
      climb({other}, contest, instead);
      if (instead.machine.held_out > best_.machine.held_out - options_.least_gain) continue;
      best_ = std::move(instead);
    }
  }

  /// The base machine with one of the contenders, and then one effect after the other until none
  /// gains enough; `to` holds what was settled so far.
  void climb(const std::vector<Contender>& contenders, const Contest& first, Climb& to) {
    FittedMachine now = result_.base;
    trials_.begin_again();
    evidence_.anchor(now.machine);
    if (!accept_one(now, now, contenders, first)) return;
    Found before;
    while (true) {
      to.machine = now;
      now.rounding = rounding_of(now);
      trials_.look_again(now);
      exchange_.settle(now);
      now.rounding = rounding_of(now);
      to.ladder.push_back(step_of(now, to.ladder.size()));
      to.machine = now;
      if (now.found() >= options_.max_effects) break;
      if (found_in(now) == before) break;
      before = found_in(now);
      if (imitates(now)) break;
      const FittedMachine from = changes_.within_tolerance(now, options_.out_of_tolerance);
      Contest contest(rules_, from);
      const std::vector<Contender> next = contest.contenders();
      if (now.found() >= options_.few_effects && !next.empty() &&
          next.front().gain < kHalf * rules_.excess(from.held_out))
        break;
      if (!accept_one(now, from, next, contest)) break;
    }
    hold_unlikely(now, first.appraisal());
    to.machine = std::move(now);
  }

  /// Declared numbers that are pulled to where they hardly are, for next to nothing, stay as
  /// declared: what an effect of the same drive lacks or has too much of, they would make up for.
  void hold_unlikely(FittedMachine& m, const Appraisal& first) {
    FittedMachine held = changes_.within_tolerance(m, kUnlikely);
    const double nothing = first.band_of(first.held_out());  // as if nothing were left
    if (held.found() > 0 && first.counts(held) >= first.counts(m) - nothing &&
        changes_.holds_up(held))
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
    if (rules_.excess(best_.machine.held_out) > kMostLeft * rules_.excess(result_.base.held_out))
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
    for (std::size_t i = 0; i < std::min(kAttempts, contenders.size()); ++i) {
      FittedMachine trial = changes_.fitted_with(
          from, contenders[i],
          i == 0 ? contest.equivalents(contenders) : std::vector<std::size_t>{});
      if (changes_.is_another_law(trial)) trial = changes_.with_dry_friction(std::move(trial));
      if (from.held_out - trial.held_out > contenders[i].needed && !says_the_same(trial, now) &&
          changes_.holds_up(trial)) {
        now = best_of_as_good(from, std::move(trial), contenders, i, contest.appraisal());
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

  /// `trial`, which has the contender `than`, or one of those that did as well, if it clearly does
  /// better when all is fitted, or if it is a declared number that does as well and says less.
  FittedMachine best_of_as_good(const FittedMachine& now, FittedMachine trial,
                                const std::vector<Contender>& contenders, std::size_t than,
                                const Appraisal& appraisal) {
    const Contender* chosen = &contenders[than];
    const bool leaves = rules_.excess(trial.held_out) > options_.least_gain;
    also_fitted_ = {trial};
    double present = changes_.counted_within(trial, appraisal);
    for (const Contender* other : as_good(contenders, than, leaves)) {
      FittedMachine instead = also_fitted_.emplace_back(
          changes_.fitted_with(now, *other, {}, changes_.far_more_than(trial)));
      const double more = std::max(1.0, 1.0 + static_cast<double>(other->numbers.size()) -
                                            static_cast<double>(chosen->numbers.size()));
      const double counts = changes_.counted_within(instead, appraisal),
                   band = appraisal.band_of(other->gain);
      // Of one kind, it must explain half of what the present one leaves.
      const bool far_better =
          other->released.empty() != chosen->released.empty() ||
          trial.held_out - instead.held_out >= kHalf * rules_.excess(trial.held_out);
      const bool simpler = !other->released.empty() && counts > present - band &&
                           intricacy(candidates_, *other) + (present - counts) / band <
                               intricacy(candidates_, *chosen) - kClearlySimpler;
      if (!simpler && !(far_better && counts >= present + more * options_.class_gain)) continue;
      if (!changes_.holds_up(instead) || !changes_.is_certain(instead)) continue;
      present = counts;
      trial = std::move(instead);
      chosen = other;
    }
    evidence_.anchor(trial.machine);
    return trial;
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

  /// Of the declared numbers, all in and out of tolerance fitted.
  std::vector<double> release_limits(const FittedMachine& fitted) const {
    const Ground ground(evidence_, fitted.residual, fitted.nuisances);
    return DetectionLimits(evidence_, ground, needed())
        .of_releases(fitted.nuisances.numbers, fitted.nuisances.numbers, options_.out_of_tolerance);
  }

  /// What the first effect must reach.
  Needed needed() const {
    Needed n{options_.least_gain, doubt_of(options_, result_.base.rounding), {}};
    n.consequence = {std::max(options_.least_contour_um, options_.form_um), 0,
                     options_.least_of_noise};
    return n;
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
  SelectionResult result_;
  std::vector<FittedMachine> also_fitted_;  ///< with a contender that the last one was chosen over
  Climb best_;
  std::mutex guard_;
  DiagnosisProgress now_;
  bool going_ = true;
  ContestRules rules_{
      evidence_, candidates_,
      options_,  result_.trials,
      {},        0,
      {},        [this](const std::string& doing, double share) { return go(doing, share); }};
  MachineChanges changes_{evidence_, declared_, rules_, result_.base};
  Exchange exchange_{evidence_, rules_, changes_, result_.base, also_fitted_};
  TrialPool trials_{rules_, declared_, result_.base};
};

}  // namespace

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
