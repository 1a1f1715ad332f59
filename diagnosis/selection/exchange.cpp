#include "diagnosis/selection/exchange.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "diagnosis/selection/contest.hpp"
#include "diagnosis/selection/intricacy.hpp"

namespace vcnc {
namespace {

constexpr double kMoreUsual = 0.2;  ///< numbers: a declared one by 50 tolerances
/// Part of what two effects make together that the smaller one must make, to be one of two.
constexpr double kOneOfTwo = 0.01;

const FreedNumber& number_of_key(const FittedMachine& m, const std::string& key) {
  return *std::find_if(m.nuisances.numbers.begin(), m.nuisances.numbers.end(),
                       [&](const FreedNumber& n) { return n.number.key == key; });
}

/// Whether a declared number does as well as an effect that gains `gain`, and says less.
bool says_it_simpler(const Appraisal& appraisal, const Contender& rival, const AddedEffect& effect,
                     double gain) {
  const std::vector<Candidate>& candidates = appraisal.rules().candidates;
  if (rival.released.empty() || rival.gain < gain - appraisal.band_of(gain)) return false;
  return intricacy(candidates, rival) + (gain - rival.gain) / appraisal.band_of(gain) <
         intricacy(candidates, effect);
}

/// Whether an effect of a usual size does as well as a declared number, which gains `gain`, and
/// that is as far off as hardly any is.
bool is_more_usual(const Appraisal& appraisal, const Contender& rival, const FreedNumber& number,
                   double gain) {
  const double band = appraisal.band_of(gain), less = gain - rival.gain;
  return rival.released.empty() && less < band &&
         intricacy(appraisal.rules().candidates, rival) + std::max(0.0, less) / band <
             intricacy(number) - kMoreUsual;
}

}  // namespace

bool Exchange::exchange(FittedMachine& m) const {
  const std::size_t most = m.found() + 1;
  std::size_t exchanges = 0;
  std::optional<FittedMachine> within;
  for (std::size_t i = 0; i < m.found();)
    if (gives_way(m, i, exchanges < most, within)) {
      within.reset();
      ++exchanges;
      i = 0;
    } else {
      evidence_.anchor(m.machine);
      ++i;
    }
  return exchanges > 0;
}

bool Exchange::gives_way(FittedMachine& m, std::size_t i, bool may_give_way,
                         std::optional<FittedMachine>& within) const {
  AddedEffect* effect = i < m.added.size() ? &m.added[i] : nullptr;
  ReleasedNumber* number = effect ? nullptr : &m.released[i - m.added.size()];
  FittedMachine less = effect ? changes_.taken_out(m, i, MachineChanges::Common::free)
                              : m.holding(number->key, base_);
  const Contest contest(rules_, less);
  const Appraisal& appraisal = contest.appraisal();
  const double lost = appraisal.held_out() - m.held_out;
  if (effect) effect->needless = appraisal.needless_among(effect->numbers, m.columns_of(i), lost);
  std::vector<Contender> rivals =
      contest.rivals(kNearLoss * lost, effect ? effect->candidate : rules_.candidates.size());
  if (number) std::erase_if(rivals, [&](const Contender& r) { return r.released == number->key; });
  std::vector<std::size_t>& alike = effect ? effect->class_with : number->class_with;
  alike.clear();
  for (const Contender& r : rivals)
    if (r.released.empty() && r.gain > std::max(lost - appraisal.band_of(lost), 0.5 * lost))
      alike.push_back(r.candidate);
  if (!may_give_way) return false;
  const double worth =
      appraisal.counts(m) - 4 * static_cast<double>(effect ? effect->numbers.size() : 1);
  const auto simpler = [&](const Contender& r) {
    return effect ? says_it_simpler(appraisal, r, *effect, lost)
                  : is_more_usual(appraisal, r, number_of_key(m, number->key), lost);
  };
  // What is missing still, one that has more numbers may imitate a little of.
  const double imitated = kHalf * rules_.excess(m.held_out);
  const auto clearly = [&](const Contender& r) {
    return effect && intricacy(rules_.candidates, r) > intricacy(rules_.candidates, *effect)
               ? imitated
               : 0;
  };
  const auto better = std::find_if(rivals.begin(), rivals.end(), [&](const Contender& r) {
    return simpler(r) || r.worth() >= worth + clearly(r);
  });
  if (better != rivals.end()) {
    // What takes the place of a declared number says more, and must do clearly better: else
    // the number took its place again.
    const double allowed_loss = simpler(*better) ? appraisal.band_of(lost)
                                : number         ? -appraisal.band_of(lost)
                                                 : -rules_.options.least_gain;
    const double least = changes_.counted_within(m, appraisal, within) - allowed_loss;
    FittedMachine instead = less;
    changes_.add(instead, *better, {});
    if (changes_.holds_up(instead) && changes_.is_certain(instead) &&
        changes_.counted_within(instead, appraisal) >= least) {
      m = std::move(instead);
      return true;
    }
    rivals.erase(better);
  }
  return effect && exchange_for_as_good(m, i, less, rivals, appraisal, lost, within);
}

bool Exchange::join(FittedMachine& m) const {
  for (std::size_t i = 0; i < m.added.size(); ++i)
    for (std::size_t j = i + 1; j < m.added.size(); ++j)
      if (rules_.candidates[m.added[i].candidate].place ==
              rules_.candidates[m.added[j].candidate].place &&
          became_one(m, i, j))
        return true;
  return false;
}

bool Exchange::became_one(FittedMachine& m, std::size_t i, std::size_t j) const {
  const FittedMachine less = changes_.taken_out(
      changes_.taken_out(m, j, MachineChanges::Common::free), i, MachineChanges::Common::free);
  const Contest contest(rules_, less);
  const double lost = contest.appraisal().held_out() - m.held_out,
               wrong = std::max(rules_.options.class_gain, rules_.options.share_of_found * lost);
  if (std::min(m.added[i].gain, m.added[j].gain) < std::max(kOneOfTwo * lost, 2 * wrong))
    return false;
  for (const Contender& r : contest.rivals(kNearLoss * lost, rules_.candidates.size())) {
    if (!r.released.empty() || r.gain < kAsGood * lost || r.candidate == m.added[i].candidate ||
        r.candidate == m.added[j].candidate)
      continue;
    FittedMachine instead = less;
    changes_.add(instead, r, {}, changes_.far_more_than(m));
    if (instead.held_out - m.held_out > wrong || !changes_.holds_up(instead) ||
        !changes_.is_certain(instead))
      continue;
    m = std::move(instead);
    exchange(m);
    return true;
  }
  evidence_.anchor(m.machine);
  return false;
}

bool Exchange::exchange_for_as_good(FittedMachine& m, std::size_t i, const FittedMachine& less,
                                    const std::vector<Contender>& rivals,
                                    const Appraisal& appraisal, double lost,
                                    std::optional<FittedMachine>& within) const {
  const double band = appraisal.band_of(lost),
               present = changes_.counted_within(m, appraisal, within);
  std::optional<FittedMachine> simplest;
  double least = intricacy(rules_.candidates, m.added[i]);
  std::vector<std::size_t> alike = m.added[i].class_with;
  for (const Contender& r : rivals) {
    if (!r.released.empty() || r.gain < kAsGood * lost ||
        std::count(alike.begin(), alike.end(), r.candidate) > 0)
      continue;
    FittedMachine instead = less;
    if (const FittedMachine* known = fitted_before(less, r.candidate))
      instead = *known;
    else
      changes_.add(instead, r, {}, changes_.far_more_than(m));
    const double less_counts = present - changes_.counted_within(instead, appraisal);
    if (less_counts > band || instead.added.empty() || !changes_.holds_up(instead)) continue;
    alike.push_back(r.candidate);
    AddedEffect& last = instead.added.back();
    last.needless =
        appraisal.needless_among(last.numbers, instead.columns_of(instead.added.size() - 1), lost);
    const double says = intricacy(rules_.candidates, last) + less_counts / band;
    if (says > least - kClearlySimpler) continue;
    least = says;
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

const FittedMachine* Exchange::fitted_before(const FittedMachine& m, std::size_t candidate) const {
  const auto found =
      std::find_if(also_fitted_.begin(), also_fitted_.end(), [&](const FittedMachine& f) {
        return f.added.size() == m.added.size() + 1 && f.added.back().candidate == candidate &&
               f.released.size() == m.released.size() &&
               std::equal(m.added.begin(), m.added.end(), f.added.begin(),
                          [](const AddedEffect& x, const AddedEffect& y) {
                            return x.candidate == y.candidate;
                          }) &&
               std::equal(
                   m.released.begin(), m.released.end(), f.released.begin(),
                   [](const ReleasedNumber& x, const ReleasedNumber& y) { return x.key == y.key; });
      });
  return found == also_fitted_.end() ? nullptr : &*found;
}

}  // namespace vcnc
