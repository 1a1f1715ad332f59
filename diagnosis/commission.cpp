#include "diagnosis/commission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <mutex>
#include <numeric>
#include <set>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/replica/model_comparison.hpp"
#include "diagnosis/search/controller_check.hpp"
#include "diagnosis/search/controller_lags.hpp"
#include "diagnosis/search/evidence.hpp"
#include "diagnosis/search/intervals.hpp"
#include "diagnosis/search/refit.hpp"
#include "diagnosis/search/screening.hpp"
#include "diagnosis/search/trial.hpp"
#include "diagnosis/search/trial_values.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kFixed = 1e12;  ///< precision of a number that stays
/// What a gain, an effect of the probe or of the geometry must explain of what is left: less than
/// that is the form of friction or of the contact.
constexpr double kShareOfLeft = 0.05;
constexpr double kShareOfSide = 0.02;   ///< the same of friction that is on the motor's side
constexpr double kWellOff = 10;         // times the noise
constexpr double kStandsOut = 1.5;      // times the chi-square of noise: there is something to fit
constexpr double kNothing = 1e-3;       // of a typical size
constexpr double kNearlyAsGood = 0.95;  ///< of the most that one promises: as good

/// Effects of an axis that are fitted together, or its lags.
struct FrictionLaw {
  std::string name;
  std::vector<std::string> effects;
};

/// The simplest that does best is taken.
const std::vector<FrictionLaw> kFrictionLaws{
    {"dry and viscous friction", {"coulomb", "viscous"}},
    {"dry, viscous and break-away friction", {"coulomb", "viscous", "stribeck"}},
    {"dry and viscous friction with pre-sliding", {"coulomb", "viscous", "presliding"}},
    {"dry, viscous and break-away friction with pre-sliding",
     {"coulomb", "viscous", "stribeck", "presliding"}}};
const std::vector<std::string> kGains{"kv_error",
                                      "velocity_ff_error",
                                      "acceleration_ff_error",
                                      "velocity_gain_error",
                                      "integral_time_error",
                                      "command_delay",
                                      "position_lag_us",
                                      "velocity_lag_us",
                                      "feedforward_lag_us"};

/// What of a healthy drive hangs on where its axis is: what repeats along the way, what pulls.
const std::vector<std::string> kAlongTheWay{
    "torque_ripple",      "cogging",          "transmission_error", "encoder_eccentricity",
    "load_encoder_error", "weight_imbalance", "cable_chain",        "friction_asymmetry"};

/// What a probe and the geometry of a healthy machine have, too.
const std::vector<std::string> kMeasuring{"surface_friction", "probe_gain",     "cross_talk",
                                          "stylus_bending",   "sample_latency", "squareness",
                                          "a_axis_offset",    "a_axis_tilt",    "c_axis_offset",
                                          "c_axis_tilt",      "deviation"};

/// Of a cascade, no effect of the library: every one has them.
std::vector<Candidate> lags(const Machine& declared) {
  std::vector<Candidate> all;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    for (const LoopLag& lag : kLoopLags)
      if (declared.axes[axis].servo.controller == ServoParams::Controller::cascade)
        all.push_back({.effect = std::string(lag.key),
                       .place = std::string(kAxisNames[axis]),
                       .numbers = {{.key = fmt::format("axes.{}.{}", kAxisNames[axis], lag.key),
                                    .typical = 100,
                                    .min = 0,
                                    .max = 5000,
                                    .one_sided = true}},
                       .shape = {},
                       .family = Family::servo,
                       .of_loops = true});
  return all;
}

