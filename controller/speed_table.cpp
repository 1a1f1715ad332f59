#include "controller/speed_table.hpp"

#include <algorithm>
#include <utility>

namespace vcnc {

SpeedTable::SpeedTable(std::vector<LawPoint> points, double duration)
    : points_(std::move(points)), duration_(duration) {}

LawPoint SpeedTable::at(double t) const {
  if (t <= 0) return points_.front();
  if (t >= duration_) return points_.back();
  const auto cells = static_cast<double>(points_.size() - 1);
  const double h = duration_ / cells, place = std::clamp(t / h, 0.0, cells);
  const std::size_t i = std::min(static_cast<std::size_t>(place), points_.size() - 2);
  const double u = place - static_cast<double>(i);
  const LawPoint &p = points_[i], &q = points_[i + 1];
  // s = s0 + v0 u + a0 u^2 / 2 + u^3 (k3 + k4 u + k5 u^2), time in steps
  const double v0 = h * p.ds, v1 = h * q.ds, a0 = h * h * p.dds, a1 = h * h * q.dds;
  const double e0 = q.s - p.s - v0 - 0.5 * a0, e1 = v1 - v0 - a0, e2 = a1 - a0;
  const double k3 = 10 * e0 - 4 * e1 + 0.5 * e2;
  const double k4 = -15 * e0 + 7 * e1 - e2;
  const double k5 = 6 * e0 - 3 * e1 + 0.5 * e2;
  const double u2 = u * u;
  return {p.s + u * (v0 + 0.5 * a0 * u) + u2 * u * (k3 + u * (k4 + u * k5)),
          (v0 + a0 * u + u2 * (3 * k3 + u * (4 * k4 + 5 * k5 * u))) / h,
          (a0 + u * (6 * k3 + u * (12 * k4 + 20 * k5 * u))) / (h * h)};
}

}  // namespace vcnc
