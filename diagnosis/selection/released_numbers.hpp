// Declared numbers out of tolerance, held against effects.
#pragma once

#include <vector>

#include "diagnosis/selection/appraisal.hpp"
#include "diagnosis/selection/contender.hpp"

namespace vcnc {

/// Whether a declared number has a tolerance that it may be out of.
bool may_be_out(const FreedNumber& number);
/// Whether it may be told to be.
bool may_be_released(const DiagnosisOptions& options, const FreedNumber& number);

/// Which of them: those that pull at their tolerance, or, where something was taken out that may
/// have stood for one, any that then leaves it.
enum class Released { where_pulled, anywhere };

/// Declared numbers with their tolerance lifted. Those that may gain `as_much` as another contender
/// are refitted.
std::vector<Contender> released_numbers(const Appraisal& appraisal, Released which, double as_much);

/// Declared numbers whose tolerance may be lifted, each the only one of an effect, as trials.
std::vector<TrialColumns> lifted_numbers(const Appraisal& appraisal);

/// Whether all of them that were declared are where they hardly are by their tolerances.
bool is_out_of_tolerance(const Appraisal& appraisal, const std::vector<FreedNumber>& numbers);

}  // namespace vcnc
