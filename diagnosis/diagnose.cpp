#include "diagnosis/diagnose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include "diagnosis/beforehand/chatter_search.hpp"
#include "diagnosis/beforehand/period_slip_search.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/findings/findings.hpp"
#include "diagnosis/healthy/common_numbers.hpp"
#include "diagnosis/records/signal_name.hpp"
#include "diagnosis/replica/clipped_replica.hpp"
#include "diagnosis/replica/model_comparison.hpp"
#include "diagnosis/selection/simplest_form.hpp"
#include "model/input_error.hpp"

namespace vcnc {
namespace {

/// Part of the noise's chi-square that an effect must gain: as much may be of a model that is not
/// quite the machine's.
constexpr double kFormAllowance = 0.001;
/// Part that the form of the model may leave at most, and how much of it an effect must explain.
constexpr double kForm = 0.04, kShareOfForm = 0.15;
/// Part of what is explained that a model of it may be wrong by.
constexpr double kShareOfFound = 0.005;

/// What a model gets wrong about the readings of a healthy machine changes by this share when the
/// piece is clamped anew and friction is that of another day.
constexpr double kChangeOfForm = 0.05;
/// The same where no drive tells anything: nobody knows with what force an axis came to rest.
constexpr double kChangeOfUnseen = 0.2;

/// Effects that are told between two runs of one machine: more are a law that nobody has named.
constexpr std::size_t kMostChanges = 5, kFewChanges = 3;
/// Effects that are enough to see what else is noise, where no laps tell it.
constexpr std::size_t kEffectsAtFirst = 2;
/// Part of what is left that each of them must explain: less is what those before got wrong.
constexpr double kShareOfChange = 0.1;
/// The same at a drive where one was found.
constexpr double kShareBeside = 0.5;

double change_of_form(const std::vector<ComparedChannel>& channels) {
  const bool unseen = std::all_of(channels.begin(), channels.end(),
                                  [](const ComparedChannel& c) { return is_reading(c.kind); });
  return unseen ? kChangeOfUnseen : kChangeOfForm;
}

/// Chi-square of the held-out laps that this makes.
std::vector<double> forms_of(const Evidence& evidence, const DifferentialRecord& difference) {
  const std::vector<ComparedChannel>& channels = evidence.replica().channels();
  std::vector<double> forms(channels.size(), 0.0);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const double changed =
        change_of_form(channels) * difference.off_in(channels[c]) / evidence.noise_left(c);
    forms[c] = evidence.count(c, Role::held_out) * changed * changed;
  }
  return forms;
}

/// RMS of what the declared machine left of each channel of a healthy run that it was fitted to
/// [SI]; nought where nothing is known of a channel, empty where it was not fitted. Throws
/// InputError naming a signal that there is not.
std::vector<double> left_by_commissioning(const Machine& declared,
                                          const std::vector<ComparedChannel>& channels) {
  if (declared.commissioned.empty()) return {};
  std::vector<double> left(channels.size(), 0.0);
  for (const CommissionedSignal& s : declared.commissioned) {
    bool known = false;
    for (const SignalKind kind :
         {SignalKind::position, SignalKind::twist, SignalKind::velocity, SignalKind::force,
          SignalKind::deflection, SignalKind::bar, SignalKind::tool_position})
      for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        known = known || s.signal == signal_name(kind, axis);
    if (!known)
      throw InputError("commissioned.signal: \"" + s.signal +
                       "\" is none; allowed: position, twist, velocity or force of X, Y, Z, A or "
                       "C, "
                       "deflection or tool position of x, y or z, ball bar");
    for (std::size_t c = 0; c < channels.size(); ++c)
      if (channel_name(channels[c]) == s.signal) left[c] = s.left;
  }
  return left;
}

/// All that the model leaves of a healthy run is its form: it counts as noise, and as much again
/// may be there in another run, or be gained by what is not there.
void allow_for_form(const Evidence& evidence, const std::vector<double>& left,
                    DiagnosisOptions& options) {
  for (std::size_t c = 0; c < left.size(); ++c) {
    const double form = std::pow(left[c] / evidence.noise().channels[c].rms, 2);
    options.form_of_channel.push_back(evidence.count(c, Role::held_out) * form / (1 + form));
  }
}

/// The options for what is explained: what was measured, or a difference.
DiagnosisOptions fitting(DiagnosisOptions options, const Evidence& evidence,
                         const DifferentialRecord* difference, const std::vector<double>& left,
                         const std::vector<Chatter>& chatter) {
  for (const Chatter& c : chatter)
    if (c.hides_drive()) options.vibrating.push_back(c.axis);
  if (difference) {
    options.max_effects = std::min(options.max_effects, kMostChanges);
    options.few_effects = std::min(options.few_effects, kFewChanges);
    options.least_share = std::max(options.least_share, kShareOfChange);
    options.share_beside = std::max(options.share_beside, kShareBeside);
    options.form_of_channel = forms_of(evidence, *difference);
    double square = 0;
    for (const ComparedChannel& c : evidence.replica().channels())
      if (is_reading(c.kind)) square += std::pow(difference->off_in(c), 2);
    options.form_um = 1e6 * change_of_form(evidence.replica().channels()) * std::sqrt(square);
  } else if (!left.empty()) {
    allow_for_form(evidence, left, options);
  }
  options.rounding_of_channel = evidence.rounding_reckoned();
  options.least_gain =
      std::max(options.least_gain, kFormAllowance * evidence.count(Role::held_out));
  options.form = kForm * evidence.count(Role::held_out);
  options.share_of_form = kShareOfForm;
  options.share_of_found = kShareOfFound;
  return options;
}

/// What is explained, and against which machine.
struct Question {
  const DiagnosisCase& of;
  const DifferentialRecord* difference;  ///< the record of the case is one; null: what was measured
  Machine declared;
  std::vector<double> left{};  ///< by commissioning
};

/// A search with everything that it was made with.
struct Attempt {
  /// `encoders`: a machine whose encoders make the noise, and what it leaves, where no laps tell
  /// that; null: the declared one.
  Attempt(const Question& question, FoundBeforehand known, const DiagnosisOptions& asked,
          const KeepGoing& keep_going, const Machine* encoders)
      : evidence(question.of.record, question.of.replica, question.declared,
                 question.difference
                     ? question.difference->noise_scales(question.of.replica.channels())
                     : std::vector<double>{},
                 question.left),
        before(std::move(known)) {
    const auto& [of, difference, declared, left] = question;
    if (encoders && evidence.noise().from_repetitions) evidence.reckon_with_rounding(*encoders);
    if (encoders && !evidence.noise().from_repetitions) evidence.take_noise_from(*encoders);
    before.chatter = find_chatter(evidence, declared, of.candidates,
                                  difference ? difference->noise : HealthyNoise{});
    for (const Chatter& c : before.chatter)
      if (c.hides_drive()) evidence.leave_out_drive(c.axis);
    options = fitting(asked, evidence, difference, left, before.chatter);
    selection = select_effects_of(evidence, declared, of.candidates, options, keep_going);
    if (!selection.interrupted)
      bring_to_simplest_form(evidence, declared, options, selection.floor, selection.found);
  }
  Attempt(const Attempt&) = delete;  // what was selected refers to the evidence

