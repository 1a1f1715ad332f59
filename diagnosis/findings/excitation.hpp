// What of the library a run could have shown, and what would show the rest.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/diagnosis_case.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/selection/selection.hpp"

namespace vcnc {

/// The kind of `vcnc program` that shows an effect best; empty: none does.
std::string program_for(const std::string& effect);

struct ExcitationOfRun {
  std::vector<Excitation> of;
  std::vector<std::string> notes;
};

/// Every effect and declared number that was tried with the least of it that shows; of axes
/// without a signal a note.
ExcitationOfRun excitation_of(const DiagnosisCase& of, const Evidence& evidence,
                              const SelectionResult& selection);

}  // namespace vcnc