/// A machine with these candidates in its fit, started at what is declared of them.
FittedMachine with_candidates(const std::vector<Candidate>& candidates,
                              const FittedMachine& machine,
                              const std::vector<std::size_t>& chosen) {
  FittedMachine more = machine;
  for (const std::size_t c : chosen) {
    const Candidate& candidate = candidates[c];
    AddedEffect added{.candidate = c};
    for (std::size_t i = 0; i < candidate.numbers.size(); ++i) {
      const FreeNumber& n = candidate.numbers[i];
      const bool shape =
          std::find(candidate.shape.begin(), candidate.shape.end(), i) != candidate.shape.end();
      const double declared = number_of(machine.machine, n.key);
      // What cannot be negative would not leave zero.
      const double start = n.one_sided ? 0.3 * std::abs(n.typical) : 0;
      FreedNumber freed{.number = n, .value = declared != 0 ? declared : start, .shape = shape};
      freed.number.typical = std::max(std::abs(n.typical), 1e-9);
      added.numbers.push_back(freed);
    }
    more.added.push_back(std::move(added));
  }
  more.nuisances = without(more.nuisances, more.numbers());
  return more;
}

/// Held-out chi-square that is left with more numbers, as far as their sensitivities tell; those
/// that these take beyond their range stay where they are.
double promised(const Evidence& evidence, const FittedMachine& machine, FittedMachine more) {
  std::vector<FreedNumber> added = more.numbers();
  added.erase(added.begin(), added.begin() + static_cast<std::ptrdiff_t>(machine.columns.size()));
  take_values(added, machine.machine);
  for (Column& c : columns_of(evidence, machine.machine, machine.prediction, added))
    more.columns.push_back(std::move(c));
  const LinearPart linear = more.linear();
  const Ground ground(evidence, machine.residual, linear);
  Eigen::VectorXd precision = ground.precision, offset = ground.offset;
  const auto first = static_cast<Eigen::Index>(linear.numbers.size() - added.size());
  const auto step = [&] {
    return linear_step(ground.grams.fitted, ground.grams.held_out, precision, offset);
  };
  const LinearStep free = step();
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(added.size()); ++i) {
    const FreedNumber& n = added[static_cast<std::size_t>(i)];
    const double value = n.value + free.step[first + i] * n.number.typical;
    if (n.number.min <= value && value <= n.number.max) continue;
    precision[first + i] = kFixed;
    offset[first + i] = 0;
  }
  return step().held_out;
}

/// What was added goes along with every further fit, by its sensitivities.
void rest(FittedMachine& m) {
  const std::vector<FreedNumber> numbers = m.numbers();
  m.nuisances.numbers.insert(m.nuisances.numbers.end(), numbers.begin(), numbers.end());
  m.nuisances.columns.insert(m.nuisances.columns.end(), m.columns.begin(), m.columns.end());
  m.added.clear();
  m.columns.clear();
}

/// Whether a fit has left numbers where it began: what was gained is not theirs.
bool nothing_moved(const std::vector<FreedNumber>& begun, const std::vector<FreedNumber>& now) {
  return std::equal(begun.begin(), begun.end(), now.begin(), now.end(),
                    [](const FreedNumber& a, const FreedNumber& b) { return a.value == b.value; });
}

std::string told(const Candidate& c) {
  for (const LoopLag& lag : kLoopLags)
    if (c.effect == lag.key) return "lag of " + std::string(lag.of);
  return c.effect == "deviation" ? c.place : c.effect;
}

/// Whether an axis is told to move, or moves, at all.
bool is_driven(const Record& record, std::size_t axis) {
  const MeasuredSignal* motion = record.find(SignalKind::command, axis);
  if (!motion) motion = record.find(SignalKind::position, axis);
  if (!motion) return false;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double q : motion->value)
    if (std::isfinite(q)) low = std::min(low, q), high = std::max(high, q);
  return high - low > 1e-6;
}

class Commissioner {
 public:
  /// `leaves_noise`: a machine whose remainder is the noise, where no laps tell it; null: the
  /// declared one.
  Commissioner(const DiagnosisCase& of, const DiagnosisOptions& options,
               const KeepGoing& keep_going, const Machine* leaves_noise)
      : of_(of),
        options_(options),
        keep_going_(keep_going),
        candidates_(of.candidates),
        evidence_(of.record, of.replica, of.declared),
        controller_(of.record, of.replica.channels(), of.declared) {
    if (leaves_noise) evidence_.take_noise_from(*leaves_noise);
    if (keep_going_) evidence_.stop_when([this] { return !keep_going_(now_); });
    const Machine begun = with_lags_of(of.record, of.declared);
    tell_lags(begun);
    machine_ = fit_declared(evidence_, begun);
    for (Candidate& lag : lags(of.declared)) candidates_.push_back(std::move(lag));
  }

