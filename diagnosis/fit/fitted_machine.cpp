#include "diagnosis/fit/fitted_machine.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/fit/ground.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Angles that went so far that the end of what is allowed is near, a turn back.
void turn_back(std::vector<FreedNumber>& numbers) {
  constexpr double kNearEnd = 270, kTurn = 360;  // [deg]
  for (FreedNumber& n : numbers)
    if (is_phase(n.number) && n.tolerance == 0 && std::abs(n.value) > kNearEnd)
      n.value = std::remainder(n.value, kTurn);
}

/// `m` at what several refits of it found, with everything that is computed there.
std::vector<FittedMachine> settled_from(const Evidence& evidence, const FittedMachine& m,
                                        const std::vector<Refit>& found) {
  std::vector<FittedMachine> all(found.size(), m);
  std::vector<Machine> machines;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Refit& f = found[i];
    FittedMachine& at = all[i];
    for (AddedEffect& a : at.added) adopt(a.numbers, f.live), turn_back(a.numbers);
    adopt(at.nuisances.numbers, f.linear);
    adopt(at.nuisances.numbers, f.live);
    turn_back(at.nuisances.numbers);
    at.machine = with(with(f.machine, at.numbers()), at.nuisances.numbers);
    machines.push_back(at.machine);
  }
  std::vector<Prediction> predictions = evidence.predict_all(machines);
  for (std::size_t i = 0; i < found.size(); ++i) {
    FittedMachine& at = all[i];
    at.prediction = std::move(predictions[i]);
    at.residual = evidence.residual(at.prediction);
    at.columns = found[i].columns;
    at.held_out = Ground(evidence, at.residual, at.linear()).held_out;
  }
  return all;
}

/// Times its noise that a channel may be off before it loses weight.
constexpr double kLoudChannel = 2;

/// Weight of each channel: one that is far off tells of something missing, not of the numbers that
/// are there, and would pull them anywhere. (As if its noise were what it is off.)
std::vector<double> weights(const Evidence& evidence, const Column& residual) {
  std::vector<double> all(residual.size(), 1.0);
  for (std::size_t c = 0; c < all.size(); ++c) {
    const double off = evidence.chi2(residual, c, Role::fitted);
    const double expected = kLoudChannel * kLoudChannel * evidence.count(c, Role::fitted);
    if (off > expected) all[c] = expected / off;
  }
  return all;
}

/// Chi-square of the fitted laps with what the numbers are off their declaration.
double misfit(const Evidence& evidence, const Column& residual, const std::vector<double>& weight,
              const std::vector<FreedNumber>& numbers) {
  double sum = 0;
  for (std::size_t c = 0; c < weight.size(); ++c)
    sum += weight[c] * evidence.chi2(residual, c, Role::fitted);
  for (const FreedNumber& n : numbers) sum += n.pull() * n.pull();
  return sum;
}

/// The same where it stands, all channels alike.
double misfit(const Evidence& evidence, const FittedMachine& m) {
  const std::vector<double> alike(m.residual.size(), 1.0);
  return misfit(evidence, m.residual, alike, m.nuisances.numbers);
}

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

constexpr double kDamping = 1e-3;       ///< of steps that fail undamped (refit.hpp)
constexpr double kNoStep = 1;           ///< chi-square that no step is worth
constexpr double kMuch = 10;            ///< and that a part of the step is worth to be sought for
constexpr double kBeyondPromise = 0.1;  ///< of what a step promises, that it may do better by
constexpr double kFarthestStep = 64;    ///< times what sensitivities tell

