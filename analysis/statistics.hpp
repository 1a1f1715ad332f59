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
  void merge(const Statistics& later) {
    if (later.count == 0) return;
    if (count == 0 || later.max > max) max = later.max, at_max = later.at_max;
    if (count == 0 || later.min < min) min = later.min, at_min = later.at_min;
    count += later.count;
    sum += later.sum;
    sum_of_squares += later.sum_of_squares;
  }
  double mean() const { return count ? sum / static_cast<double>(count) : 0; }
  double rms() const { return count ? std::sqrt(sum_of_squares / static_cast<double>(count)) : 0; }
  double peak_to_peak() const { return max - min; }
  double max_abs() const { return std::max(std::abs(max), std::abs(min)); }
  bool operator==(const Statistics&) const = default;
};

}  // namespace vcnc