  Commissioning run() {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      const std::string place(kAxisNames[axis]);
      if (!is_driven(of_.record, axis)) continue;
      if (!go("friction and gains of " + place, axis)) break;
      fit_friction(place);
      const auto fit_gains = [&] {
        fit_best_of(the(kGains, place), place, [&] { return go("gains of " + place, axis); });
      };
      fit_gains();
      rest(machine_);
      if (fit_along_the_way(place, axis)) {
        fit_friction_anew(place);
        fit_gains();
      }
      fit_friction_of_motor(place);
      rest(machine_);
    }
    fit_together();
    std::vector<std::size_t> measuring;
    for (const std::string place : {"probe", "geometry", "probe.damping_ratio"})
      for (const std::size_t c : the(kMeasuring, place)) measuring.push_back(c);
    fit_best_of(measuring, "probe", [&] { return go("probe and geometry", kAxisCount); });
    rest(machine_);
    fit_together();
    tell();
    return std::move(result_);
  }

  /// Whether something else is noise than this took for it.
  bool mistook_noise() const {
    return !evidence_.noise().from_repetitions && evidence_.noise_is_another_with(machine_.machine);
  }

 private:
  bool go(const std::string& doing, std::size_t done) {
    now_ = {doing, static_cast<double>(done) / (kAxisCount + 1)};
    return !keep_going_ || keep_going_(now_);
  }

  /// Candidates by the names of their effects, in this order.
  std::vector<std::size_t> the(const std::vector<std::string>& effects,
                               const std::string& place) const {
    std::vector<std::size_t> all;
    for (const std::string& effect : effects)
      for (std::size_t c = 0; c < candidates_.size(); ++c)
        if (candidates_[c].effect == effect && candidates_[c].place == place) all.push_back(c);
    return all;
  }

  void tell_lags(const Machine& m) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
      const std::string lags = told_lags(of_.declared.axes[axis].servo, m.axes[axis].servo);
      if (!lags.empty())
        result_.notes.push_back(
            fmt::format("{}: by its controller's own signals, lag of {}", kAxisNames[axis], lags));
    }
  }

  double per_sample(const FittedMachine& m) const {
    return m.held_out / std::max(1.0, evidence_.count(Role::held_out));
  }

  /// Whether it gains what noise would not, if noise were all that is left, and that share of what
  /// is more than noise in the signals of a place.
  bool gains_enough(const FittedMachine& now, const FittedMachine& better, const std::string& place,
                    double least_share = 0) const {
    return now.held_out - better.held_out >
           std::max(options_.least_gain * std::max(1.0, per_sample(now)),
                    least_share * above_noise(now, place));
  }

  /// Whether some signal is more than noise, of an axis its own ones where it has any.
  bool stands_out(const std::string& place) const {
    const std::vector<ComparedChannel>& channels = of_.replica.channels();
    const auto is_own = [&](const ComparedChannel& c) {
      return !is_reading(c.kind) && kAxisNames[c.axis] == place;
    };
    const bool has_own = std::any_of(channels.begin(), channels.end(), is_own);
    const std::vector<double> chi2 = evidence_.chi2_of(machine_.residual, Role::held_out);
    for (std::size_t c = 0; c < chi2.size(); ++c)
      if ((!has_own || is_own(channels[c])) &&
          chi2[c] > kStandsOut * evidence_.count(c, Role::held_out))
        return true;
    return false;
  }

  /// Of an axis its own signals and the readings, else all.
  double above_noise(const FittedMachine& m, const std::string& place) const {
    const auto axis = static_cast<std::size_t>(
        std::find(kAxisNames.begin(), kAxisNames.end(), place) - kAxisNames.begin());
    const std::vector<double> chi2 = evidence_.chi2_of(m.residual, Role::held_out);
    double above = 0;
    for (std::size_t c = 0; c < chi2.size(); ++c) {
      const ComparedChannel& channel = of_.replica.channels()[c];
      if (axis == kAxisCount || is_reading(channel.kind) || channel.axis == axis)
        above += std::max(0.0, chi2[c] - evidence_.count(c, Role::held_out));
    }
    return above;
  }

  void accept(FittedMachine better, const std::string& place, const std::string& chosen) {
    result_.notes.push_back(fmt::format("{}: {}, chi-square per held-out sample {:.3g} -> {:.3g}",
                                        place, chosen, per_sample(machine_), per_sample(better)));
    machine_ = std::move(better);
  }

  void fit_friction(const std::string& place) {
    before_friction_ = machine_;
    auto [best, law] = with_friction(place, {});
    if (law.empty()) return;
    accept(std::move(best), place, law);
  }

  /// One after the other; whether there was something.
  bool fit_along_the_way(const std::string& place, std::size_t axis) {
    std::vector<std::size_t> left = the(kAlongTheWay, place);
    const std::size_t all = left.size();
    while (!left.empty() && stands_out(place) && go("ripple and waves of " + place, axis)) {
      std::vector<FittedMachine> fitted = best_along_the_way(left);
      if (fitted.empty()) break;
      std::vector<std::size_t> few;
      std::vector<double> leaves;
      for (const FittedMachine& f : fitted) {
        few.push_back(f.added.back().candidate);
        leaves.push_back(f.held_out);
      }
      const auto best = static_cast<std::size_t>(simplest_of_best(few, leaves));
      if (!gains_enough(machine_, fitted[best], place, kShareOfLeft)) break;
      const bool spring = candidates_[few[best]].effect == CableChain::text.name;
      std::erase_if(left, [&](std::size_t c) {  // where a spring rests stands for a weight
        return c == few[best] || (spring && candidates_[c].effect == WeightImbalance::text.name);
      });
      converge_anew(evidence_, fitted[best]);  // what goes along was linear about a machine without
      accept(std::move(fitted[best]), place, told(candidates_[few[best]]));
      rest(machine_);
    }
    return left.size() < all;
  }

  /// The machine with one of some candidates each, those that do most by their sensitivities.
  std::vector<FittedMachine> best_along_the_way(const std::vector<std::size_t>& some) const {
    constexpr std::size_t kFew = 2;
    std::vector<Candidate> chosen;
    for (const std::size_t c : some) chosen.push_back(candidates_[c]);
    const LinearPart linear = machine_.linear();
    const Ground ground(evidence_, machine_.residual, linear);
    const TrialValuesOf values(evidence_, machine_.machine, machine_.residual, options_.least_gain);
    std::vector<TrialColumns> tried =
        simulate_trials(evidence_, machine_.machine, machine_.prediction, chosen,
                        trials(machine_.machine, chosen, values), [](double) { return true; });
    std::vector<FittedMachine> fitted;
    std::set<std::size_t> begun;
    for (const Screened& s : screen(evidence_, ground, {}, chosen, tried)) {
      const TrialColumns& t = tried[s.trial];
      const std::size_t c = t.trial.candidate;
      if (begun.size() == kFew || !(s.gain > options_.least_gain)) break;
      if (!begun.insert(c).second) continue;
      FittedMachine& m = fitted.emplace_back(machine_);
      set_whole_numbers(m.machine, chosen[c], t.trial);
      m.added.push_back(
          {.candidate = some[c],
           .numbers = start_of(chosen[c], t.trial, s.size, t.own.fitted.diagonal().cwiseSqrt())});
      m.nuisances = without(m.nuisances, m.numbers());
    }
    evidence_.each_together(fitted.size(), [&](std::size_t i) { converge(evidence_, fitted[i]); });
    return fitted;
  }

  /// The law of friction beside all that was found since, which goes along.
  void fit_friction_anew(const std::string& place) {
    const std::vector<std::string>& of_law = kFrictionLaws.back().effects;
    LinearPart& along = before_friction_.nuisances;
    for (std::size_t i = 0; i < machine_.nuisances.numbers.size(); ++i) {
      const FreedNumber& n = machine_.nuisances.numbers[i];
      if (has_key(along.numbers, n.number.key) ||
          std::find(of_law.begin(), of_law.end(), effect_of_key(n.number.key)) != of_law.end())
        continue;
      along.numbers.push_back(n);
      along.columns.push_back(machine_.nuisances.columns[i]);
    }
    Machine& machine = before_friction_.machine;
    for (const std::size_t c : the(kAlongTheWay, place))
      for (const FreeNumber& n : candidates_[c].numbers)
        move_number(machine, n.key, number_of(machine_.machine, n.key));
    machine = with(machine, along.numbers);
    auto [best, law] = with_friction(place, {});
    if (!law.empty() && gains_enough(machine_, best, place))
      accept(std::move(best), place, law + " anew");
  }

  /// The axis as it was before its friction was fitted, with the law that does best and with what
  /// is fitted beside it; without a name where none does anything.
  std::pair<FittedMachine, std::string> with_friction(
      const std::string& place, const std::vector<std::size_t>& beside) const {
    const FittedMachine& from = before_friction_;
    std::vector<FittedMachine> trials(kFrictionLaws.size(), from);
    evidence_.each_together(trials.size(), [&](std::size_t i) {
      std::vector<std::size_t> law = the(kFrictionLaws[i].effects, place);
      if (law.empty()) return;
      law.insert(law.end(), beside.begin(), beside.end());
      const FittedMachine begun = with_candidates(candidates_, from, law);
      trials[i] = begun;
      converge(evidence_, trials[i]);
      if (nothing_moved(begun.numbers(), trials[i].numbers())) trials[i] = from;
    });
    const FittedMachine* best = &from;
    for (const FittedMachine& trial : trials)
      if (gains_enough(*best, trial, place)) best = &trial;
    if (best == &from) return {};
    const auto law = static_cast<std::size_t>(best - trials.data());
    return {std::move(trials[law]), kFrictionLaws[law].name};
  }

  /// Friction that was fitted without a gain may imitate it so well that no way leads from there to
  /// the gain: both anew.
  void fit_friction_with(std::size_t gain, const std::string& place) {
    if (!candidates_[gain].of_loops) return;
    auto [better, law] = with_friction(place, {gain});
    if (law.empty() || !gains_enough(machine_, better, place, kShareOfLeft) ||
        is_as_declared(better) || stands_for_force(better))
      return;
    accept(std::move(better), place, law + " with " + told(candidates_[gain]));
  }

  /// Of an elastic transmission, what part of its friction is before it.
  void fit_friction_of_motor(const std::string& place) {
    const std::vector<std::size_t> motor = the({"motor_friction"}, place);
    if (motor.empty()) return;
    // It does little that friction of the load does not, so no way leads there from none of it.
    constexpr std::array kShares{0.1, 0.35};
    std::vector<FittedMachine> better(kShares.size());
    evidence_.each_together(better.size(), [&](std::size_t i) {
      better[i] = with_candidates(candidates_, machine_, motor);
      move_to_motor(better[i], place, kShares[i]);
      converge(evidence_, better[i]);
    });
    const auto best = std::min_element(
        better.begin(), better.end(),
        [](const FittedMachine& a, const FittedMachine& b) { return a.held_out < b.held_out; });
    if (gains_enough(machine_, *best, place, kShareOfSide))
      accept(std::move(*best), place, "part of its friction on the motor's side");
  }

  /// A share of the dry and viscous friction of the load, on bristles of a usual stiffness.
  static void move_to_motor(FittedMachine& m, const std::string& place, double share) {
    const std::string of_axis = "effects." + place + ".";
    for (const auto& [from, to] : {std::pair{"coulomb.level", "motor_friction.level"},
                                   std::pair{"viscous.coefficient", "motor_friction.viscous"}}) {
      double moved = 0;
      for (AddedEffect& a : m.added)
        for (FreedNumber& n : a.numbers) {
          if (n.number.key.starts_with(of_axis + from)) {
            moved = share * n.value;
            n.value -= moved;
          }
          if (n.number.key.starts_with(of_axis + to)) n.value = moved;
          if (n.number.key.starts_with(of_axis + "motor_friction.stiffness") && n.value == 0)
            n.value = n.number.typical;
        }
    }
    m.machine = with(std::move(m.machine), m.numbers());
  }

  /// Of those that leave nearly the least, the first with the fewest numbers.
  std::ptrdiff_t simplest_of_best(const std::vector<std::size_t>& candidates,
                                  const std::vector<double>& promise) const {
    const auto first = std::min_element(promise.begin(), promise.end());
    const double enough = machine_.held_out - kNearlyAsGood * (machine_.held_out - *first);
    std::ptrdiff_t best = first - promise.begin();
    const auto numbers = [&](std::ptrdiff_t i) {
      return candidates_[candidates[static_cast<std::size_t>(i)]].numbers.size();
    };
    for (std::ptrdiff_t i = std::ssize(candidates); i-- > 0;)
      if (promise[static_cast<std::size_t>(i)] <= enough && numbers(i) <= numbers(best)) best = i;
    return best;
  }

  /// Whether the last of the added is nothing: what was gained is of the others.
  bool is_as_declared(const FittedMachine& m) const {
    const std::vector<FreedNumber>& numbers = m.added.back().numbers;
    return std::all_of(numbers.begin(), numbers.end(), [&](const FreedNumber& n) {
      return std::abs(n.value - number_of(of_.declared, n.number.key)) <
             kNothing * std::abs(n.number.typical);
    });
  }

  /// Whether the last of the added is a gain of which the controller's signals say that it is not.
  bool stands_for_force(const FittedMachine& m) const {
    const Candidate& last = candidates_[m.added.back().candidate];
    if (!last.of_loops) return false;
    Machine without = m.machine;
    for (const FreeNumber& n : last.numbers)
      move_number(without, n.key, number_of(of_.declared, n.key));
    const auto axis = static_cast<std::size_t>(
        std::find(kAxisNames.begin(), kAxisNames.end(), last.place) - kAxisNames.begin());
    const auto b = controller_.of(axis, evidence_.predict(without), evidence_.predict(m.machine));
    return b && b->contradicts();
  }

  /// Of those that promise half of the most, the best few: sensitivities do not tell which of them
  /// does best when it is fitted.
  std::vector<std::size_t> promising(const std::vector<std::size_t>& candidates,
                                     const std::vector<double>& promise) const {
    constexpr std::size_t kFew = 3;
    constexpr double kHalfAsGood = 0.5;
    std::vector<std::size_t> order(candidates.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t x, std::size_t y) { return promise[x] < promise[y]; });
    const double enough =
        machine_.held_out - kHalfAsGood * (machine_.held_out - promise[order.front()]);
    std::vector<std::size_t> few{candidates[order.front()]};
    for (std::size_t k = 1; k < order.size() && few.size() < kFew; ++k)
      if (promise[order[k]] <= enough) few.push_back(candidates[order[k]]);
    return few;
  }

  /// One after the other, the one first that does best.
  void fit_best_of(std::vector<std::size_t> left, const std::string& place,
                   const std::function<bool()>& go_on) {
    while (!left.empty() && go_on()) {
      std::vector<double> promise(left.size());
      evidence_.each_together(left.size(), [&](std::size_t i) {
        promise[i] =
            promised(evidence_, machine_, with_candidates(candidates_, machine_, {left[i]}));
      });
      const std::vector<std::size_t> few = promising(left, promise);
      std::vector<FittedMachine> fitted(few.size());
      std::vector<double> leaves(few.size());
      evidence_.each_together(few.size(), [&](std::size_t i) {
        fitted[i] = with_candidates(candidates_, machine_, {few[i]});
        converge(evidence_, fitted[i]);
        leaves[i] = fitted[i].held_out;
      });
      const auto best = static_cast<std::size_t>(simplest_of_best(few, leaves));
      FittedMachine& better = fitted[best];
      if (!gains_enough(machine_, better, place, kShareOfLeft)) return;
      std::erase(left, few[best]);
      if (is_as_declared(better))
        fit_friction_with(few[best], place);
      else if (!stands_for_force(better))
        accept(std::move(better), place, told(candidates_[few[best]]));
    }
  }

  /// Everything together, with sensitivities from where it has come to.
  void fit_together() {
    machine_ = fit_numbers(evidence_, machine_.machine, machine_.nuisances.numbers);
  }

  void tell() {
    const std::map<std::string, Interval> intervals = intervals_of(evidence_, machine_);
    std::vector<std::string> at_most;
    for (const FreedNumber& n : machine_.nuisances.numbers) {
      const auto i = intervals.find(n.number.key);
      const double half = i == intervals.end() ? 0 : i->second.half_width;
      result_.numbers.push_back({n.number.key, n.value, std::max(n.number.min, n.value - half),
                                 std::min(n.number.max, n.value + half)});
      if (at_its_most(n.number, n.value)) at_most.push_back(n.number.key);
    }
    // What controllers know stays what is declared.
    result_.machine = as_hypothesis(of_.declared, machine_.machine);
    result_.figures =
        figures_of(of_.record, of_.replica, of_.declared, result_.machine, "all laps");
    tell_form();
    result_.warnings = evidence_.noise().warnings;
    for (const std::string& key : at_most)
      result_.warnings.push_back(key +
                                 " went to the end of what is allowed: it stands for "
                                 "something else, which the model lacks");
    for (const SignalFigure& f : result_.figures)
      if (f.after > kWellOff * f.floor) tell_what_stays_off(f);
  }

  void tell_what_stays_off(const SignalFigure& f) {
    const ShownUnit unit = shown_unit(f.channel);
    result_.warnings.push_back(fmt::format(
        "{} stays {:.3g} {} rms off, {:.0f} times its noise: the model lacks something, or the "
        "column is another signal or late; a diagnosis against this model tells of no change of "
        "it that is smaller",
        channel_name(f.channel), f.after * unit.factor, unit.name, f.after / f.floor));
  }

  /// What is left besides noise goes into the model: of what can be compared with that.
  void tell_form() {
    Machine& m = result_.machine;
    m.commissioned.clear();
    for (const SignalFigure& f : figures_of(of_.record, of_.replica, m, m, ""))
      if (f.after > f.floor)
        m.commissioned.push_back(
            {channel_name(f.channel), std::sqrt(f.after * f.after - f.floor * f.floor)});
  }

  const DiagnosisCase& of_;
  const DiagnosisOptions& options_;
  const KeepGoing& keep_going_;
  DiagnosisProgress now_{"fitting the declared machine", 0};
  std::vector<Candidate> candidates_;
  Evidence evidence_;
  ControllerCheck controller_;
  FittedMachine machine_;  ///< added: what was found on the axis in work
  FittedMachine before_friction_;
  Commissioning result_;
};