/// Goes as far towards a refit as makes the misfit smaller: sensitivities are not everywhere what
/// they are where they were taken. False: not a step.
bool step_towards(const Evidence& evidence, FittedMachine& m, const Refit& f,
                  const std::vector<double>& weight, double least) {
  if (least - f.fitted < kNoStep) return false;
  std::vector<FreedNumber> old = m.nuisances.numbers;
  for (const FreedNumber& n : m.numbers()) old.push_back(n);
  const auto at = [&](const std::vector<double>& shares) {
    std::vector<Refit> parts(shares.size(), f);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      Refit& part = parts[i];
      part.linear = between(old, f.linear, shares[i]);
      part.live = between(old, f.live, shares[i]);
      part.machine = with(with(m.machine, part.live), part.linear);
    }
    return settled_from(evidence, m, parts);
  };
  const auto misfit_of = [&](const FittedMachine& trial) {
    return misfit(evidence, trial.residual, weight, trial.nuisances.numbers);
  };
  FittedMachine whole = std::move(at({1.0}).front());
  double now = misfit_of(whole);
  if (now < least) {
    // What is rough about the sensitivities makes steps too short: where one does better than it
    // promised, one goes on.
    const bool better = f.fitted - now > kNoStep + kBeyondPromise * (least - f.fitted);
    for (double more = 2; better && more <= kFarthestStep; more *= 2) {
      FittedMachine farther = std::move(at({more}).front());
      const double then = misfit_of(farther);
      if (then > now - kNoStep) break;
      whole = std::move(farther);
      now = then;
    }
    m = std::move(whole);
    return true;
  }
  if ((now > least && now - least < kNoStep) || least - f.fitted <= kMuch) return false;
  for (FittedMachine& part : at({0.5, 0.2, 0.05})) {  // side by side (lanes)
    now = misfit_of(part);
    if (now > least && now - least < kNoStep) return false;
    if (!(now < least)) continue;
    m = std::move(part);
    return true;
  }
  return false;
}

/// Whether two refits of the same machine go to the same place: linear numbers but for a twentieth
/// of their way, live ones, which damping hardly moves, but for a twentieth of themselves.
bool leads_the_same_way(const Refit& a, const Refit& b) {
  constexpr double kOfTheWay = 0.05;
  const auto apart = [](double x, double y) {
    return std::abs(x - y) > kOfTheWay * std::max(std::abs(x), std::abs(y));
  };
  for (Eigen::Index i = 0; i < a.linear_step.size(); ++i)
    if (apart(a.linear_step[i], b.linear_step[i])) return false;
  return std::equal(
      a.live.begin(), a.live.end(), b.live.begin(),
      [&](const FreedNumber& x, const FreedNumber& y) { return !apart(x.value, y.value); });
}

/// Computes everything where the machine stands; so do numbers that were begun elsewhere.
void stay(const Evidence& evidence, FittedMachine& m) {
  for (AddedEffect& a : m.added) take_values(a.numbers, m.machine);
  m.prediction = evidence.predict(m.machine);
  m.residual = evidence.residual(m.prediction);
  m.columns = columns_of(evidence, m.machine, m.prediction, m.numbers());
  m.held_out = Ground(evidence, m.residual, m.linear()).held_out;
}

bool is_axis(const std::string& place) { return axis_named(place) < kAxisCount; }

/// Declared numbers whose sensitivities are others than those of the declared machine: not those of
/// a drive at which nothing was found.
std::vector<std::size_t> concerned(const FittedMachine& m) {
  const std::set<std::string> places = places_found(m);
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < m.nuisances.numbers.size(); ++i) {
    const std::string place = place_of_key(m.nuisances.numbers[i].number.key);
    if (!is_axis(place) || places.contains(place)) all.push_back(i);
  }
  return all;
}

