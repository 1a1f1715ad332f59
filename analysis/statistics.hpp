// Running statistics of a signal: constant memory, one value at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vcnc {

struct Statistics {
  std::int64_t count = 0;
  double max = 0, min = 0;
  double at_max = 0, at_min = 0;  ///< where the extremes occurred, e.g. arc length
  double sum = 0, sum_of_squares = 0;

  void add(double value, double where = 0) {
    if (count == 0 || value > max) max = value, at_max = where;
    if (count == 0 || value < min) min = value, at_min = where;
    ++count;
    sum += value;
    sum_of_squares += value * value;
  }
  double mean() const { return count ? sum / static_cast<double>(count) : 0; }
  double rms() const { return count ? std::sqrt(sum_of_squares / static_cast<double>(count)) : 0; }
  double peak_to_peak() const { return max - min; }
  double max_abs() const { return std::max(std::abs(max), std::abs(min)); }
  bool operator==(const Statistics&) const = default;
};

}  // namespace vcnc
