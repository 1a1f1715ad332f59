// What a search found, as a verdict with effects, figures and intervals.
//
// Verdict, with c = chi-square per sample on held-out laps (1 is noise):
//
//   NOT IDENTIFIABLE  nothing in the library would show, or there is too little to compare
//   NO DEVIATION      nothing was found, c < 1.05 and no signal is still off
//   EXPLAINED         something was found and explains what there was (verdict.hpp), no signal is
//                     still off, and none is further off than without it
//   PARTLY            something was found, but more is left
//   UNEXPLAINED       something is left that no effect of the library makes: it repeats, or an axis
//                     vibrates, or readings shift from lap to lap by three times their noise
//
// A signal is still off if its RMS is over 1.5 times its noise and what is beyond the noise over a
// twentieth of what it was: so much a model of the true cause may be wrong by, seldom more, but one
// that only does something like it. Of a length 0.01 um, since no effect is told of less.
// (Chi-square of all signals does not tell: one of sixteen counts little in it.)
//
// In absolute mode c > 1.1 after the fit is model form error: what the model and the machine do
// differently by themselves. Its share of the excess is told and no effect may be called a cause.
// Without repeated motions noise is what the past of a remainder does not foretell of it
// (noise_audit.hpp), and no form is told.
//
// An effect that makes a signal worse, or a number that went to the end of what is allowed, is a
// warning: it cannot be all of what is there.
//
// What moves the contour by less than 0.01 um and every signal by less than a tenth of its noise is
// a note, not an effect.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/beforehand/chatter_search.hpp"
#include "diagnosis/beforehand/period_slip_search.hpp"
#include "diagnosis/diagnosis.hpp"
#include "diagnosis/diagnosis_case.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/selection/selection.hpp"

namespace vcnc {

/// What was found before effects were sought: a slip of a period, which is part of every
/// prediction, and axes that vibrate by themselves, which is of none.
struct FoundBeforehand {
  std::optional<PeriodSlip> slip;
  std::vector<Chatter> chatter;
};

/// A sentence about each signal that is further off on held-out laps, by a quarter and by 1.5 times
/// its noise, than before effects were added: what is there improves no signal at the cost of
/// another.
std::vector<std::string> signals_made_worse(const std::vector<SignalFigure>& figures);

Diagnosis findings_of(const DiagnosisCase& of, const Evidence& evidence,
                      const DiagnosisOptions& options, const SelectionResult& selection,
                      const FoundBeforehand& before, bool differential);

}  // namespace vcnc