std::vector<std::size_t> every(const FittedMachine& m) {
  std::vector<std::size_t> all(m.nuisances.numbers.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

/// Takes the sensitivities of some declared numbers where the machine stands.
void linearise(const Evidence& evidence, FittedMachine& m, const std::vector<std::size_t>& which) {
  std::vector<FreedNumber> numbers;
  for (const std::size_t i : which) numbers.push_back(m.nuisances.numbers[i]);
  std::vector<Column> columns = columns_of(evidence, m.machine, m.prediction, numbers);
  m.nuisances.columns.resize(m.nuisances.numbers.size());
  for (std::size_t i = 0; i < which.size(); ++i)
    m.nuisances.columns[which[i]] = std::move(columns[i]);
}

/// Chi-square that no further look is worth: little, and little of what is more than noise; less
/// little where that is far more, since something is missing then that will ask for other numbers.
double settled(const Evidence& evidence, const FittedMachine& m) {
  constexpr double kLittle = 1e-4, kFarMore = 10;
  const double noise = evidence.count(Role::held_out), excess = std::max(0.0, m.held_out - noise);
  return 5 + kLittle * excess * std::clamp(excess / std::max(1.0, noise), 1.0, kFarMore);
}

/// Fits where the replica is exact: what is found there may be where it is not any more.
void converge_exactly(Evidence& evidence, FittedMachine& m, const NoUse& no_use = {}) {
  constexpr int kAnchors = 4, kInVain = 2;
  double least = misfit(evidence, m);
  int in_vain = 0;  // some go around in a circle
  for (int i = 0; i < kAnchors; ++i) {
    const double before = m.held_out;
    converge(evidence, m);
    const double there = misfit(evidence, m);
    anchor_at(evidence, m);
    const double here = misfit(evidence, m), little = settled(evidence, m);
    if (std::abs(there - here) < little) break;
    if (no_use.given_up(m.held_out, kAnchors * (before - m.held_out))) break;
    in_vain = here < least - little ? 0 : in_vain + 1;
    if (in_vain == kInVain) break;
    least = std::min(least, here);
  }
}

/// Where all numbers stand.
std::vector<double> stand(const FittedMachine& m) {
  std::vector<double> all;
  for (const FreedNumber& n : m.nuisances.numbers) all.push_back(n.value);
  for (const FreedNumber& n : m.numbers()) all.push_back(n.value);
  return all;
}

/// Takes sensitivities of `which` where the machine stands and fits, until that changes nothing, or
/// would, if gains go on to shrink as they do; `gain` is that of the fit before.
void fit_in_rounds(Evidence& evidence, FittedMachine& m, const std::vector<std::size_t>& which,
                   double gain = std::numeric_limits<double>::infinity(),
                   const NoUse& no_use = {}) {
  constexpr int kLinearisations = 8;
  for (int round = 0; round < kLinearisations; ++round) {
    const double before = m.held_out, off = misfit(evidence, m), last = gain;
    const std::vector<double> from = stand(m);
    linearise(evidence, m, which);
    converge_exactly(evidence, m, no_use);
    if (stand(m) == from) break;
    gain = std::max(before - m.held_out, off - misfit(evidence, m));
    const double next =
        last > 0 && std::isfinite(last) ? gain * std::sqrt(std::abs(gain) / last) : gain;
    if (std::min(gain, next) < settled(evidence, m)) break;
    if (no_use.given_up(m.held_out, kLinearisations * gain)) break;
  }
}

/// Tolerances from which on a declared number may stand for something that is missing.
constexpr double kPulledFar = 1.5;
/// The same, even where nothing else is left.
constexpr double kPulledOut = 3;

/// With declared numbers that were pulled back where they are declared, and what was added fitted
/// to that first: from where it stands beside pulled numbers, the way may be too far.
FittedMachine as_if_never_pulled(Evidence& evidence, FittedMachine m) {
  constexpr int kSecondGlance = 4;
  LinearPart others;
  for (std::size_t i = 0; i < m.nuisances.numbers.size(); ++i) {
    FreedNumber& n = m.nuisances.numbers[i];
    if (std::abs(n.pull()) > kPulledFar) {
      n.value = n.centre;
    } else {
      others.numbers.push_back(n);
      others.columns.push_back(m.nuisances.columns[i]);
    }
  }
  m.machine = with(m.machine, m.nuisances.numbers);
  evidence.anchor(m.machine);
  Refit alone = refit(evidence, m.machine, m.numbers(), others, {.max_iterations = kSecondGlance});
  alone.linear = between(others.numbers, alone.linear, 1.0);
  alone.machine = with(alone.machine, alone.linear);
  m = std::move(settled_from(evidence, m, {alone}).front());
  anchor_at(evidence, m);
  return m;
}

}  // namespace

std::vector<Explained> FittedMachine::explained() const {
  std::vector<Explained> all;
  for (const AddedEffect& a : added) all.push_back(a.explained);
  for (const ReleasedNumber& r : released) all.push_back(r.explained);
  return all;
}

std::vector<ActingSlices> FittedMachine::acting() const {
  std::vector<ActingSlices> all;
  for (const AddedEffect& a : added) all.push_back(a.acts);
  all.resize(found());
  return all;
}

std::set<std::string> places_found(const FittedMachine& m) {
  std::set<std::string> places;
  for (const FreedNumber& n : m.numbers()) places.insert(place_of_key(n.number.key));
  for (const ReleasedNumber& r : m.released) places.insert(place_of_key(r.key));
  return places;
}

std::string drive_of(const std::string& key, const std::vector<Candidate>& candidates) {
  const bool of_drive =
      key.starts_with("axes.") ||
      std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
        return is_of_drive(c) && std::any_of(c.numbers.begin(), c.numbers.end(),
                                             [&](const FreeNumber& n) { return n.key == key; });
      });
  return of_drive ? place_of_key(key) : "";
}

