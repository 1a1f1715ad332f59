#include "model/geometry/piece.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "model/geometry/ruled_piece.hpp"

namespace vcnc {
namespace {

[[noreturn]] void fail(const std::string& text) { throw std::invalid_argument(text); }

void check_positive(double value, const char* key) {
  if (!(value > 0) || !std::isfinite(value)) fail(std::string(key) + ": must be positive");
}

Vec3 unit_direction(const PieceParams& params) {
  if (!(params.direction.norm() > 1e-6)) fail("direction: must not be zero");
  return params.direction.normalized();
}

// Ball-centre circle about `axis` through `centre`. Normal and tool axis come as radial (x) and
// axial (z) share.
std::vector<Station> circle(const Vec3& centre, const Vec3& axis, double radius, double step,
                            const Vec3& radial_axial_n, const Vec3& radial_axial_tool) {
  check_positive(step, "step");
  // From the x axis where it can be, so that a level circle starts at angle zero.
  const Vec3 seed = std::abs(axis.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 e1 = (seed - axis * axis.dot(seed)).normalized(), e2 = axis.cross(e1);
  const auto count = static_cast<std::size_t>(std::ceil(2 * kPi * radius / step));
  std::vector<Station> path;
  for (std::size_t i = 0; i <= count; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(count);
    const double angle = i == count ? 0 : 2 * kPi * share;
    const Vec3 radial = std::cos(angle) * e1 + std::sin(angle) * e2;
    const auto mix = [&](const Vec3& ra) { return Vec3(ra.x() * radial + ra.z() * axis); };
    path.push_back({2 * kPi * radius * share, centre + radius * radial, mix(radial_axial_n),
                    mix(radial_axial_tool), 0});
  }
  return path;
}

// The point of the axis whose z coordinate is z.
Vec3 axis_point(const Vec3& centre, const Vec3& axis, double z) {
  if (axis.z() < 0.5) fail("direction: a scan path needs the axis within 60 deg of z");
  return centre + axis * ((z - centre.z()) / axis.z());
}

// A point in the half plane of an axis.
struct Meridian {
  double rho, h;  // distance from the axis, along the axis from the centre
  Vec3 radial;
};
Meridian meridian(const Vec3& p, const Vec3& centre, const Vec3& axis) {
  const Vec3 r = p - centre;
  const double h = r.dot(axis);
  const Vec3 across = r - h * axis;
  const double rho = across.norm();
  return {rho, h, rho > 1e-12 ? Vec3(across / rho) : axis.unitOrthogonal()};
}

class Ring final : public Piece {
 public:
  explicit Ring(const PieceParams& params) : params_(params), axis_(unit_direction(params)) {
    check_positive(params.radius, "radius_mm");
    check_positive(params.height, "height_mm");
  }

  SurfacePoint nearest(const Vec3& p, const SurfacePoint&) const override {
    const Meridian m = meridian(p, params_.centre, axis_);
    const double side = params_.bore ? -1 : 1;                 // outward is along side * radial
    const double out = side * (m.rho - params_.radius);        // beyond the wall
    const double over = std::abs(m.h) - 0.5 * params_.height;  // beyond the ends
    const Vec3 wall = side * m.radial, end = m.h < 0 ? Vec3(-axis_) : axis_;
    SurfacePoint result;
    result.valid = true;
    if (out > 0 && over > 0) {
      result.distance = std::hypot(out, over);
      result.n = (out * wall + over * end) / result.distance;
    } else if (out >= over) {
      result.distance = out;
      result.n = wall;
    } else {
      result.distance = over;
      result.n = end;
    }
    result.foot = p - result.distance * result.n;
    return result;
  }

  std::vector<Station> scan_path(double ball_radius, double interference, double z,
                                 double step) const override {
    const Vec3 at = axis_point(params_.centre, axis_, z);
    if ((at - params_.centre).norm() > 0.5 * params_.height)
      fail("z: beyond the height of the ring");
    const double side = params_.bore ? -1 : 1;
    const double radius = params_.radius + side * (ball_radius - interference);
    if (!(radius > 0)) fail("ball_radius: the ball does not fit into the ring");
    return circle(at, axis_, radius, step, Vec3(side, 0, 0), Vec3::UnitZ());
  }
  double scan_height(const Vec3& p) const override {
    return params_.centre.z() + axis_.dot(p - params_.centre) * axis_.z();
  }
  const PieceParams& params() const override { return params_; }

 private:
  PieceParams params_;
  Vec3 axis_;
};

class Sphere final : public Piece {
 public:
  explicit Sphere(const PieceParams& params) : params_(params) {
    check_positive(params.radius, "radius_mm");
  }

  SurfacePoint nearest(const Vec3& p, const SurfacePoint& hint) const override {
    const Vec3 r = p - params_.centre;
    const double length = r.norm();
    SurfacePoint result;
    result.valid = true;
    result.n = length > 1e-12 ? Vec3(r / length) : hint.n;
    result.distance = length - params_.radius;
    result.foot = p - result.distance * result.n;
    return result;
  }

  std::vector<Station> scan_path(double ball_radius, double interference, double z,
                                 double step) const override {
    const double reach = params_.radius + ball_radius - interference, h = z - params_.centre.z();
    if (!(std::abs(h) < reach)) fail("z: beyond the sphere");
    const double radius = std::sqrt(reach * reach - h * h);
    const Vec3 centre(params_.centre.x(), params_.centre.y(), z);
    return circle(centre, Vec3::UnitZ(), radius, step, Vec3(radius, 0, h) / reach, Vec3::UnitZ());
  }
  const PieceParams& params() const override { return params_; }

 private:
  PieceParams params_;
};

class Plane final : public Piece {
 public:
  explicit Plane(const PieceParams& params) : params_(params), n_(unit_direction(params)) {
    check_positive(params.radius, "radius_mm");
  }

  SurfacePoint nearest(const Vec3& p, const SurfacePoint&) const override {
    SurfacePoint result;
    result.valid = true;
    result.n = n_;
    result.distance = n_.dot(p - params_.centre);
    result.foot = p - result.distance * n_;
    return result;
  }

  std::vector<Station> scan_path(double ball_radius, double interference, double z,
                                 double step) const override {
    check_positive(step, "step");
    Vec3 along = Vec3::UnitX(), middle = params_.centre + (ball_radius - interference) * n_;
    if (std::abs(n_.z()) < 0.999) {
      along = Vec3::UnitZ().cross(n_).normalized();
      const Vec3 up = n_.cross(along);  // steepest line of the plane
      middle += up * ((z - middle.z()) / up.z());
    } else {
      along = (along - n_ * n_.dot(along)).normalized();
    }
    // Face milling where the plane is rather level, flank milling where it is rather upright.
    const Vec3 tool = n_.z() > 0.7 ? n_ : n_.cross(along).normalized();
    const double length = 2 * params_.radius;
    const auto count = static_cast<std::size_t>(std::ceil(length / step));
    std::vector<Station> path;
    for (std::size_t i = 0; i <= count; ++i) {
      const double s = length * static_cast<double>(i) / static_cast<double>(count);
      path.push_back({s, middle + (s - params_.radius) * along, n_, tool, 0});
    }
    return path;
  }
  const PieceParams& params() const override { return params_; }

 private:
  PieceParams params_;
  Vec3 n_;
};

class Cone final : public Piece {
 public:
  explicit Cone(const PieceParams& params)
      : params_(params),
        axis_(unit_direction(params)),
        cos_(std::cos(params.half_angle)),
        sin_(std::sin(params.half_angle)) {
    check_positive(params.radius, "radius_mm");
    check_positive(params.height, "height_mm");
    if (!(cos_ > 0 && sin_ > 0)) fail("half_angle_deg: must be between 0 and 90");
    if (!(params.radius > params.height * sin_ / cos_))
      fail("height_mm: the cone comes to its apex below this height");
  }

  SurfacePoint nearest(const Vec3& p, const SurfacePoint&) const override {
    const Meridian m = meridian(p, params_.centre, axis_);
    const double top = params_.radius - params_.height * sin_ / cos_;
    const double slant = params_.height / cos_;
    SurfacePoint result;
    result.valid = true;
    // Inside the frustum the nearest of three flat faces counts, outside the nearest of three
    // segments.
    const double side = (m.rho - params_.radius) * cos_ + m.h * sin_;
    const double over = m.h - params_.height, under = -m.h;
    const Vec3 side_n = cos_ * m.radial + sin_ * axis_;
    if (side <= 0 && over <= 0 && under <= 0) {
      result.distance = std::max({side, over, under});
      result.n = result.distance == side ? side_n : result.distance == over ? axis_ : Vec3(-axis_);
      result.foot = p - result.distance * result.n;
      return result;
    }
    struct Candidate {
      double rho, h;
    };
    const double along = std::clamp((params_.radius - m.rho) * sin_ + m.h * cos_, 0.0, slant);
    const Candidate candidates[] = {{params_.radius - along * sin_, along * cos_},
                                    {std::min(m.rho, top), params_.height},
                                    {std::min(m.rho, params_.radius), 0}};
    const auto distance = [&](const Candidate& c) { return std::hypot(m.rho - c.rho, m.h - c.h); };
    const Candidate* best = &candidates[0];
    for (const Candidate& c : candidates)
      if (distance(c) < distance(*best)) best = &c;
    result.distance = distance(*best);
    result.n =
        result.distance > 1e-12
            ? Vec3(((m.rho - best->rho) * m.radial + (m.h - best->h) * axis_) / result.distance)
            : side_n;
    result.foot = p - result.distance * result.n;
    return result;
  }

  std::vector<Station> scan_path(double ball_radius, double interference, double z,
                                 double step) const override {
    const Vec3 at = axis_point(params_.centre, axis_, z);
    const double h = (at - params_.centre).dot(axis_), reach = ball_radius - interference;
    const double foot = h - reach * sin_;
    if (foot < 0 || foot > params_.height) fail("z: beyond the flank of the cone");
    const double radius = params_.radius + (reach - h * sin_) / cos_;
    return circle(at, axis_, radius, step, Vec3(cos_, 0, sin_), Vec3(-sin_, 0, cos_));
  }
  double scan_height(const Vec3& p) const override {
    return params_.centre.z() + axis_.dot(p - params_.centre) * axis_.z();
  }
  const PieceParams& params() const override { return params_; }

 private:
  PieceParams params_;
  Vec3 axis_;
  double cos_, sin_;
};

}  // namespace

std::unique_ptr<Piece> make_piece(const PieceParams& params) {
  switch (params.kind) {
    case PieceParams::Kind::ruled:
      return std::make_unique<RuledPiece>(params);
    case PieceParams::Kind::ring:
      return std::make_unique<Ring>(params);
    case PieceParams::Kind::sphere:
      return std::make_unique<Sphere>(params);
    case PieceParams::Kind::plane:
      return std::make_unique<Plane>(params);
    case PieceParams::Kind::cone:
      return std::make_unique<Cone>(params);
  }
  fail("kind: unknown kind of piece");
}

}  // namespace vcnc
