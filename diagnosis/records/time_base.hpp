// From time stamps to a uniform grid: sample k at t_0 + k T.
//
// T is the median step, refined over the whole run. A step of two or more periods is a gap: the
// grid has samples there that nobody measured. Time that does not increase, or that fits no uniform
// grid, is refused: a record made uniform by interpolation would hold numbers nobody measured.
#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/records/measured_table.hpp"

namespace vcnc {

struct TimeBase {
  double begin = 0, period = 0;    ///< [s]
  std::size_t samples = 0;         ///< of the grid
  std::vector<std::size_t> index;  ///< of each row in the grid
  double jitter = 0;               ///< rms of stamp less grid [s]
  double worst = 0;                ///< largest of them [s]
  std::size_t gaps = 0, lost = 0;  ///< places where samples are missing, and how many
};

/// `time` in seconds; `tolerance` is the share of a period a stamp may be off. The table is for
/// messages only. Throws MeasurementError.
TimeBase time_base(const std::vector<double>& time, double tolerance, const MeasuredTable& table);

TimeBase uniform_time_base(std::size_t rows, double period);

}  // namespace vcnc
