// From a record and a declared machine to a verdict.
//
// Absolute: the record against the declared machine. Differential: against a healthy run of the
// same program (differential.hpp), which should be preferred where there is one.
//
// Verdict, with c = chi-square per sample on held-out laps (1 is noise):
//
//   NOT IDENTIFIABLE  nothing in the library would show, or there is too little to compare
//   NO DEVIATION      nothing was found and c < 1.05
//   EXPLAINED         something was found and c < 1.05, or at least 98 % of the excess is gone
//   PARTLY            something was found, but more is left
//   UNEXPLAINED       something repeatable is left that no effect of the library makes
//
// In absolute mode c > 1.1 after the fit is model form error: what the model and the machine do
// differently by themselves. Its share of the excess is told and no effect may be called a cause.
// Without repeated motions c says nothing and the words are those of what was found.
//
// Intervals: 95 %, the larger of the information matrix (inflated by c) and the sandwich with
// seconds of laps as clusters (White, Econometrica 48 (1980) 817; Liang & Zeger, Biometrika 73
// (1986) 13), declared tolerances included.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/candidate.hpp"
#include "diagnosis/diagnosis.hpp"
#include "diagnosis/record.hpp"
#include "diagnosis/replica.hpp"
#include "diagnosis/selection.hpp"

namespace vcnc {

struct DiagnosisCase {
  const Record& record;
  Replica& replica;  ///< of the record
  const Machine& declared;
  std::vector<Candidate> candidates;
};

/// A run of the same program when the machine was healthy.
struct HealthyRun {
  const Record& record;
  const Replica& replica;
};

Diagnosis diagnose(const DiagnosisCase& of, const std::optional<HealthyRun>& healthy,
                   const DiagnosisOptions& options = {}, const KeepGoing& keep_going = {});

/// How well two machines predict a run that was not used: one figure per channel.
std::vector<SignalFigure> figures_of(const Record& record, Replica& replica,
                                     const Machine& declared, const Machine& found,
                                     const std::string& name);

/// A declared machine fitted to a healthy run.
struct Commissioning {
  Machine machine;
  std::vector<FittedNumber> numbers;  ///< friction and what else was fitted
  std::vector<std::string> notes;     ///< which friction law each axis got, and why
  std::vector<SignalFigure> figures;
  std::vector<std::string> warnings;
};

/// Fits declared numbers within their tolerances and, axis by axis, the simplest friction law that
/// does best on held-out data: none, dry and viscous, with break-away, with pre-sliding, with both.
Commissioning commission(const DiagnosisCase& of, const DiagnosisOptions& options = {},
                         const KeepGoing& keep_going = {});

}  // namespace vcnc
