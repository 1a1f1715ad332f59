#include "diagnosis/quadrature_lag.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace vcnc {

namespace {

constexpr long kMostLag = 100;  // samples
constexpr long kOfLag = 5000;   // samples that are looked at
constexpr double kLagLeaves = 0.6, kEllipse = 0.05;
constexpr double kOffEllipse = 1e-3;   ///< rms of the equation, of which a lag can be told
constexpr double kInQuadrature = 0.7;  ///< correlation of the two, at most

struct EllipseFit {
  double residual = HUGE_VAL;  ///< rms of the equation, whose sides are 1
  double correlation = 1;      ///< of cosine and sine
};

EllipseFit ellipse_fit(const std::vector<double>& cosine, const std::vector<double>& sine,
                       long lag) {
  using Row = Eigen::Matrix<double, 5, 1>;
  const auto n = static_cast<long>(cosine.size());
  const long stride = std::max(1L, (n - 2 * kMostLag) / kOfLag);
  const auto pair_at = [&](long k) {
    return Eigen::Vector2d(cosine[static_cast<std::size_t>(k)],
                           sine[static_cast<std::size_t>(k + lag)]);
  };
  double count = 0, square = 0;
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (long k = kMostLag; k < n - kMostLag; k += stride) {
    const Eigen::Vector2d p = pair_at(k);
    if (!p.allFinite()) continue;
    ++count, square += p.squaredNorm(), sum += p, spread += p * p.transpose();
  }
  if (count < 100 || !(square > 0)) return {};
  const double size = std::sqrt(square / count);
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Row right = Row::Zero();
  for (long k = kMostLag; k < n - kMostLag; k += stride) {
    const Eigen::Vector2d p = pair_at(k) / size;
    if (!p.allFinite()) continue;
    const Row row(p[0] * p[0], p[0] * p[1], p[1] * p[1], p[0], p[1]);
    normal += row * row.transpose();
    right += row;
  }
  const Row x = normal.ldlt().solve(right);
  const Eigen::Matrix2d about = spread - sum * sum.transpose() / count;
  return {std::sqrt(std::max(0.0, 1 - x.dot(right) / count)),
          std::abs(about(0, 1)) / std::sqrt(about(0, 0) * about(1, 1))};
}

}  // namespace

std::optional<SineLag> sine_lag(const std::vector<double>& cosine,
                                const std::vector<double>& sine) {
  const double without = ellipse_fit(cosine, sine, 0).residual;
  if (!(without > kOffEllipse)) return std::nullopt;
  SineLag best;
  EllipseFit at_best;
  for (long lag = -kMostLag; lag <= kMostLag; ++lag)
    if (const EllipseFit fit = ellipse_fit(cosine, sine, lag); fit.residual < at_best.residual)
      best.samples = lag, at_best = fit;
  best.left = at_best.residual / without;
  if (std::abs(best.samples) == kMostLag || !(best.left < kLagLeaves) ||
      at_best.residual > kEllipse || at_best.correlation > kInQuadrature)
    return std::nullopt;
  return best;
}

}  // namespace vcnc