  Evidence evidence;
  FoundBeforehand before;
  DiagnosisOptions options;
  SelectionResult selection;
};

/// What counts for the form of a model that was fitted to a healthy run, and what is beyond that
/// though nothing is told.
void tell_form_of_fitted(const std::vector<double>& left,
                         const std::vector<ComparedChannel>& channels, Diagnosis& d) {
  constexpr double kBeyondLeft = 1.3;
  d.notes.push_back(
      "As much as the model left of the healthy run that it was fitted to counts for its form and "
      "needs no cause.");
  if (d.verdict != DiagnosisVerdict::no_deviation) return;
  for (const SignalFigure& f : d.figures)
    for (std::size_t c = 0; c < left.size(); ++c) {
      const double was = std::hypot(left[c], f.floor);
      if (f.run != "held-out laps" || f.channel != channels[c] || f.after <= kBeyondLeft * was)
        continue;
      const ShownUnit unit = shown_unit(f.channel);
      d.warnings.push_back(fmt::format(
          "{} is off by {:.3g} {} rms, {:.2g} times what the model left of the healthy run that it "
          "was fitted to ({:.3g}): something may have changed that this model is too coarse to "
          "tell; give the healthy run as --reference.",
          channel_name(f.channel), f.after * unit.factor, unit.name, f.after / was,
          was * unit.factor));
    }
}

/// Axes that move, and stood in the healthy run that the model was fitted to.
void tell_not_fitted(const Machine& declared, const Record& record,
                     const std::vector<ComparedChannel>& channels, Diagnosis& d) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    bool compared = false, fitted = false;
    for (const ComparedChannel& c : channels) {
      if (is_reading(c.kind) || c.axis != axis) continue;
      compared = true;
      fitted = fitted || std::any_of(declared.commissioned.begin(), declared.commissioned.end(),
                                     [&](const CommissionedSignal& s) {
                                       return s.signal == channel_name(c);
                                     });
    }
    if (compared && !fitted && moves(record, axis))
      d.warnings.push_back(fmt::format(
          "{0} moves here and did not in the healthy run that the model was fitted to: of its "
          "friction, waves and gains the model knows what was declared, so what is told of {0} may "
          "be what it always had. Commission with a run that moves it, or give a healthy run of "
          "this program as --reference.",
          kAxisNames[axis]));
  }
}

