// Everything that is accumulated along the scan path, so that laps can be added up or left out.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/dynamic_error.hpp"
#include "analysis/scan_line.hpp"
#include "analysis/summary.hpp"
#include "model/axes.hpp"

namespace vcnc {

/// Mean of the radius deviation over a small angle of a circle.
struct AngleBin {
  double sum = 0;  ///< [m]
  std::uint32_t count = 0;
};

/// Where the tolerance was exceeded most on samples that count for the verdict.
struct ToleranceFailure {
  double s = 0, e_n = 0;  ///< [m]
  bool worse_than(const ToleranceFailure& other) const {
    return std::abs(e_n) > std::abs(other.e_n);
  }
};

struct PathStatistics {
  static constexpr std::size_t kAngleBins = 7200;  ///< of 0.05 deg

  ErrorGroup whole;
  std::array<ErrorGroup, 5> faces;
  std::vector<ErrorGroup> crossings;  ///< as many as the line has
  PerAxis<Statistics> following, share;
  Statistics lag, cross;
  std::array<std::vector<AngleBin>, 2> circle;  ///< counter-clockwise, clockwise; empty: no ring
  std::optional<ToleranceFailure> failure;

  void add(const ErrorSample& e, double s, Face face);
  void add_crossing(std::size_t i, const ErrorSample& e, double s);
  void add_circle(double phi, bool counter_clockwise, double dr);
  void merge(const PathStatistics& later);
};

}  // namespace vcnc
