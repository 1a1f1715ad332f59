// From a record and a declared machine to a verdict.
//
// Absolute: the record against the declared machine. Differential: against a healthy run of the
// same program (differential.hpp), which should be preferred where there is one.
//
// An effect must gain 0.1 % of the noise's chi-square on held-out laps, and 15 % of what is left
// where that is less than 4 % of the noise's: so much a model that is not quite the machine's may
// take for one. Detection limits are told for that gain.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/diagnosis_case.hpp"
#include "diagnosis/healthy/differential.hpp"
#include "diagnosis/selection/selection.hpp"

namespace vcnc {

Diagnosis diagnose(const DiagnosisCase& of, const DiagnosisOptions& options = {},
                   const KeepGoing& keep_going = {});

/// `difference` is that of the record of the case.
Diagnosis diagnose(const DiagnosisCase& of, const DifferentialRecord& difference,
                   const DiagnosisOptions& options = {}, const KeepGoing& keep_going = {});

/// How well two machines predict a run that was not used: one figure per channel; `noise_scale` is
/// that of a difference from a healthy run.
std::vector<SignalFigure> figures_of(const Record& record, Replica& replica,
                                     const Machine& declared, const Machine& found,
                                     const std::string& name, std::vector<double> noise_scale = {});

}  // namespace vcnc
