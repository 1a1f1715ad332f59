// What compensation is worth: the dynamic error of the standard motions before and after.
#pragma once

#include <string>
#include <vector>

#include "apps/experiments.hpp"
#include "model/compensation.hpp"

namespace vcnc {

/// Figures of the machine's part of the dynamic error, e_n - e_plan, over one pass [m].
struct ErrorFigures {
  double rms = 0, largest = 0, peak_to_peak = 0;
};

struct PassComparison {
  std::string motion, pass;
  ErrorFigures before, after;
};

/// The machine's error in every pass of an experiment on `machine` with its effects and its
/// compensation. Throws std::runtime_error when the run ends in an alarm.
std::vector<Curve> machine_error(Showing showing, std::size_t axis, const Machine& machine,
                                 const ExperimentOptions& options = {});

ErrorFigures figures_of(const Curve& curve);

/// Circles in both senses and one lap of the S piece, with the compensation that `machine` has and
/// with `settings`.
std::vector<PassComparison> compare_compensation(const Machine& machine,
                                                 const CompensationParams& settings);

}  // namespace vcnc
