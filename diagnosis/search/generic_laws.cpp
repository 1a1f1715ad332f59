#include "diagnosis/search/generic_laws.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <numeric>
#include <utility>

#include "diagnosis/search/law_columns.hpp"
#include "diagnosis/search/law_knots.hpp"
#include "diagnosis/search/parallel.hpp"
#include "diagnosis/search/screening.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kRefined = 6, kSimulated = 3;  // of the best laws by their columns
constexpr double kWorthAKnot = 0.02;                 // of what is left
constexpr int kRounds = 4;
constexpr std::size_t kAlternations = 4;
constexpr double kNudge = 0.02, kWorthARound = 0.99;
/// Part of what a true effect does that its model may be wrong by, see takes_names_away().
constexpr double kWrongAboutOne = 0.05;
/// Part of what the least of many names does that a law need not do.
constexpr double kOfTheLeast = 0.1;

using Series = std::vector<double>;

struct LinearLaw {
  double gain = 0;
  Eigen::VectorXd value, sigma;
};

/// `across`: products of [residual, linear numbers] with a law's columns; `among`: of these.
LinearLaw fit(const Ground& ground, const RoleGrams& across, const RoleGrams& among) {
  const Eigen::Index n = ground.precision.size(), k = among.fitted.rows();
  Eigen::VectorXd precision = Eigen::VectorXd::Zero(n + k), offset = Eigen::VectorXd::Zero(n + k);
  precision.head(n) = ground.precision;
  offset.head(n) = ground.offset;
  precision.tail(k).setConstant(1e-4 * among.fitted.diagonal().mean());
  const RoleGrams all =
      bordered({ground.grams.fitted, ground.grams.held_out, {}, {}}, across, among);
  const LinearStep s = linear_step(all.fitted, all.held_out, precision, offset);
  Eigen::MatrixXd a = all.fitted.bottomRightCorner(n + k, n + k);
  a.diagonal() += precision;
  LinearLaw law;
  law.value = s.step.tail(k);
  law.sigma = a.inverse().diagonal().tail(k).cwiseMax(0).cwiseSqrt();
  // The ridge is no evidence: it is taken off what the priors of the step add up to.
  const double ridge = precision[n] * law.value.squaredNorm();
  law.gain = ground.held_out - (s.held_out - ridge);
  return law;
}

LinearLaw fit(const Evidence& evidence, const Ground& ground, const std::vector<Column>& columns) {
  std::vector<const Column*> own;
  for (const Column& c : columns) own.push_back(&c);
  return fit(ground, evidence.cross(ground.columns, own), evidence.cross(own, own));
}

/// What a law would gain with narrower hats besides its own; columns and products are computed
/// once.
class GainWithHats {
 public:
  GainWithHats(const Evidence& evidence, const Ground& ground, const LawColumns& columns,
               const Law& law)
      : evidence_(evidence), ground_(ground), of_(columns), law_(law) {
    take(of_.columns(law));
  }

  double operator()(const std::vector<Hat>& hats) {
    std::vector<Eigen::Index> chosen(law_.at.size());
    std::iota(chosen.begin(), chosen.end(), 0);
    learn(hats);
    for (const Hat& h : hats)
      chosen.push_back(static_cast<Eigen::Index>(law_.at.size()) +
                       (std::find(hats_.begin(), hats_.end(), h) - hats_.begin()));
    const auto some = [&](const RoleGrams& of, const auto& rows) {
      return RoleGrams{of.fitted(rows, chosen), of.held_out(rows, chosen), {}, {}};
    };
    std::vector<Eigen::Index> all(static_cast<std::size_t>(across_.fitted.rows()));
    std::iota(all.begin(), all.end(), 0);
    return fit(ground_, some(across_, all), some(among_, chosen)).gain;
  }

