// RuledPiece::scan_path: around the rim at constant height. Equations: ruled_piece.hpp.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "model/geometry/ruled_piece.hpp"

namespace vcnc {
namespace {

// The arc-length table: chords of about 0.1 mm, and bounded work for curves of many short spans.
constexpr std::size_t kFineStepsPerSpan = 512, kFewestPerSpan = 64, kFineSteps = 32 * 512;
constexpr std::size_t kFineStepsOfEnd = 1024;

[[noreturn]] void no_path(double z, double v) {
  throw std::invalid_argument("z: a ball centre at " + std::to_string(z * 1e3) +
                              " mm leaves the faces of the piece (v = " + std::to_string(v) +
                              "; allowed 0 to 1)");
}

Vec3 left_of(const Vec3& travel) { return Vec3::UnitZ().cross(travel).normalized(); }

double tilt(const Vec3& ruling, const Vec3& travel) {
  return std::asin(std::clamp(ruling.dot(left_of(travel)), -1.0, 1.0));
}

// One face at constant height: `side` is +1 or -1, travel is along side * u.
class Face {
 public:
  Face(const RuledSurface& surface, double side, double rho, double z)
      : surface_(surface), side_(side), rho_(rho), z_(z) {}

  Station at(double u) {
    const Vec3 n = normal(u);
    const RuledSurface::Point m = surface_.eval(u, v_);
    const Vec3 d = m.s_v.normalized();
    return {0, m.s + rho_ * n, n, d, tilt(d, side_ * surface_.eval(u, 0).s_u)};
  }

 private:
  // Newton for the z of the offset surface, from the previous v; leaves v_ at the solution.
  Vec3 normal(double u) {
    for (int i = 0; i < 30; ++i) {
      const RuledSurface::Point m = surface_.eval(u, v_);
      const Vec3 area = m.s_u.cross(m.s_v), area_v = m.s_uv.cross(m.s_v);
      const double length = area.norm();
      const Vec3 n = side_ * area / length;
      const Vec3 n_v = side_ * (area_v - area * (area.dot(area_v) / (length * length))) / length;
      const double error = m.s.z() + rho_ * n.z() - z_;
      const double slope = m.s_v.z() + rho_ * n_v.z();
      if (!(std::abs(slope) > 0.1 * m.s_v.norm())) no_path(z_, v_);
      const double dv = -error / slope;
      v_ += dv;
      if (std::abs(dv) < 1e-13) {
        if (v_ < 0 || v_ > 1) no_path(z_, v_);
        return side_ * surface_.normal(u, v_);
      }
    }
    no_path(z_, v_);
  }

  const RuledSurface& surface_;
  double side_, rho_, z_;
  double v_ = 0.5;
};

// A round end: phi from 0 (normal of the arriving face) to 1 (normal of the leaving face).
class End {
 public:
  End(const RuledSurface& surface, double u, const Vec3& from, const Vec3& to, double outward,
      double rho, double z)
      : c0_(surface.eval(u, 0).s),
        ruling_(surface.eval(u, 0).s_v),
        d_(ruling_.normalized()),
        from_(from),
        rho_(rho),
        z_(z) {
    Vec3 across = d_.cross(from);
    if (across.dot(outward * surface.eval(u, 0.5).s_u) < 0) across = -across;
    across_ = across;
    turn_ = std::atan2(to.dot(across_), to.dot(from_));
    if (turn_ < 0) turn_ += 2 * kPi;
  }

  Station at(double phi) const {
    const double c = std::cos(phi * turn_), s = std::sin(phi * turn_);
    const Vec3 e = c * from_ + s * across_, travel = c * across_ - s * from_;
    const double v = (z_ - rho_ * e.z() - c0_.z()) / ruling_.z();
    if (v < 0 || v > 1) no_path(z_, v);
    return {0, c0_ + v * ruling_ + rho_ * e, e, d_, tilt(d_, travel)};
  }

 private:
  Vec3 c0_, ruling_, d_, from_, across_;
  double rho_, z_, turn_ = 0;
};

// Appends the stations of one stretch, evenly spaced in arc length, without its first point.
template <class At>
void append(std::vector<Station>& path, At at, double from, double to, std::size_t fine,
            double step) {
  std::vector<double> parameter(fine + 1), length(fine + 1, 0.0);
  Vec3 previous = path.back().centre;
  for (std::size_t i = 0; i <= fine; ++i) {
    parameter[i] = from + (to - from) * (static_cast<double>(i) / static_cast<double>(fine));
    const Vec3 centre = at(parameter[i]).centre;
    if (i > 0) length[i] = length[i - 1] + (centre - previous).norm();
    previous = centre;
  }
  const double start = path.back().s;
  const auto count = static_cast<std::size_t>(std::ceil(length.back() / (step * 0.999)));
  std::size_t j = 1;
  for (std::size_t i = 1; i <= count; ++i) {
    const double s = length.back() * (static_cast<double>(i) / static_cast<double>(count));
    while (j < fine && length[j] < s) ++j;
    const double share = (s - length[j - 1]) / (length[j] - length[j - 1]);
    Station station =
        at(i == count ? to : parameter[j - 1] + share * (parameter[j] - parameter[j - 1]));
    station.s = start + s;
    path.push_back(station);
  }
}

}  // namespace

std::vector<Station> RuledPiece::scan_path(double ball_radius, double interference, double z,
                                           double step) const {
  const double rho = 0.5 * params_.thickness + ball_radius - interference;
  if (!(step > 0)) throw std::invalid_argument("step: must be positive");
  if (!(rho > 0)) throw std::invalid_argument("interference: reaches the middle of the wall");
  const double first = surface_.u_min(), last = surface_.u_max();
  if (!(surface_.ruling(first).z() > 0.5 && surface_.ruling(last).z() > 0.5))
    throw std::invalid_argument("bottom_mm, top_mm: the end rulings must be within 60 deg of z");

  const std::size_t spans = surface_.span_count();
  const std::size_t fine =
      spans * std::clamp(kFineSteps / spans, kFewestPerSpan, kFineStepsPerSpan);
  Face plus(surface_, 1, rho, z), minus(surface_, -1, rho, z);
  std::vector<Station> path{plus.at(first)};
  append(
      path, [&](double u) { return plus.at(u); }, first, last, fine, step);
  const End end_last(surface_, last, path.back().n, minus.at(last).n, 1, rho, z);
  append(
      path, [&](double phi) { return end_last.at(phi); }, 0, 1, kFineStepsOfEnd, step);
  append(
      path, [&](double u) { return minus.at(u); }, last, first, fine, step);
  const End end_first(surface_, first, path.back().n, path.front().n, -1, rho, z);
  append(
      path, [&](double phi) { return end_first.at(phi); }, 0, 1, kFineStepsOfEnd, step);
  return path;
}

}  // namespace vcnc
