#include "model/geometry/ruled_piece.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace vcnc {
namespace {

constexpr int kSamplesPerSpan = 16;
constexpr std::size_t kMostSpans = 256;  // the search for gaps takes the square of it
// A step this short leaves an error of its square over the radius of curvature: below 1e-12 m.
constexpr double kLastStep = 1e-7;
constexpr int kMaxIterations = 25;
// A point may have moved this far since its hint; further away the search starts anew.
constexpr double kHintReach = 3e-3;

RuledSurface make_surface(const PieceParams& params) {
  const auto curve = [&](const char* key, const std::vector<Vec3>& points) {
    try {
      return BSplineCurve(params.degree, params.knots, points);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(std::string(key) + ": " + error.what());
    }
  };
  return RuledSurface(curve("bottom_mm", params.bottom), curve("top_mm", params.top));
}

// Half of the narrowest gap between parts of the wall that are far apart along it.
double half_gap(const std::vector<Vec3>& middle) {
  std::vector<double> length(middle.size(), 0.0);
  for (std::size_t i = 1; i < middle.size(); ++i)
    length[i] = length[i - 1] + (middle[i] - middle[i - 1]).norm();
  double gap = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < middle.size(); ++i)
    for (std::size_t j = i + 1; j < middle.size(); ++j) {
      const double chord = (middle[j] - middle[i]).norm();
      // On a half circle the way along the wall is 1.57 times the chord.
      if (length[j] - length[i] > 1.5 * chord) gap = std::min(gap, chord);
    }
  return 0.5 * gap;
}

}  // namespace

RuledPiece::RuledPiece(const PieceParams& params)
    : params_(params), surface_(make_surface(params)), warm_reach_(0) {
  if (!(params.thickness > 0)) throw std::invalid_argument("thickness_mm: must be positive");
  if (surface_.span_count() > kMostSpans)
    throw std::invalid_argument("knots: the curves have " + std::to_string(surface_.span_count()) +
                                " spans; allowed are up to " + std::to_string(kMostSpans));
  const auto count = surface_.span_count() * kSamplesPerSpan;
  std::vector<Vec3> middle;
  for (std::size_t i = 0; i <= count; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(count);
    const double u = surface_.u_min() + share * (surface_.u_max() - surface_.u_min());
    const RuledSurface::Point point = surface_.eval(u, 0.5);
    const double length2 = point.s_v.squaredNorm();
    if (!(length2 > 1e-12) || !(point.s_u.cross(point.s_v).norm() > 1e-12))
      throw std::invalid_argument(
          "bottom_mm, top_mm: the surface between the curves degenerates at u = " +
          std::to_string(u));
    samples_.push_back({u, point.s - 0.5 * point.s_v, point.s_v, 1 / length2});
    middle.push_back(point.s);
  }
  // Half of the half gap, since the walls are neither parallel nor equally high.
  warm_reach_ = std::min(0.5 * half_gap(middle), 30e-3);
}