 private:
  /// Hats that were not asked for before.
  void learn(const std::vector<Hat>& hats) {
    std::vector<Law> fresh;
    for (const Hat& h : hats) {
      if (std::find(hats_.begin(), hats_.end(), h) != hats_.end()) continue;
      hats_.push_back(h);
      fresh.push_back(law_);
      fresh.back().at = {h.low, h.at, h.high};
      fresh.back().value = {0, 1, 0};
    }
    std::vector<Column> columns(fresh.size());
    parallel_for(fresh.size(), [&](std::size_t i) { columns[i] = of_.column(fresh[i]); });
    if (!columns.empty()) take(std::move(columns));
  }

  void take(std::vector<Column> fresh) {
    std::vector<const Column*> known, own;
    for (const Column& c : columns_) known.push_back(&c);
    for (Column& c : fresh) columns_.push_back(std::move(c));
    for (std::size_t i = known.size(); i < columns_.size(); ++i) own.push_back(&columns_[i]);
    const RoleGrams across = evidence_.cross(ground_.columns, own),
                    among = evidence_.cross(own, own);
    if (known.empty()) {
      across_ = across;
      among_ = among;
      return;
    }
    among_ = bordered(among_, evidence_.cross(known, own), among);
    across_ = beside(across_, across);
  }

  const Evidence& evidence_;
  const Ground& ground_;
  const LawColumns& of_;
  Law law_;
  std::vector<Hat> hats_;
  std::deque<Column> columns_;  // of the law's own knots, then of the hats
  RoleGrams across_, among_;
};

/// A machine by hypothesis and what it leaves of chi-square on the fitted laps.
struct Settled {
  Machine machine;
  double fitted = 0;
};

/// A machine with the numbers that go along with its law moved, where that is for the better: a law
/// of the position and a constant may be large and cancel.
Settled settle(const Evidence& evidence, const Machine& machine, const Ground& at,
               const LinearPart& linear) {
  const LinearStep s = linear_step(at.grams.fitted, at.grams.held_out, at.precision, at.offset);
  std::vector<FreedNumber> numbers = linear.numbers;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i].value += s.step[static_cast<Eigen::Index>(i)] * numbers[i].number.typical;
  Machine moved = with(machine, numbers);
  const double before = at.grams.fitted(0, 0),
               after = evidence.chi2(evidence.residual(evidence.predict(moved)), Role::fitted);
  return after < before ? Settled{std::move(moved), after} : Settled{machine, before};
}

/// A law where it acts, in the loop.
struct Acting {
  Law law;
  Machine machine;
  Prediction prediction;
  Column residual;
  Ground ground;
  Settled settled;

  Acting(const Evidence& evidence, const Machine& without, Law own, const LinearPart& linear)
      : law(std::move(own)),
        machine(with(without, law)),
        prediction(evidence.predict(machine)),
        residual(evidence.residual(prediction)),
        ground(evidence, residual, linear),
        settled(settle(evidence, machine, ground, linear)) {}

  Acting(const Acting&) = delete;  // the ground refers to the residual

  static Machine with(Machine machine, const Law& law) {
    machine.effects.laws.push_back(law);
    return machine;
  }
};

/// Fits the values of a law again where it acts: the first ones come from the loop without it, and
/// friction is not linear. Returns their standard deviations.
Eigen::VectorXd refine(const Evidence& evidence, const Machine& without, const LinearPart& linear,
                       std::unique_ptr<Acting>& best) {
  LinearLaw fitted;
  for (int round = 0; round < kRounds; ++round) {
    const Acting& acting = *best;
    double largest = 0;
    for (const double v : acting.law.value) largest = std::max(largest, std::abs(v));
    const double step = kNudge * largest;
    std::vector<Machine> nudged;
    for (std::size_t h = 0; h < acting.law.value.size(); ++h) {
      nudged.push_back(acting.machine);
      nudged.back().effects.laws.back().value[h] += step;
    }
    const std::vector<Prediction> predictions = evidence.predict_all(nudged);
    std::vector<Column> columns(nudged.size());
    parallel_for(nudged.size(), [&](std::size_t h) {
      columns[h] = evidence.sensitivity(acting.prediction, predictions[h], step);
    });
    fitted = fit(evidence, acting.ground, columns);
    bool better = false;
    for (const double share : {1.0, 0.3}) {
      Law law = acting.law;
      for (std::size_t h = 0; h < law.value.size(); ++h)
        law.value[h] += share * fitted.value[static_cast<Eigen::Index>(h)];
      auto next = std::make_unique<Acting>(evidence, without, law, linear);
      if (!(next->settled.fitted < acting.settled.fitted)) continue;
      better = next->settled.fitted < kWorthARound * acting.settled.fitted;
      best = std::move(next);
      break;
    }
    if (!better) break;
  }
  return fitted.sigma;
}

}  // namespace

