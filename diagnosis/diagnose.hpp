// From a record and a declared machine to a verdict.
//
// Absolute: the record against the declared machine. Differential: against a healthy run of the
// same program (differential.hpp), which should be preferred where there is one.
//
// An effect must gain 0.1 % of the noise's chi-square on held-out laps, and 15 % of what is left
// where that is less than 4 % of the noise's: so much a model that is not quite the machine's may
// take for one. Detection limits are told for that gain. In differential mode
// readings of the probe are left out where the declared model is off the healthy run by 20 times
// their noise.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/diagnosis_case.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "diagnosis/search/selection.hpp"

namespace vcnc {

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

}  // namespace vcnc
