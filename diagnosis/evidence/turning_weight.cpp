#include "diagnosis/evidence/turning_weight.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace vcnc {
namespace {

constexpr double kTurningMean = 0.005, kTurningReach = 0.010;  // [s]
constexpr double kUsualRange = 3;                              ///< times the median

std::size_t samples_in(double time, double period) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::round(time / period)));
}

/// f(first, last) of what is within `reach` of every sample.
template <class F>
std::vector<double> around(const std::vector<double>& x, std::size_t reach, F&& f) {
  std::vector<double> all(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const auto begin = x.begin() + static_cast<std::ptrdiff_t>(k - std::min(k, reach));
    const auto end = x.begin() + static_cast<std::ptrdiff_t>(std::min(x.size(), k + reach + 1));
    all[k] = f(begin, end);
  }
  return all;
}

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

template <class It>
double mean_of_known(It begin, It end) {
  double sum = 0, n = 0;
  for (; begin != end; ++begin)
    if (std::isfinite(*begin)) sum += *begin, n += 1;
  return n > 0 ? sum / n : kNotKnown;
}

template <class It>
double range_of_known(It begin, It end) {
  double low = kNotKnown, high = kNotKnown;
  for (; begin != end; ++begin) low = std::fmin(low, *begin), high = std::fmax(high, *begin);
  return high - low;
}

double median_of_known(std::vector<double> x) {
  std::erase_if(x, [](double v) { return !std::isfinite(v); });
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

}  // namespace

std::vector<float> turning_weight(const std::vector<double>& deviation, double sigma,
                                  double period) {
  const auto mean = [](auto begin, auto end) { return mean_of_known(begin, end); };
  const auto range = [](auto begin, auto end) { return range_of_known(begin, end); };
  const std::vector<double> smooth = around(deviation, samples_in(kTurningMean, period) / 2, mean),
                            goes = around(smooth, samples_in(kTurningReach, period), range);
  const double usual = kUsualRange * median_of_known(goes);
  std::vector<float> weight(deviation.size(), 1.0F);
  for (std::size_t k = 0; k < weight.size(); ++k)
    if (goes[k] > usual)
      weight[k] = static_cast<float>(1 / std::hypot(1, (goes[k] - usual) / sigma));
  return weight;
}

}  // namespace vcnc
