#include "diagnosis/laws/generic_laws.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <utility>

#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/laws/law_columns.hpp"
#include "diagnosis/laws/law_fit.hpp"
#include "diagnosis/laws/law_in_loop.hpp"
#include "diagnosis/laws/law_knots.hpp"
#include "diagnosis/laws/law_places.hpp"
#include "diagnosis/parallel.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Of the best laws by their columns: those that may get more knots, and that are simulated. Of
/// these, what may gain most when it is fitted again: a jump as well as what is smeared over it.
constexpr std::size_t kDrawnFiner = 3, kSimulated = 3, kRefined = 2;
constexpr double kNearlyBest = 0.85;
constexpr double kWorthAKnot = 0.02;  ///< of what is left
/// Times what few knots promise, that more may; what columns do, that the loop may show; and part
/// of what the best one promises with few that another one must.
constexpr double kMoreByKnots = 3, kMoreInTheLoop = 1.5, kComparable = 0.5;
/// Part of what a true effect does that its model may be wrong by, see takes_names_away().
constexpr double kWrongAboutOne = 0.05;
/// Part of what the least of many names does that a law need not do.
constexpr double kOfTheLeast = 0.1;
constexpr double kOneWay = 0.9;         ///< what a gain weighs of a law that acts one way only
constexpr double kContradicted = 0.05;  ///< of a gain, that a law may lose elsewhere
constexpr std::size_t kMostAlike = 5;   ///< that are named

/// Laws by their columns, the best ones first.
struct Ranked {
  std::vector<Law> laws;
  std::vector<LinearLaw> fits;
  std::vector<std::size_t> order;

  void sort() {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t x, std::size_t y) { return fits[x].gain > fits[y].gain; });
  }
  /// With its values.
  Law at_rank(std::size_t rank) const {
    Law law = laws[order[rank]];
    const Eigen::VectorXd& value = fits[order[rank]].value;
    law.value.assign(value.data(), value.data() + value.size());
    return law;
  }
};

/// `left`: of the residual; `worth`: gain that a knot must have; laws that promise less than
/// `least` get none.
Ranked ranked(const Evidence& evidence, const LawColumns& columns, const Ground& ground,
              const Column& left, double excess, double worth, double least) {
  const auto fitted = [&](const Law& law) {
    return fit_law(evidence, ground, columns.columns(law));
  };
  Ranked all{columns.all(), {}, {}};
  for (Law& place : laws_of_places(evidence, columns, left)) all.laws.push_back(std::move(place));
  for (Law& jump : columns.jumps([&](const Law& law) { return fitted(law).gain; }))
    all.laws.push_back(std::move(jump));
  all.fits.resize(all.laws.size());
  parallel_for(all.laws.size(), [&](std::size_t i) { all.fits[i] = fitted(all.laws[i]); });
  all.order.resize(all.laws.size());
  std::iota(all.order.begin(), all.order.end(), 0);
  all.sort();
  if (!all.order.empty()) least = std::max(least, kComparable * all.fits[all.order.front()].gain);
  for (std::size_t rank = 0; rank < std::min(kDrawnFiner, all.order.size()); ++rank) {
    Law& law = all.laws[all.order[rank]];
    LinearLaw& f = all.fits[all.order[rank]];
    // Over time a law is slow, or jumps: what is another in one lap is none.
    if (f.gain < least || law.over == Covariate::time) continue;
    GainWithHats gain(evidence, ground, columns, law);
    law.at =
        with_more_knots(law.at, std::ref(gain), std::max(worth, kWorthAKnot * (excess - f.gain)));
    f = fitted(law);
  }
  all.sort();
  return all;
}

/// A law that nothing resists the other way must do clearly better than one of both.
bool acts_one_way(const Law& law) {
  return law.times == Covariate::forwards || law.times == Covariate::backwards;
}

/// Those that do as well by their columns.
std::vector<std::string> alike(const Ranked& all, const std::string& told, double band) {
  std::vector<std::string> words;
  for (const std::size_t i : all.order)
    if (all.fits[i].gain > all.fits[all.order.front()].gain - band &&
        words_of(all.laws[i]) != told && words.size() < kMostAlike)
      words.push_back(words_of(all.laws[i]));
  return words;
}

}  // namespace

bool contradicted(const std::vector<double>& before, const std::vector<double>& after) {
  double gained = 0, lost = 0;
  for (std::size_t c = 0; c < before.size(); ++c)
    (after[c] < before[c] ? gained : lost) += std::abs(before[c] - after[c]);
  return lost > kContradicted * gained;
}

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
  return alone > to_take_away(named, needed);
}

double to_take_away(const Named& named, double needed) {
  if (named.count <= 1) return named.gain + needed + kWrongAboutOne * named.gain;
  return named.gain - (named.count >= kImitation ? kOfTheLeast * named.least : 0);
}

