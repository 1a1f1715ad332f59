#include "analysis/scan_line.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace vcnc {
namespace {

constexpr double kStationStep = 0.5e-3;    ///< [m]
constexpr double kTiltJump = 1 * kDegree;  ///< larger changes between stations are joints
constexpr double kClosed = 1e-6;           ///< gap under which a line counts as closed [m]

/// Tells the faces of a ruled piece apart by the foot's parameters and normal.
Face face_of(const RuledSurface& mid, const SurfacePoint& foot) {
  const double side = foot.n.dot(mid.normal(foot.u, std::clamp(foot.v, 0.0, 1.0)));
  const bool on_side = std::abs(side) > 1 - 1e-6;
  if (on_side) return side > 0 ? Face::plus : Face::minus;
  return foot.u > (mid.u_min() + mid.u_max()) / 2 ? Face::end_cap : Face::start_cap;
}

std::optional<RuledSurface> mid_surface(const PieceParams& p) {
  if (p.kind != PieceParams::Kind::ruled) return std::nullopt;
  return RuledSurface(BSplineCurve(p.degree, p.knots, p.bottom),
                      BSplineCurve(p.degree, p.knots, p.top));
}

}  // namespace

ScanLine::ScanLine(const Piece& piece, double ball_radius, double interference, double z)
    : stations_(piece.scan_path(ball_radius, interference, z, kStationStep)), z_(z) {
  if (stations_.size() < 2)
    throw std::invalid_argument("the piece has no scan path at this height");
  closed_ = (stations_.front().centre - stations_.back().centre).norm() < kClosed;

  const auto mid = mid_surface(piece.params());
  faces_.assign(stations_.size() - 1, Face::whole);
  if (!mid) return;
  SurfacePoint foot;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    // Half way: the ends of a segment may lie exactly where two faces meet.
    foot = piece.nearest((stations_[i].centre + stations_[i + 1].centre) / 2, foot);
    faces_[i] = face_of(*mid, foot);
    const double t0 = stations_[i].tilt, t1 = stations_[i + 1].tilt;
    const bool side = faces_[i] == Face::plus || faces_[i] == Face::minus;
    const bool jump = std::abs(t1 - t0) > kTiltJump;  // the joint with a cap, no crossing
    if (side && !jump && (t0 <= 0) != (t1 <= 0))
      crossings_.push_back(
          {stations_[i].s + (stations_[i + 1].s - stations_[i].s) * t0 / (t0 - t1), faces_[i]});
  }
}

ScanLine::Projection ScanLine::on_segment(const Vec3& p, std::size_t segment) const {
  const Station& a = stations_[segment];
  const Station& b = stations_[segment + 1];
  const Vec3 d = b.centre - a.centre;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a.centre).dot(d) / length2, 0.0, 1.0) : 0.0;
  return {a.s + t * (b.s - a.s), (a.centre + t * d - p).norm(), segment};
}

ScanLine::Projection ScanLine::project(const Vec3& p) const {
  Projection best = on_segment(p, 0);
  for (std::size_t i = 1; i < faces_.size(); ++i) {
    const Projection here = on_segment(p, i);
    if (here.distance < best.distance) best = here;
  }
  return best;
}

ScanLine::Projection ScanLine::project(const Vec3& p, const Projection& previous) const {
  const std::size_t n = faces_.size();
  const auto next = [&](std::size_t i) { return i + 1 < n ? i + 1 : closed_ ? 0 : i; };
  const auto before = [&](std::size_t i) { return i > 0 ? i - 1 : closed_ ? n - 1 : i; };
  Projection best = on_segment(p, previous.segment);
  for (const bool forward : {true, false}) {
    std::size_t i = previous.segment;
    for (std::size_t steps = 0; steps < n; ++steps) {
      i = forward ? next(i) : before(i);
      const Projection here = on_segment(p, i);
      if (here.distance > best.distance) break;
      best = here;
    }
  }
  return best;
}

}  // namespace vcnc