FittedMachine learned(const Evidence& evidence, const FittedMachine& at, const Machine& machine) {
  FittedMachine now = at;
  now.machine = machine;
  for (AddedEffect& a : now.added)
    for (FreedNumber& n : a.numbers) n.value = number_of(machine, n.number.key);
  for (FreedNumber& n : now.nuisances.numbers) n.value = number_of(machine, n.number.key);
  converge_anew(evidence, now);
  return now;
}

bool takes_names_away(double alone, const Named& named, double needed) {
  if (named.count <= 1) return alone > named.gain + needed + kWrongAboutOne * named.gain;
  return alone > named.gain - (named.count >= kImitation ? kOfTheLeast * named.least : 0);
}

std::string words_of(const Law& law) {
  constexpr const char* points[] = {"command", "command time", "motor force",
                                    "force",   "displacement", "reading"};
  constexpr const char* letters[] = {"t", "q", "v", "a", "sgn v"};
  const auto named = [&](Covariate c, Law::OfAxis axis) -> std::string {
    if (c == Covariate::time) return "t";
    return fmt::format("{}_{}", letters[static_cast<int>(c)],
                       kAxisNames[static_cast<std::size_t>(axis)]);
  };
  std::string factor;
  if (law.times == Covariate::sign)
    factor = fmt::format("sgn(v_{}) ", kAxisNames[static_cast<std::size_t>(law.times_axis)]);
  else if (law.times != Covariate::time)
    factor = named(law.times, law.times_axis) + " ";
  if (law.jumps())
    return fmt::format("{} on {} that jumps at {:.2f} s of the run",
                       points[static_cast<int>(law.point)], kAxisNames[law.axis_index()],
                       law.at.back());
  return fmt::format("{} on {} as {}f({})", points[static_cast<int>(law.point)],
                     kAxisNames[law.axis_index()], factor, named(law.over, law.over_axis));
}