/// Anew with other noise where it took something else for it.
Commissioning commissioned(const DiagnosisCase& of, const DiagnosisOptions& options,
                           const KeepGoing& keep_going) {
  Commissioner first(of, options, keep_going, nullptr);
  Commissioning result = first.run();
  bool again = first.mistook_noise();
  for (int round = 0; again && round < kNoiseRounds; ++round) {
    of.replica.anchor(of.declared);
    Commissioner next(of, options, keep_going, &result.machine);
    Commissioning better = next.run();
    again = next.mistook_noise();
    result = std::move(better);
  }
  return result;
}

}  // namespace

Commissioning commission(const DiagnosisCase& of, const DiagnosisOptions& options,
                         const KeepGoing& keep_going) {
  bool moves = false;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) moves |= is_driven(of.record, axis);
  if (!moves)
    throw MeasurementError(of.record.source +
                           ": no axis moves; a model can only be fitted to "
                           "motion");
  std::mutex guard;
  bool stopped = false;
  const KeepGoing watched = [&](const DiagnosisProgress& progress) {
    const std::lock_guard lock(guard);
    stopped = stopped || (keep_going && !keep_going(progress));
    return !stopped;
  };
  try {
    return commissioned(of, options, watched);
  } catch (const Stopped&) {
    return {};
  }
}

}  // namespace vcnc
