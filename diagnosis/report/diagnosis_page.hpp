// A diagnosis as one self-contained page: what was off, what it goes along with, what was added and
// what that left.
#pragma once

#include <string>
#include <string_view>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/model_comparison.hpp"

namespace vcnc {

/// Second line of the page, by which it is known.
extern const std::string_view kDiagnosisMark;

/// All that the page is about; the references must outlive it.
struct DiagnosisStory {
  const Diagnosis& diagnosis;
  const Record& record;
  ModelResiduals residuals;  ///< no channels: a bare encoder
};

std::string diagnosis_page(const DiagnosisStory& story);

}  // namespace vcnc