LawFit best_law(const Evidence& evidence, const FittedMachine& at, const Doubt& doubt,
                const DiagnosisOptions& options) {
  const LawColumns laws(evidence, at);
  const LinearPart linear = at.linear();
  const Ground ground(evidence, at.residual, linear);
  const auto fitted = [&](const Law& law) { return fit(evidence, ground, laws.columns(law)); };
  std::vector<Law> all = laws.all();
  for (Law& jump : laws.jumps([&](const Law& law) { return fitted(law).gain; }))
    all.push_back(std::move(jump));
  std::vector<LinearLaw> fits(all.size());
  parallel_for(all.size(), [&](std::size_t i) { fits[i] = fitted(all[i]); });

  LawFit best;
  best.machine = at.machine;
  const double excess = std::max(1.0, ground.held_out - evidence.count(Role::held_out));
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), 0);
  const auto by_gain = [&](std::size_t x, std::size_t y) { return fits[x].gain > fits[y].gain; };
  std::stable_sort(order.begin(), order.end(), by_gain);
  for (std::size_t rank = 0; rank < std::min(kRefined, order.size()); ++rank) {
    Law& law = all[order[rank]];
    LinearLaw& f = fits[order[rank]];
    // Over time a law is slow, or jumps: what is another in one lap is none.
    if (f.gain < options.law_gain || law.over == Covariate::time) continue;
    GainWithHats gain(evidence, ground, laws, law);
    const double worth = std::max(options.law_gain, kWorthAKnot * (excess - f.gain));
    law.at = with_more_knots(law.at, std::ref(gain), worth);
    f = fitted(law);
  }
  std::stable_sort(order.begin(), order.end(), by_gain);
  // The columns are a linearisation; the first few are asked what they do in the loop.
  const auto counted_of = [&](const Acting& law) {
    return counted(ground.held_out - law.ground.held_out, ground.held_out_of,
                   law.ground.held_out_of, doubt);
  };
  std::unique_ptr<Acting> acting;
  for (std::size_t rank = 0; rank < std::min(kSimulated, order.size()); ++rank) {
    const LinearLaw& f = fits[order[rank]];
    if (f.gain < options.law_gain) break;
    Law law = all[order[rank]];
    law.value.assign(f.value.data(), f.value.data() + f.value.size());
    auto now = std::make_unique<Acting>(evidence, at.machine, law, linear);
    if (const double gain = counted_of(*now); gain > best.gain) {
      best.gain = gain;
      acting = std::move(now);
    }
  }
  if (!acting) return best;
  Eigen::VectorXd sigma = refine(evidence, at.machine, linear, acting);
  // For want of the law declared numbers may have been pulled, and their columns lack it: they are
  // fitted with it, then the law where they stand.
  FittedMachine without = at;
  std::vector<LinearPart> parts;  // `acting` refers to them
  parts.reserve(kAlternations);
  for (std::size_t i = 0; i < kAlternations; ++i) {
    FittedMachine moved = without;
    moved.machine = Acting::with(moved.machine, acting->law);
    converge_anew(evidence, moved);
    moved.machine.effects.laws.pop_back();
    parts.push_back(moved.linear());
    auto again = std::make_unique<Acting>(evidence, moved.machine, acting->law, parts.back());
    Eigen::VectorXd anew = refine(evidence, moved.machine, parts.back(), again);
    const double before = acting->settled.fitted, now = again->settled.fitted;
    if (!(now < before)) break;
    acting = std::move(again);
    sigma = std::move(anew);
    without = std::move(moved);
    if (now > kWorthARound * before) break;
  }
  LearnedLaw& told = best.laws.emplace_back();
  Law& law = told.law = acting->law;
  law.label = "learned: " + words_of(law);
  for (std::size_t h = 0; h < law.value.size(); ++h) {
    const double band = 1.96 * sigma[static_cast<Eigen::Index>(h)];
    told.low.push_back(law.value[h] - band);
    told.high.push_back(law.value[h] + band);
  }
  best.gain = counted_of(*acting);
  told.words = words_of(law);
  told.share = std::min(1.0, best.gain / excess);
  // What that leaves is told in the loop: numbers moved along their columns may disappoint there.
  FittedMachine moved = without;
  moved.machine = acting->machine;
  converge(evidence, moved);
  best.machine = evidence.chi2(moved.residual, Role::fitted) < acting->settled.fitted
                     ? moved.machine
                     : acting->settled.machine;
  best.machine.effects.laws.back() = law;  // with its label
  if (evidence.chi2(evidence.residual(evidence.predict(best.machine)), Role::held_out) >=
      evidence.chi2(at.residual, Role::held_out)) {
    LawFit none;
    none.machine = at.machine;
    return none;
  }
  const double band = options.class_gain + options.class_share * excess;
  for (const std::size_t i : order)
    if (fits[i].gain > fits[order.front()].gain - band && words_of(all[i]) != words_of(told.law) &&
        told.not_distinguishable_from.size() < 5)
      told.not_distinguishable_from.push_back(words_of(all[i]));
  return best;
}

}  // namespace vcnc
