#include "analysis/features.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "model/math.hpp"

namespace vcnc {
namespace {

double number(std::size_t n) { return static_cast<double>(n); }

/// Least squares over functions of x: fill(x, row) writes their values.
template <class Fill>
Eigen::VectorXd fit(const Curve& curve, Eigen::Index functions, Fill&& fill) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(functions, functions);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(functions), row(functions);
  for (std::size_t i = 0; i < curve.size(); ++i) {
    fill(curve.x[i], row);
    normal += row * row.transpose();
    right += row * curve.y[i];
  }
  return normal.completeOrthogonalDecomposition().solve(right);
}

/// Angle into -pi .. pi.
double wrapped(double angle) { return std::remainder(angle, 2 * kPi); }

}  // namespace

double mean(const Curve& curve) {
  double sum = 0;
  for (const double y : curve.y) sum += y;
  return curve.y.empty() ? 0 : sum / number(curve.size());
}

double rms(const Curve& curve) {
  double sum = 0;
  for (const double y : curve.y) sum += y * y;
  return curve.y.empty() ? 0 : std::sqrt(sum / number(curve.size()));
}

double scatter(const Curve& curve) {
  const double m = mean(curve);
  double sum = 0;
  for (const double y : curve.y) sum += (y - m) * (y - m);
  return curve.y.empty() ? 0 : std::sqrt(sum / number(curve.size()));
}

double peak_to_peak(const Curve& curve) {
  if (curve.y.empty()) return 0;
  const auto [low, high] = std::minmax_element(curve.y.begin(), curve.y.end());
  return *high - *low;
}

double max_abs(const Curve& curve) {
  double most = 0;
  for (const double y : curve.y) most = std::max(most, std::abs(y));
  return most;
}

Trend trend(const Curve& curve) {
  // About the middle: a long way from x = 0 the sums would cancel.
  double middle = 0;
  for (const double x : curve.x) middle += x;
  if (!curve.x.empty()) middle /= number(curve.size());
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    xx += (curve.x[i] - middle) * (curve.x[i] - middle);
    xy += (curve.x[i] - middle) * curve.y[i];
  }
  const double slope = xx > 0 ? xy / xx : 0;
  return {mean(curve) - slope * middle, slope};
}

double Wave::amplitude() const { return std::hypot(cosine, sine); }
double Wave::phase() const { return std::atan2(cosine, sine); }

Wave wave(const Curve& curve, double period) {
  const Eigen::VectorXd c = fit(curve, 3, [&](double x, Eigen::VectorXd& row) {
    const double angle = 2 * kPi * x / period;
    row << 1, std::cos(angle), std::sin(angle);
  });
  return {c[0], c[1], c[2]};
}

Wave harmonic(const Curve& curve, int k) {
  const Eigen::VectorXd c = fit(curve, 1 + 2 * k, [&](double x, Eigen::VectorXd& row) {
    row[0] = 1;
    for (int i = 1; i <= k; ++i) {
      row[2 * i - 1] = std::cos(i * x);
      row[2 * i] = std::sin(i * x);
    }
  });
  return {c[0], k > 0 ? c[2 * k - 1] : 0, k > 0 ? c[2 * k] : 0};
}

std::optional<double> step_at(const Curve& curve, double at, double inner, double outer) {
  if (curve.size() < 2) return std::nullopt;
  Curve before, behind;
  // The sense of travel: by the sum of small steps, as the angle may be wrapped.
  double travel = 0;
  for (std::size_t i = 1; i < curve.size(); ++i) travel += wrapped(curve.x[i] - curve.x[i - 1]);
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double gone = std::copysign(1.0, travel) * wrapped(curve.x[i] - at);
    if (std::abs(gone) < inner || std::abs(gone) > outer) continue;
    (gone < 0 ? before : behind).add(gone, curve.y[i]);
  }
  if (before.size() < 3 || behind.size() < 3) return std::nullopt;
  return trend(behind).offset - trend(before).offset;
}

std::optional<double> spike_at(const Curve& curve, double at, double reach) {
  Curve near;
  for (std::size_t i = 0; i < curve.size(); ++i)
    if (const double gone = wrapped(curve.x[i] - at); std::abs(gone) <= reach)
      near.add(gone, curve.y[i]);
  Curve edges;
  for (std::size_t i = 0; i < near.size(); ++i)
    if (std::abs(near.x[i]) > 0.8 * reach) edges.add(near.x[i], near.y[i]);
  if (edges.size() < 2) return std::nullopt;
  const Trend line = trend(edges);
  double most = 0;
  for (std::size_t i = 0; i < near.size(); ++i) {
    const double off = near.y[i] - line.offset - line.slope * near.x[i];
    if (std::abs(off) > std::abs(most)) most = off;
  }
  return most;
}

namespace {

/// A curve as a function of its sorted abscissa.
class Interpolation {
 public:
  explicit Interpolation(const Curve& curve) {
    for (std::size_t i = 0; i < curve.size(); ++i) points_.emplace_back(curve.x[i], curve.y[i]);
    std::stable_sort(points_.begin(), points_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
  }
  std::optional<double> at(double x) const {
    if (points_.empty() || x < points_.front().first || x > points_.back().first)
      return std::nullopt;
    auto right =
        std::lower_bound(points_.begin(), points_.end(), x,
                         [](const auto& point, double value) { return point.first < value; });
    if (right == points_.begin()) return right->second;
    const auto left = right - 1;
    const double way = right->first - left->first;
    const double share = way > 0 ? (x - left->first) / way : 0;
    return left->second + share * (right->second - left->second);
  }

 private:
  std::vector<std::pair<double, double>> points_;
};

}  // namespace

std::optional<double> mean_difference(const Curve& first, const Curve& second) {
  const Curve off = difference(second, first);
  if (off.size() == 0) return std::nullopt;
  return mean(off);
}

Curve difference(const Curve& with, const Curve& without) {
  Curve result;
  result.label = with.label;
  if (with.x == without.x) {
    for (std::size_t i = 0; i < with.size(); ++i) result.add(with.x[i], with.y[i] - without.y[i]);
    return result;
  }
  const Interpolation other(without);
  for (std::size_t i = 0; i < with.size(); ++i)
    if (const auto y = other.at(with.x[i])) result.add(with.x[i], with.y[i] - *y);
  return result;
}

std::optional<double> growth_exponent(std::span<const double> speed,
                                      std::span<const double> value) {
  Curve logs;
  for (std::size_t i = 0; i < std::min(speed.size(), value.size()); ++i)
    if (speed[i] > 0 && value[i] != 0) logs.add(std::log(speed[i]), std::log(std::abs(value[i])));
  if (logs.size() < 2 || peak_to_peak({"", logs.x, logs.x}) <= 0) return std::nullopt;
  return trend(logs).slope;
}

}  // namespace vcnc
