#include "analysis/circular.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "model/math.hpp"

namespace vcnc {
namespace {

constexpr double kMaskNear = 1 * kDegree, kMaskFar = 8 * kDegree;

/// Least squares of dR over the first `N` of 1, cos, sin, cos 2, sin 2.
template <int N>
Eigen::Matrix<double, N, 1> fit_harmonics(std::span<const CircularPoint> points) {
  Eigen::Matrix<double, N, N> A = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> y = Eigen::Matrix<double, N, 1>::Zero();
  for (const CircularPoint& p : points) {
    const std::array<double, 5> all{1, std::cos(p.phi), std::sin(p.phi), std::cos(2 * p.phi),
                                    std::sin(2 * p.phi)};
    const Eigen::Map<const Eigen::Matrix<double, N, 1>> basis(all.data());
    A += basis * basis.transpose();
    y += basis * p.dR;
  }
  return A.ldlt().solve(y);
}

bool goes_around(std::span<const CircularPoint> points) {
  std::array<bool, 12> sector{};
  for (const CircularPoint& p : points) {
    const double turn = p.phi / (2 * kPi);
    const auto i = static_cast<std::size_t>((turn - std::floor(turn)) * 12);
    sector[std::min<std::size_t>(i, 11)] = true;
  }
  return points.size() >= 16 && std::all_of(sector.begin(), sector.end(), [](bool b) { return b; });
}

/// Value at angle zero of the straight line through (x, y) pairs.
std::optional<double> line_at_zero(const std::vector<std::pair<double, double>>& xy) {
  if (xy.size() < 4) return std::nullopt;
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& [x, y] : xy) n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  const double det = n * sxx - sx * sx;
  if (det <= 0) return std::nullopt;
  return (sy * sxx - sx * sxy) / det;
}

std::optional<double> step_at(std::span<const CircularPoint> points, double phi_q, int direction) {
  std::vector<std::pair<double, double>> before, after;
  for (const CircularPoint& p : points) {
    const double d = direction * std::remainder(p.phi - phi_q, 2 * kPi);
    if (std::abs(d) < kMaskNear || std::abs(d) > kMaskFar) continue;
    (d < 0 ? before : after).emplace_back(d, p.dR);
  }
  const auto a = line_at_zero(after), b = line_at_zero(before);
  if (!a || !b) return std::nullopt;
  return *a - *b;
}

}  // namespace

std::optional<CircularResult> evaluate_circle(std::span<const CircularPoint> points,
                                              int direction) {
  if (!goes_around(points)) return std::nullopt;
  const auto centre = fit_harmonics<3>(points);
  const auto second = fit_harmonics<5>(points);
  CircularResult r{.mean = centre(0),
                   .centre_x = centre(1),
                   .centre_y = centre(2),
                   .cos2 = second(3),
                   .sin2 = second(4),
                   .step = {}};
  bool first = true;
  for (const CircularPoint& p : points) {
    const double d = p.dR - r.centre_x * std::cos(p.phi) - r.centre_y * std::sin(p.phi);
    r.F_max = first ? d : std::max(r.F_max, d);
    r.F_min = first ? d : std::min(r.F_min, d);
    first = false;
  }
  r.G = r.F_max - r.F_min;
  for (std::size_t q = 0; q < 4; ++q)
    r.step[q] = step_at(points, static_cast<double>(q) * kPi / 2, direction);
  return r;
}

}  // namespace vcnc
