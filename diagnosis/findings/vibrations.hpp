// Axes that vibrate by themselves, told.
#pragma once

#include <vector>

#include "diagnosis/beforehand/chatter_search.hpp"
#include "diagnosis/diagnosis.hpp"
#include "diagnosis/diagnosis_case.hpp"
#include "diagnosis/evidence/evidence.hpp"

namespace vcnc {

/// What vibrates by itself, and with which effects the model does so, too: one that makes it as
/// strong becomes an effect of the diagnosis, at the end of it; the rest are notes.
void tell_vibrations(const DiagnosisCase& of, const Evidence& evidence,
                     const std::vector<Chatter>& chatter, Diagnosis& d);

}  // namespace vcnc
