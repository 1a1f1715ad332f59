#include "diagnosis/records/time_base.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vcnc {

namespace {

/// A grid of more than this share of holes is none.
constexpr double kMostLost = 0.5;
constexpr double kNought = 1e-6;  ///< of a period

double median_step(const std::vector<double>& time) {
  std::vector<double> steps(time.size() - 1);
  for (std::size_t i = 1; i < time.size(); ++i) steps[i - 1] = time[i] - time[i - 1];
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

void refuse_unordered(const std::vector<double>& time, const MeasuredTable& table) {
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (!std::isfinite(time[i])) throw MeasurementError(table.place(i) + ": the time is missing");
    if (i > 0 && !(time[i] > time[i - 1]))
      throw MeasurementError(fmt::format("{}: time does not increase: {:.15g} s after {:.15g} s",
                                         table.place(i), time[i], time[i - 1]));
  }
}

/// Line through (step, time).
struct Grid {
  double period = 0, shift = 0;  ///< time of step 0 after the first stamp [s]
  double jitter = 0, worst = 0;  ///< of the stamps, RMS and largest [s]
  std::size_t worst_at = 0, outside = 0;
};

Grid grid_of(const std::vector<double>& time, const std::vector<double>& step_of,
             double tolerance) {
  const auto rows = static_cast<double>(time.size());
  double mean_k = 0, mean_t = 0, kk = 0, kt = 0;
  for (std::size_t i = 0; i < time.size(); ++i) mean_k += step_of[i], mean_t += time[i] - time[0];
  mean_k /= rows, mean_t /= rows;
  for (std::size_t i = 0; i < time.size(); ++i) {
    kk += (step_of[i] - mean_k) * (step_of[i] - mean_k);
    kt += (step_of[i] - mean_k) * (time[i] - time[0] - mean_t);
  }
  Grid grid;
  grid.period = kt / kk;
  grid.shift = mean_t - grid.period * mean_k;
  double square = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    const double off = std::abs(time[i] - time[0] - grid.shift - grid.period * step_of[i]);
    square += off * off;
    grid.outside += off > tolerance * grid.period;
    if (off > grid.worst) grid.worst = off, grid.worst_at = i;
  }
  grid.jitter = std::sqrt(square / rows);
  return grid;
}

}  // namespace

TimeBase time_base(const std::vector<double>& time, double tolerance, const MeasuredTable& table) {
  if (time.size() < 3)
    throw MeasurementError(
        fmt::format("{}: {} samples are too few for a time base", table.source, time.size()));
  refuse_unordered(time, table);
  const double median = median_step(time);
  // Steps are counted one after another, so that a wrong guess of the period does not add up.
  std::vector<double> step_of(time.size(), 0);
  for (std::size_t i = 1; i < time.size(); ++i)
    step_of[i] = step_of[i - 1] + std::max(1.0, std::round((time[i] - time[i - 1]) / median));
  const auto rows = static_cast<double>(time.size());
  Grid grid = grid_of(time, step_of, tolerance);
  if (grid.outside > 0) {
    // Stamps that jitter by more than a quarter of a step miscount: without gaps, one step per row.
    std::vector<double> row_of(time.size());
    std::iota(row_of.begin(), row_of.end(), 0.0);
    if (const Grid whole = grid_of(time, row_of, tolerance); whole.outside == 0) {
      grid = whole;
      step_of = row_of;
    }
  }
  if (step_of.back() + 1 > rows / (1 - kMostLost))
    throw MeasurementError(fmt::format(
        "{}: time fits no uniform grid: most steps are {:.6g} ms, but {:.0f} such steps "
        "pass during {:.0f} rows; a record needs a constant sampling rate: give a part of it "
        "without long pauses",
        table.source, median * 1e3, step_of.back(), rows - 1));
  if (grid.outside > 0)
    throw MeasurementError(fmt::format(
        "{}: time is not uniform: {} of {} time stamps are off the grid of {:.6g} ms by more than "
        "{:.3g} % of it, here by {:.3g} ms; a record needs a constant sampling rate, or a larger "
        "time.jitter_percent if only the stamps are inexact",
        table.place(grid.worst_at), grid.outside, time.size(), grid.period * 1e3, tolerance * 100,
        grid.worst * 1e3));
  TimeBase base;
  base.period = grid.period;
  base.begin = time.front() + grid.shift;
  if (std::abs(base.begin) < kNought * base.period) base.begin = 0;
  base.jitter = grid.jitter;
  base.worst = grid.worst;
  for (const double step : step_of) base.index.push_back(static_cast<std::size_t>(step));
  base.samples = base.index.back() + 1;
  for (std::size_t i = 1; i < base.index.size(); ++i) {
    const std::size_t hole = base.index[i] - base.index[i - 1] - 1;
    base.gaps += hole > 0;
    base.lost += hole;
  }
  return base;
}

TimeBase uniform_time_base(std::size_t rows, double period) {
  TimeBase base;
  base.period = period;
  base.samples = rows;
  for (std::size_t i = 0; i < rows; ++i) base.index.push_back(i);
  return base;
}

}  // namespace vcnc