std::set<std::string> drives_found(const FittedMachine& m,
                                   const std::vector<Candidate>& candidates) {
  std::set<std::string> drives;
  for (const AddedEffect& a : m.added)
    if (is_of_drive(candidates[a.candidate])) drives.insert(candidates[a.candidate].place);
  for (const ReleasedNumber& r : m.released)
    if (const std::string drive = drive_of(r.key, candidates); !drive.empty()) drives.insert(drive);
  return drives;
}

std::vector<Column> FittedMachine::columns_of(std::size_t which) const {
  std::size_t first = 0;
  for (std::size_t i = 0; i < which; ++i) first += added[i].numbers.size();
  const std::size_t end = std::min(first + added[which].numbers.size(), columns.size());
  std::vector<Column> all;
  for (std::size_t c = first; c < end; ++c) all.push_back(columns[c]);
  return all;
}

std::vector<FreedNumber> FittedMachine::numbers() const {
  std::vector<FreedNumber> all;
  for (const AddedEffect& a : added) all.insert(all.end(), a.numbers.begin(), a.numbers.end());
  return all;
}

FittedMachine FittedMachine::without_effect(std::size_t i) const {
  FittedMachine less = *this;
  std::size_t first = 0;
  for (std::size_t j = 0; j < i; ++j) first += added[j].numbers.size();
  const auto from = less.columns.begin() + static_cast<std::ptrdiff_t>(first);
  less.columns.erase(from, from + static_cast<std::ptrdiff_t>(added[i].numbers.size()));
  less.added.erase(less.added.begin() + static_cast<std::ptrdiff_t>(i));
  return less;
}

FittedMachine FittedMachine::holding(const std::string& key, const FittedMachine& base) const {
  FittedMachine held = *this;
  std::erase_if(held.released, [&](const ReleasedNumber& r) { return r.key == key; });
  for (FreedNumber& n : held.nuisances.numbers)
    for (const FreedNumber& as : base.nuisances.numbers)
      if (n.number.key == key && as.number.key == key) n.tolerance = as.tolerance, n.held = true;
  return held;
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
  Column residual = evidence.residual(evidence.predict(m.machine));
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<FreedNumber> live = m.numbers();
    const std::vector<double> weight = weights(evidence, residual);
    const double least = misfit(evidence, residual, weight, m.nuisances.numbers);
    const auto promise = [&](double damping) {
      return refit(evidence, m.machine, live, without(m.nuisances, live),
                   {.max_iterations = 8, .weight = weight, .damping = damping});
    };
    // What undamped steps promise and do not keep, damped ones may, if they are others.
    const auto damped = [&](const Refit& undamped) {
      if (least - undamped.fitted < kMuch) return false;
      const Refit f = promise(kDamping);
      return !leads_the_same_way(f, undamped) && step_towards(evidence, m, f, weight, least);
    };
    const Refit undamped = promise(0);
    if (!step_towards(evidence, m, undamped, weight, least) && !damped(undamped)) {
      if (round == 0) stay(evidence, m);
      break;
    }
    residual = m.residual;
    const double now = m.held_out;
    if (std::abs(before - now) < 1 + 1e-4 * std::abs(now - evidence.count(Role::held_out))) break;
    before = now;
  }
}

void add_common(const Evidence& evidence, FittedMachine& m,
                const std::vector<FreedNumber>& common) {
  const std::set<std::string> places = places_found(m);
  for (const FreedNumber& n : common) {
    const std::string place = place_of_key(n.number.key);
    if (has_key(m.nuisances.numbers, n.number.key) || (is_axis(place) && !places.contains(place)))
      continue;
    m.nuisances.numbers.push_back(n);
    m.nuisances.columns.emplace_back(
        Column::Channels(evidence.replica().channels().size()));  // until it is linearised
  }
}

