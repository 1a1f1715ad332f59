#include "diagnosis/findings/excitation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/candidates/trial.hpp"
#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Of candidates, from those of the trials: the smallest size that is seen; of limits the
/// largest.
std::map<std::size_t, double> limits_of_candidates(const SelectionResult& selection,
                                                   const std::vector<double>& of_trials) {
  std::map<std::size_t, double> limits;
  for (std::size_t i = 0; i < of_trials.size(); ++i) {
    const Trial& trial = selection.trials[i].trial;
    double& limit = limits.try_emplace(trial.candidate, of_trials[i]).first->second;
    const bool largest = trial.directions.front().whole && std::isfinite(limit);
    if (std::isfinite(of_trials[i]))
      limit = largest ? std::max(limit, of_trials[i]) : std::min(limit, of_trials[i]);
  }
  return limits;
}

/// Of a candidate the number that its limits are of.
const FreeNumber& limited_number(const DiagnosisCase& of, const SelectionResult& selection,
                                 std::size_t candidate) {
  const auto& all = selection.trials;
  const auto at = std::find_if(all.begin(), all.end(), [&](const TrialColumns& t) {
    return t.trial.candidate == candidate;
  });
  return of.candidates[candidate].numbers[at->trial.directions.front().number];
}

/// As far as the key allows: what would have to be larger to be seen is not seen, and what is seen
/// of everything that a limit may be is seen up to the largest.
double within_range(const FreeNumber& number, double limit) {
  const double largest = std::max(std::abs(number.min), std::abs(number.max));
  if (!(limit > largest)) return limit;
  return is_limit(number) && std::isfinite(limit) ? largest
                                                  : std::numeric_limits<double>::infinity();
}

/// Whether a place is an axis of which the run holds no signal.
bool is_unseen_axis(const Evidence& evidence, const std::string& place) {
  const std::size_t axis = axis_named(place_of_key(place));
  const std::vector<MeasuredSignal>& signals = evidence.record().signals;
  return axis < kAxisCount &&
         std::none_of(signals.begin(), signals.end(), [&](const MeasuredSignal& s) {
           return !is_reading(s.kind) && s.axis == axis;
         });
}

}  // namespace

std::string program_for(const std::string& effect) {
  const EffectText* text = effect_text(effect);
  if (!text) return "";
  switch (text->showing) {
    case Showing::circle:
    case Showing::circle_feeds:
      return "circle";
    case Showing::line:
    case Showing::reversals:
    case Showing::spin:
      return "diagnosis";
    case Showing::standstill:
    case Showing::corner:
      return "step";
    case Showing::s_piece:
      return "s-piece";
  }
  return "";
}

ExcitationOfRun excitation_of(const DiagnosisCase& of, const Evidence& evidence,
                              const SelectionResult& selection) {
  ExcitationOfRun told;
  const auto& beside = selection.beside_found;
  std::vector<double> alone;
  for (const TrialColumns& t : selection.trials) alone.push_back(t.detection_limit);
  const std::map<std::size_t, double> limits = limits_of_candidates(selection, alone),
                                      limits_beside = beside ? limits_of_candidates(
                                                                   selection, beside->of_trials)
                                                             : std::map<std::size_t, double>{};
  double finest = std::numeric_limits<double>::infinity();  // slip of a period that would show
  for (std::size_t c = 0; c < evidence.replica().channels().size(); ++c)
    if (evidence.replica().channels()[c].kind == SignalKind::deflection)
      finest = std::min(finest, 5 * std::sqrt(2.0) * evidence.noise().channels[c].rms /
                                    of.declared.probe.signal_period);
  if (finest < 1) told.of.push_back({"probe.period_slip", finest, true, "", "", {}});
  std::set<std::string> unseen;
  for (const auto& [c, of_trials] : limits) {
    const Candidate& candidate = of.candidates[c];
    if (is_unseen_axis(evidence, candidate.place)) {
      unseen.insert(place_of_key(candidate.place));
      continue;
    }
    const FreeNumber& number = limited_number(of, selection, c);
    const double limit = within_range(number, of_trials);
    double typical = std::abs(number.typical);
    for (std::size_t i = 0; i < candidate.numbers.size() && typical == 0; ++i)
      typical = std::abs(candidate.numbers[i].typical);
    const bool excited = is_limit(number) ? std::isfinite(limit) : limit < typical;
    Excitation e{candidate.name(), limit, excited, "", number.key, {}};
    if (!e.excited) e.program = program_for(candidate.effect);
    if (const auto found = limits_beside.find(c); found != limits_beside.end())
      e.beside_found = within_range(number, found->second);
    if (e.excited || !selection.interrupted) told.of.push_back(std::move(e));
  }
  for (std::size_t i = 0; i < selection.release_limits.size(); ++i) {
    const FreeNumber& n = selection.base.nuisances.numbers[i].number;
    if (is_clamping(n.key) || is_unseen_axis(evidence, place_of_key(n.key))) continue;
    const std::string place = place_of_key(n.key), effect = effect_of_key(n.key);
    const double limit = selection.release_limits[i];
    Excitation e{never_quite_absent(n.key) ? place + "." + effect : n.key,
                 limit,
                 std::isfinite(limit),
                 "",
                 n.key,
                 {}};
    if (!e.excited) e.program = program_for(effect);
    if (beside) e.beside_found = beside->of_releases[i];
    told.of.push_back(std::move(e));
  }
  if (!unseen.empty())
    told.notes.push_back(fmt::format(
        "The run holds no signal of {}, taken to stand where the model starts; what {} is not "
        "listed with what this run could have shown.",
        fmt::join(unseen, " and "), unseen.size() == 1 ? "that axis has" : "these axes have"));
  return told;
}

}  // namespace vcnc