/// Stopped while laws are sought, too: then without them.
Diagnosis findings_of_search(const DiagnosisCase& of, Attempt& search, bool differential,
                             const KeepGoing& keep_going) {
  const auto findings = [&] {
    return findings_of(of, search.evidence, search.options, search.selection, search.before,
                       differential);
  };
  if (search.selection.interrupted || !keep_going) return findings();
  std::mutex guard;
  search.evidence.stop_when([&] {
    const std::lock_guard lock(guard);
    return !keep_going({"telling what was found", 1});
  });
  std::optional<Diagnosis> told;
  try {
    told = findings();
  } catch (const Stopped&) {
    search.selection.interrupted = true;
  }
  search.evidence.stop_when({});
  return told ? std::move(*told) : findings();
}

/// The record of the case is what is explained: what was measured, or `difference`.
Diagnosis explained(const DiagnosisCase& of, const Record& raw,
                    const DifferentialRecord* difference, const DiagnosisOptions& asked,
                    const KeepGoing& keep_going) {
  Question question{of, difference, of.declared};
  Machine& declared = question.declared;
  FoundBeforehand before;
  if (declared.effects.get<PeriodSlip>().null())
    before.slip = find_period_slip(raw, of.replica.channels(), of.replica.predict(declared),
                                   declared.probe.signal_period);
  if (before.slip) declared.effects.get<PeriodSlip>() = *before.slip;
  if (!difference) question.left = left_by_commissioning(declared, of.replica.channels());
  const bool repeated = partition(of.record).repeated;
  DiagnosisOptions now = asked;
  if (!repeated) now.max_effects = std::min(asked.max_effects, kEffectsAtFirst);
  auto search = std::make_unique<Attempt>(question, before, now, keep_going, nullptr);
  const auto once_more = [&] {
    const Machine found = search->selection.found.machine;
    of.replica.anchor(declared);
    auto next = std::make_unique<Attempt>(question, before, now, keep_going, &found);
    if (next->selection.interrupted) {  // what was found before stands, and is no verdict
      search->selection.interrupted = true;
      of.replica.anchor(found);
      return false;
    }
    std::swap(search, next);
    return true;
  };
  bool anew = false;
  if (repeated) {
    anew = !search->selection.interrupted &&
           search->evidence.underrates_rounding(search->selection.found.machine) && once_more();
  } else {
    for (int round = 0; round < kNoiseRounds && !search->selection.interrupted; ++round) {
      const FittedMachine& found = search->selection.found;
      const bool all = found.found() < now.max_effects || now.max_effects == asked.max_effects;
      if (all && !search->evidence.noise_is_another_with(found.machine)) break;
      now.max_effects = asked.max_effects;
      if (!once_more()) break;
    }
  }
  Diagnosis d = findings_of_search(of, *search, difference != nullptr, keep_going);
  if (anew)
    d.notes.push_back(
        "What was found lets the encoders make more noise than in the declared machine; all was "
        "sought once more with that noise.");
  if (!question.left.empty()) {
    tell_form_of_fitted(question.left, of.replica.channels(), d);
    tell_not_fitted(declared, raw, of.replica.channels(), d);
  }
  return d;
}

}  // namespace

Diagnosis diagnose(const DiagnosisCase& of, const DiagnosisOptions& options,
                   const KeepGoing& keep_going) {
  return explained(of, of.record, nullptr, options, keep_going);
}

Diagnosis diagnose(const DiagnosisCase& of, const DifferentialRecord& difference,
                   const DiagnosisOptions& options, const KeepGoing& keep_going) {
  DiagnosisOptions with_common = options;
  with_common.against = Against::healthy_run;
  with_common.common = common_numbers(difference.healthy);
  ClippedReplica reading(of.replica, difference.taken_off_of(of.replica.channels()));
  ReplicaOfChange replica(reading, difference.healthy, with_common.common);
  // A change of such a number would be no change.
  std::vector<Candidate> candidates = of.candidates;
  std::erase_if(candidates, [&](const Candidate& c) {
    return c.numbers.size() == 1 && is_common(with_common.common, c.numbers.front().key);
  });
  return explained({difference.record, replica, difference.healthy, std::move(candidates)},
                   of.record, &difference, with_common, keep_going);
}

std::vector<SignalFigure> figures_of(const Record& record, Replica& replica,
                                     const Machine& declared, const Machine& found,
                                     const std::string& name, std::vector<double> noise_scale) {
  Evidence evidence(record, replica, declared, std::move(noise_scale));
  const Prediction before = evidence.predict(declared), after = evidence.predict(found);
  std::vector<SignalFigure> all;
  for (std::size_t c = 0; c < replica.channels().size(); ++c)
    all.push_back({replica.channels()[c], name, evidence.rms(before, c, Role::both),
                   evidence.rms(after, c, Role::both), evidence.noise_left(c)});
  return all;
}

}  // namespace vcnc