RuledPiece::Foot RuledPiece::refine(const Vec3& p, double u, double v) const {
  const double u_min = surface_.u_min(), u_max = surface_.u_max();
  Foot foot{u, v, Vec3::Zero(), false};
  for (int i = 0; i < kMaxIterations; ++i) {
    const RuledSurface::Point m = surface_.eval(foot.u, foot.v);
    foot.r = m.s - p;
    const double g_u = foot.r.dot(m.s_u), g_v = foot.r.dot(m.s_v);
    const double uu = m.s_u.squaredNorm(), vv = m.s_v.squaredNorm();
    const bool hold_u = (foot.u <= u_min && g_u > 0) || (foot.u >= u_max && g_u < 0);
    const bool hold_v = (foot.v <= 0 && g_v > 0) || (foot.v >= 1 && g_v < 0);
    double h_uu = uu + foot.r.dot(m.s_uu);
    double h_uv = m.s_u.dot(m.s_v) + foot.r.dot(m.s_uv);
    if (h_uu < 0.2 * uu) h_uu = uu;  // beyond the centre of curvature: Gauss-Newton
    double determinant = h_uu * vv - h_uv * h_uv;
    if (determinant < 0.1 * h_uu * vv) {
      h_uv = 0;
      determinant = h_uu * vv;
    }
    double du = 0, dv = 0;
    if (hold_u && !hold_v) {
      dv = -g_v / vv;
    } else if (hold_v && !hold_u) {
      du = -g_u / h_uu;
    } else if (!hold_u) {
      du = (-g_u * vv + g_v * h_uv) / determinant;
      dv = (-g_v * h_uu + g_u * h_uv) / determinant;
    }
    const double span =
        0.1 * (u_max - u_min);  // far from the foot the quadratic model means little
    du = std::clamp(std::clamp(du, -span, span), u_min - foot.u, u_max - foot.u);
    dv = std::clamp(dv, -foot.v, 1 - foot.v);
    foot.u += du;
    foot.v += dv;
    if (du * du * uu + dv * dv * vv < kLastStep * kLastStep) {
      // Carries r along the last step to second order instead of evaluating once more.
      foot.r += m.s_u * du + m.s_v * dv + m.s_uu * (0.5 * du * du) + m.s_uv * (du * dv);
      foot.converged = true;
      return foot;
    }
  }
  return foot;
}

RuledPiece::Foot RuledPiece::search(const Vec3& p) const {
  const auto at = [&](std::size_t i, double& v) {
    const Sample& sample = samples_[i];
    const Vec3 r = p - sample.c0;
    v = std::clamp(r.dot(sample.ruling) * sample.inverse_length2, 0.0, 1.0);
    return (r - v * sample.ruling).squaredNorm();
  };
  Foot best;
  best.r = Vec3::Constant(std::numeric_limits<double>::infinity());
  double v = 0, v_next = 0;
  double before = std::numeric_limits<double>::infinity(), here = at(0, v);
  double closest = before;  // of the samples
  Foot sampled;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const double next =
        i + 1 < samples_.size() ? at(i + 1, v_next) : std::numeric_limits<double>::infinity();
    if (here <= before && here <= next) {
      const Foot foot = refine(p, samples_[i].u, v);
      if (foot.converged && (!best.converged || foot.r.squaredNorm() < best.r.squaredNorm()))
        best = foot;
    }
    if (here < closest) {
      closest = here;
      sampled = {samples_[i].u, v, samples_[i].c0 + v * samples_[i].ruling - p, true};
    }
    before = here;
    here = next;
    v = v_next;
  }
  // Beyond the centre of curvature the nearest part may not converge; another one is not nearest.
  if (!(best.r.norm() <= std::sqrt(closest) + 1e-6)) return sampled;
  return best;
}

SurfacePoint RuledPiece::nearest(const Vec3& p, const SurfacePoint& hint) const {
  const double half = 0.5 * params_.thickness;
  Foot foot;
  const double reach = hint.distance + half + kHintReach;
  if (hint.valid && hint.distance + half < warm_reach_ &&
      (p - hint.foot).squaredNorm() < (reach + half) * (reach + half)) {
    foot = refine(p, hint.u, hint.v);
    if (foot.r.squaredNorm() > reach * reach) foot.converged = false;
  }
  if (!foot.converged) foot = search(p);

  SurfacePoint result;
  result.valid = foot.converged;
  if (!foot.converged) return result;
  const double length = foot.r.norm();
  if (length > 1e-9) {
    result.n = foot.r / -length;
  } else {
    const Vec3 n = surface_.normal(foot.u, foot.v);
    result.n = n.dot(hint.n) < 0 ? Vec3(-n) : n;
  }
  result.distance = length - half;
  result.foot = p - result.distance * result.n;
  result.u = foot.u;
  result.v = foot.v;
  return result;
}

}  // namespace vcnc
