#include "diagnosis/records/series.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/records/record.hpp"

namespace vcnc {

void hold_over_gaps(std::vector<double>& series) {
  const auto first = std::find_if(series.begin(), series.end(), [](double x) { return x == x; });
  double last = first == series.end() ? 0 : *first;
  for (double& x : series) {
    if (std::isfinite(x)) last = x;
    x = last;
  }
}

std::vector<double> moving_mean(const std::vector<double>& series, std::size_t reach) {
  std::vector<double> result(series.size(), kMissing);
  double sum = 0, n = 0;
  const auto count = [&](std::size_t k, int by) {
    if (std::isfinite(series[k])) sum += by * series[k], n += by;
  };
  for (std::size_t k = 0; k < std::min(series.size(), reach); ++k) count(k, 1);
  for (std::size_t k = 0; k < series.size(); ++k) {
    if (k + reach < series.size()) count(k + reach, 1);
    if (k > reach) count(k - reach - 1, -1);
    if (std::isfinite(series[k])) result[k] = sum / n;
  }
  return result;
}

std::vector<double> first_derivative(const std::vector<double>& series, double period) {
  std::vector<double> slope(series.size(), kMissing);
  for (std::size_t k = 1; k + 1 < series.size(); ++k)
    slope[k] = (series[k + 1] - series[k - 1]) / (2 * period);
  return slope;
}

std::vector<double> second_derivative(const std::vector<double>& series, double period) {
  std::vector<double> result(series.size(), kMissing);
  for (std::size_t k = 1; k + 1 < series.size(); ++k)
    result[k] = (series[k + 1] - 2 * series[k] + series[k - 1]) / (period * period);
  return result;
}

double mean_square(const std::vector<double>& series) {
  double sum = 0, n = 0;
  for (const double x : series)
    if (std::isfinite(x)) sum += x * x, n += 1;
  return n > 0 ? sum / n : 0;
}

double mean_square_off_mean(const std::vector<double>& series, std::size_t reach) {
  std::vector<double> off = moving_mean(series, reach);
  for (std::size_t k = 0; k < off.size(); ++k) off[k] -= series[k];
  return mean_square(off);
}

std::vector<double> with_mean_of(const std::vector<double>& other, std::vector<double> series) {
  double sum = 0, n = 0;
  for (std::size_t k = 0; k < std::min(other.size(), series.size()); ++k)
    if (const double d = other[k] - series[k]; std::isfinite(d)) sum += d, n += 1;
  if (n > 0)
    for (double& x : series) x += sum / n;
  return series;
}

}  // namespace vcnc