void hold_common(FittedMachine& m) {
  const std::set<std::string> places = places_found(m);
  std::vector<FreedNumber> held;
  for (FreedNumber n : m.nuisances.numbers) {
    const std::string place = place_of_key(n.number.key);
    if (!n.common() || places.contains(place) || (!is_axis(place) && !places.empty())) continue;
    n.value = n.centre;
    held.push_back(n);
  }
  m.machine = with(m.machine, held);
  m.nuisances = without(m.nuisances, held);
}

void anchor_at(Evidence& evidence, FittedMachine& m) {
  evidence.anchor(m.machine);
  m.prediction = evidence.predict(m.machine);
  m.residual = evidence.residual(m.prediction);
  m.held_out = Ground(evidence, m.residual, m.linear()).held_out;
}

FittedMachine fit_declared(Evidence& evidence, const Machine& declared, Against against) {
  return fit_numbers(evidence, declared, nuisances(declared, against));
}

FittedMachine fit_numbers(Evidence& evidence, const Machine& declared,
                          std::vector<FreedNumber> numbers) {
  constexpr double kShowsNothing = 0.03;  // standard deviations by a typical change
  FittedMachine m;
  m.machine = declared;
  m.nuisances.numbers = std::move(numbers);
  m.prediction = evidence.predict(declared);
  linearise(evidence, m, every(m));
  // What the run cannot show stays at its declaration.
  LinearPart shown;
  for (std::size_t i = 0; i < m.nuisances.numbers.size(); ++i) {
    const Column& column = m.nuisances.columns[i];
    if (column.zero() ||
        evidence.chi2(column, Role::fitted) + evidence.chi2(column, Role::held_out) <
            kShowsNothing * kShowsNothing)
      continue;
    shown.numbers.push_back(m.nuisances.numbers[i]);
    shown.columns.push_back(std::move(m.nuisances.columns[i]));
  }
  m.nuisances = std::move(shown);
  converge(evidence, m);
  anchor_at(evidence, m);
  const double before = m.held_out;
  converge_exactly(evidence, m);
  fit_in_rounds(evidence, m, every(m), before - m.held_out);
  return m;
}

void converge_anew(const Evidence& evidence, FittedMachine& m) {
  stay(evidence, m);
  linearise(evidence, m, every(m));
  converge(evidence, m);
}

FittedMachine within_tolerance(Evidence& evidence, FittedMachine m, double tolerances,
                               const std::function<bool(const FreedNumber&)>& may_be_out_of_one) {
  constexpr int kOneAfterTheOther = 3;
  for (int round = 0; round < kOneAfterTheOther; ++round) {
    bool any = false;
    for (FreedNumber& n : m.nuisances.numbers) {
      if (n.held || std::abs(n.pull()) <= tolerances || !may_be_out_of_one(n)) continue;
      n.held = any = true;
      n.value = n.centre;
    }
    if (!any) break;
    m.machine = with(m.machine, m.nuisances.numbers);
    evidence.anchor(m.machine);
    stay(evidence, m);
    converge_exactly(evidence, m);
  }
  return m;
}

void settle_at(Evidence& evidence, FittedMachine& m) {
  m.machine = with(with(m.machine, m.numbers()), m.nuisances.numbers);
  anchor_at(evidence, m);
  m.columns = columns_of(evidence, m.machine, m.prediction, m.numbers());
  m.held_out = Ground(evidence, m.residual, m.linear()).held_out;
  converge_exactly(evidence, m);
}

void settle_in(Evidence& evidence, FittedMachine& m, const NoUse& no_use) {
  constexpr double kNoGainYet = std::numeric_limits<double>::infinity();
  anchor_at(evidence, m);
  fit_in_rounds(evidence, m, concerned(m), kNoGainYet, no_use);
  double pulled = 0;
  for (const FreedNumber& n : m.nuisances.numbers) pulled = std::max(pulled, std::abs(n.pull()));
  const bool stands_in = pulled > kPulledOut,
             may_gain = pulled > kPulledFar && m.held_out > no_use.little;
  if ((stands_in || may_gain) && m.held_out < no_use.much) {
    FittedMachine anew = as_if_never_pulled(evidence, m);
    fit_in_rounds(evidence, anew, every(anew), kNoGainYet, no_use);
    if (misfit(evidence, anew) < misfit(evidence, m))
      m = std::move(anew);
    else
      evidence.anchor(m.machine);
  }
}

}  // namespace vcnc
