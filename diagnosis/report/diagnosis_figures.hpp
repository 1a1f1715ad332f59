// The figures of a diagnosis as gnuplot scripts.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/model_comparison.hpp"

namespace vcnc {

/// Residual of some channels over time, before and after.
std::string residual_figure(const Record& record, const ModelResiduals& residuals,
                            const std::vector<std::size_t>& channels);

/// A quantity that a residual may depend on.
struct RelatedQuantity {
  std::string name, unit;
  std::vector<double> value;  ///< in its unit; NaN: unknown
  std::vector<double> speed;  ///< of the axis it belongs to; empty: of none
};

/// Positions, speeds and accelerations of the commanded axes (measured, where there is no command)
/// and time.
std::vector<RelatedQuantity> related_quantities(const Record& record);

/// Share of a residual's variance that its means in 30 bins of the covariate take, separately for
/// both directions, less what 60 means of noise would take.
double explained_by(const RelatedQuantity& covariate, const std::vector<double>& residual);

/// Means of the residual over a covariate, for both directions, before and after.
std::string correlation_figure(const RelatedQuantity& covariate, const ComparedChannel& channel,
                               const std::vector<double>& before, const std::vector<double>& after);

/// The curve of a learned law with its 95 % band.
std::string law_figure(const LearnedLaw& law);

/// Held-out chi-square after each added effect.
std::string ladder_figure(const std::vector<Rung>& ladder);

}  // namespace vcnc