std::string words_of(const Law& law) {
  constexpr const char* points[] = {"command", "command time", "motor force",
                                    "force",   "displacement", "reading"};
  constexpr const char* letters[] = {"t", "q", "v", "a"};
  const auto named = [&](Covariate c, Law::OfAxis axis) -> std::string {
    if (c == Covariate::time) return "t";
    return fmt::format("{}_{}", letters[static_cast<int>(c)],
                       kAxisNames[static_cast<std::size_t>(axis)]);
  };
  std::string factor, way;
  if (law.times == Covariate::sign)
    factor = fmt::format("sgn(v_{}) ", kAxisNames[static_cast<std::size_t>(law.times_axis)]);
  else if (law.grows())
    factor = named(law.times, law.times_axis) + " ";
  else if (law.times != Covariate::time)
    way = fmt::format(
        " {}going {}",
        law.times_axis == law.axis
            ? ""
            : fmt::format("with {} ", kAxisNames[static_cast<std::size_t>(law.times_axis)]),
        law.times == Covariate::forwards ? "forwards" : "backwards");
  if (law.jumps())
    return fmt::format("{} on {} that jumps at {:.2f} s of the run",
                       points[static_cast<int>(law.point)], kAxisNames[law.axis_index()],
                       law.at.back());
  return fmt::format("{} on {}{} as {}f({})", points[static_cast<int>(law.point)],
                     kAxisNames[law.axis_index()], way, factor, named(law.over, law.over_axis));
}

LawFit best_law(const Evidence& evidence, const FittedMachine& at, const Doubt& doubt,
                const DiagnosisOptions& options, double least) {
  LawFit none;
  none.machine = at.machine;
  const LawColumns columns(evidence, at);
  const auto linear = std::make_shared<const LinearPart>(at.linear());
  const Ground ground(evidence, at.residual, *linear);
  const double excess = std::max(1.0, ground.held_out - evidence.count(Role::held_out));
  const Column left = less(at.residual, linear->columns, ground.step);
  const Ranked all = ranked(evidence, columns, ground, left, excess, options.law_gain,
                            std::max(options.law_gain, least / kMoreByKnots));
  if (all.fits.empty() || kMoreInTheLoop * all.fits[all.order.front()].gain < least) return none;
  const auto counted_of = [&](const LawInLoop& law) {
    if (contradicted(ground.held_out_of, law.ground().held_out_of)) return 0.0;
    return counted(ground.held_out - law.ground().held_out, ground.held_out_of,
                   law.ground().held_out_of, doubt);
  };
  const auto weight_of = [&](const LawInLoop& law) {
    return (acts_one_way(law.law()) ? kOneWay : 1) * counted_of(law);
  };
  // The columns are a linearisation; the first few are asked what they do in the loop.
  std::vector<LawInLoop> simulated;
  for (std::size_t rank = 0; rank < std::min(kSimulated, all.order.size()); ++rank)
    if (all.fits[all.order[rank]].gain >= options.law_gain)
      simulated.emplace_back(evidence, at, all.at_rank(rank), linear);
  std::stable_sort(simulated.begin(), simulated.end(),
                   [&](const auto& x, const auto& y) { return weight_of(x) > weight_of(y); });
  const LawInLoop* best = nullptr;
  const double most = simulated.empty() ? 0 : weight_of(simulated.front());
  for (std::size_t i = 0; i < std::min(kRefined, simulated.size()); ++i) {
    LawInLoop& law = simulated[i];
    if (!(weight_of(law) > 0) || weight_of(law) < kNearlyBest * most) break;
    law.refine();
    if (!best || weight_of(law) > weight_of(*best)) best = &law;
  }
  if (!best) return none;

  LawFit fit;
  LearnedLaw& told = fit.laws.emplace_back();
  told.law = best->law();
  told.words = words_of(told.law);
  told.law.label = "learned: " + told.words;
  const Eigen::VectorXd deviations = best->deviations();
  for (std::size_t h = 0; h < told.law.value.size(); ++h) {
    const double band = kNormal95 * deviations[static_cast<Eigen::Index>(h)];
    told.low.push_back(told.law.value[h] - band);
    told.high.push_back(told.law.value[h] + band);
  }
  fit.gain = counted_of(*best);
  told.share = std::min(1.0, fit.gain / excess);
  told.not_distinguishable_from =
      alike(all, told.words, options.class_gain + options.class_share * excess);
  fit.machine = best->machine();
  fit.machine.effects.laws.back() = told.law;  // with its label
  const bool worse = evidence.chi2(evidence.residual(evidence.predict(fit.machine)),
                                   Role::held_out) >= evidence.chi2(at.residual, Role::held_out);
  return worse ? none : fit;
}

}  // namespace vcnc
