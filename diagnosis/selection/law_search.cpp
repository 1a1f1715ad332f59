#include "diagnosis/selection/law_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "diagnosis/fit/counted_gain.hpp"
#include "diagnosis/verdict.hpp"

namespace vcnc {
namespace {

/// Part of all that there was that many names may leave and be believed.
constexpr double kImitated = 0.02;
/// Part of all that there was that laws may leave without a further one, what of it that must take,
/// and how many there are at most.
constexpr double kLeftByLaws = 0.1, kMostOfIt = 0.5;
constexpr std::size_t kMostLaws = 3;
/// Part of all that there was that a law beside names must take: less, and it is what their models
/// are wrong by.
constexpr double kOfAll = 0.005;

std::string all_names(const FittedMachine& found, const std::vector<Candidate>& candidates) {
  std::string names;
  for (const AddedEffect& a : found.added)
    names += (names.empty() ? "" : " with ") + candidates[a.candidate].name();
  for (const ReleasedNumber& r : found.released) names += (names.empty() ? "" : " with ") + r.key;
  return names;
}

class LawSearch {
 public:
  LawSearch(const Evidence& evidence, const SelectionResult& selection,
            const std::vector<Candidate>& candidates, const DiagnosisOptions& options,
            bool still_off)
      : evidence_(evidence),
        selection_(selection),
        candidates_(candidates),
        options_(options),
        still_off_(still_off) {}

  UnnamedLaws run() {
    const double left = excess(found().held_out);
    const bool quiet = !still_off_ && left < options_.law_gain + kFloorScatter * selection_.floor;
    if (quiet && found().added.empty()) return {};
    LawFit law;
    if (!quiet) law = best_law(evidence_, found(), beside_, options_);
    const double needed = needed_of(left);
    UnnamedLaws told;
    if (std::optional<LawFit> instead = in_their_place(left, law.gain, needed, told.note)) {
      told.instead = true;
      law = std::move(*instead);
    }
    if (law.gain < needed || (quiet && !told.instead)) return {};
    const bool beside_names = found().found() > 0 && !told.instead;
    if (beside_names && law.gain < kOfAll * excess(selection_.base.held_out)) return {};
    add_further(law, told.instead);
    told.laws = std::move(law.laws);
    told.machine = std::move(law.machine);
    return told;
  }

 private:
  const FittedMachine& found() const { return selection_.found; }
  double excess(double held_out) const { return std::max(0.0, held_out - selection_.floor); }

  /// What a law must gain of what is left.
  double needed_of(double left) const {
    return std::max({options_.law_gain, options_.least_share * left,
                     options_.share_of_form * std::min(left, options_.form)});
  }

  /// What leaves more than a model of the true cause may is believed no further than it explains.
  Doubt doubt_beside() const {
    if (found().found() == 0 || still_off_) return doubt_of(options_, found().rounding);
    return doubt_of(options_, found().explained(), base_of_, left_of_, found().rounding);
  }

  /// The law that takes the names away, if it does; `beside`: what one beside them gains.
  std::optional<LawFit> in_their_place(double left, double beside, double needed,
                                       std::string& note) const {
    if (found().found() == 0) return std::nullopt;
    Named named{selection_.base.held_out - found().held_out, found().added.size(),
                std::numeric_limits<double>::infinity()};
    if (named.count > 1) named.gain = counted(named.gain, base_of_, left_of_, alone_);
    for (const AddedEffect& a : found().added) named.least = std::min(named.least, a.gain);
    const bool too_many = found().found() > options_.few_effects &&
                          left > (kQuiet - 1) * selection_.floor &&
                          left > kImitated * excess(selection_.base.held_out);
    // It can explain all that there is at most.
    if (!too_many && !takes_names_away(named.gain + left, named, needed)) return std::nullopt;
    const double least = too_many ? needed : to_take_away(named, needed);
    LawFit law = selection_.law_alone
                     ? *selection_.law_alone
                     : best_law(evidence_, selection_.base, alone_, options_, least);
    const Names names = judged(law.gain, beside, named, needed, too_many);
    if (names == Names::stay) return std::nullopt;
    note = names == Names::replaced
               ? fmt::format("It looks like {}, but {} alone {}.", all_names(found(), candidates_),
                             words_of(law.laws.front().law),
                             law.gain > named.gain ? "fits better" : "does the same")
               : fmt::format(
                     "It looks like {}; so many changes at once that leave so much "
                     "imitate another one.",
                     all_names(found(), candidates_));
    return law;
  }

  void add_further(LawFit& law, bool instead) const {
    const FittedMachine& without = instead ? selection_.base : found();
    while (law.laws.size() < kMostLaws) {
      FittedMachine at = learned(evidence_, without, law.machine);
      const double left = excess(at.held_out);
      if (left < kLeftByLaws * excess(selection_.base.held_out)) return;
      LawFit next = best_law(evidence_, at, instead ? alone_ : beside_, options_);
      if (next.gain < std::max(needed_of(left), kMostOfIt * left)) return;
      law.laws.push_back(std::move(next.laws.front()));
      law.machine = std::move(next.machine);
      law.gain += next.gain;
    }
  }

  const Evidence& evidence_;
  const SelectionResult& selection_;
  const std::vector<Candidate>& candidates_;
  const DiagnosisOptions& options_;
  bool still_off_;
  std::vector<double> base_of_ = evidence_.chi2_of(selection_.base.residual, Role::held_out),
                      left_of_ = evidence_.chi2_of(found().residual, Role::held_out);
  Doubt beside_ = doubt_beside(), alone_ = doubt_of(options_, selection_.base.rounding);
};

}  // namespace

Names judged(double alone, double beside, const Named& named, double needed, bool too_many) {
  if (alone > 0.5 * (named.gain + std::max(0.0, beside)) && takes_names_away(alone, named, needed))
    return Names::replaced;
  return too_many && alone >= needed ? Names::imitate : Names::stay;
}

UnnamedLaws search_laws(const Evidence& evidence, const SelectionResult& selection,
                        const std::vector<Candidate>& candidates, const DiagnosisOptions& options,
                        bool still_off) {
  if (!options.suspects.empty()) return {};
  return LawSearch(evidence, selection, candidates, options, still_off).run();
}

}  // namespace vcnc
