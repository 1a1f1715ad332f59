// Of machines that fit as well as the one that was found, the one that is told most simply:
//
//   numbers of an effect that the record can do without are as declared again, the least needed
//   first; then those that may as well be so by their intervals, all else fitted again; then those
//   that only shaped them;
//   a wave of a negative amplitude is one of a positive amplitude, half a period on.
#pragma once

#include "diagnosis/diagnosis_options.hpp"
#include "diagnosis/fit/fitted_machine.hpp"

namespace vcnc {

/// `floor`: chi-square that noise leaves of the held-out laps.
void bring_to_simplest_form(const Evidence& evidence, const Machine& declared,
                            const DiagnosisOptions& options, double floor, FittedMachine& machine);

}  // namespace vcnc
