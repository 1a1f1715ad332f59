#include "tests/bench/plan_programs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "configs/config.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"

namespace vcnc {
namespace {

constexpr double kTolerance = 10e-6;

/// Text of a program, point by point.
class Text {
 public:
  explicit Text(bool five_axis) : text_(five_axis ? "G64 P0.01\nG43.4 H1\n" : "G64 P0.01\n") {}

  Text& line(const std::string& words) {
    text_ += words + "\n";
    return *this;
  }
  Text& xyz(double x_mm, double y_mm, double z_mm, const std::string& more = "") {
    return line(fmt::format("X{:.5f} Y{:.5f} Z{:.5f}{}", x_mm, y_mm, z_mm, more));
  }
  PlanProgram done(const std::string& name, bool corners = false) const {
    return {name, text_ + "M30\n", kTolerance, corners};
  }

 private:
  std::string text_;
};

std::string rotary(const RotaryPair& r) {
  return fmt::format(" A{:.6f} C{:.6f}", r.a / kDegree, r.c / kDegree);
}

/// A square spiral inwards, corners of 90 deg.
PlanProgram square_spiral() {
  Text text(false);
  text.line("G1 F20000");
  double x = 0, y = 0;
  for (int i = 0; i < 40; ++i) {
    const double side = 80 - 2.0 * (i / 2);
    (i % 2 ? y : x) += i % 4 < 2 ? side : -side;
    text.xyz(x, y, 0);
  }
  return text.done("square spiral", true);
}

/// Lines that meet at sharp angles.
PlanProgram star() {
  Text text(false);
  text.line("G1 F20000");
  for (int i = 0; i <= 35; ++i) {
    const double angle = i * 2 * kPi * 17 / 35;
    text.xyz(40 * (1 - std::cos(angle)), 40 * std::sin(angle), 0);
  }
  return text.done("star", true);
}

/// Slots: lines joined by half circles.
PlanProgram slots() {
  Text text(false);
  text.line("G1 F12000");
  for (int i = 0; i < 12; ++i) {
    const double y = 6.0 * i;
    text.line(fmt::format("G1 X{:.3f} Y{:.3f}", i % 2 ? 0.0 : 60.0, y));
    text.line(fmt::format("G{} X{:.3f} Y{:.3f} I0 J3", i % 2 ? 2 : 3, i % 2 ? 0.0 : 60.0, y + 6));
  }
  return text.done("slots with arcs");
}

/// Points 0.2 mm apart on an oval with waves.
PlanProgram contour() {
  Text text(false);
  text.line("G1 F8000");
  const auto radius = [](double t) { return 40 + 3 * std::cos(9 * t); };
  for (int i = 1; i <= 1400; ++i) {
    const double t = 2 * kPi * i / 1400;
    text.xyz(radius(t) * std::cos(t) - 43, radius(t) * std::sin(t), 0);
  }
  return text.done("contour of points");
}

/// Rows over a waved surface, points 0.5 mm apart, small steps between the rows.
PlanProgram surface() {
  Text text(false);
  text.line("G1 F10000");
  for (int row = 0; row < 12; ++row)
    for (int i = 0; i <= 160; ++i) {
      const double x = 0.5 * (row % 2 ? 160 - i : i), y = 1.0 * row;
      text.xyz(x, y, 4 * std::sin(x / 9) * std::sin(y / 7 + 0.3 * x / 9));
    }
  return text.done("surface in rows");
}

/// Random corners, 2 to 20 mm apart.
PlanProgram corners() {
  Text text(false);
  text.line("G1 F15000");
  std::mt19937_64 random(3);
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  double x = 0, y = 0, z = 0, heading = 0;
  for (int i = 0; i < 150; ++i) {
    heading += uniform(-2, 2);
    const double way = uniform(2, 20);
    x = std::clamp(x + way * std::cos(heading), -150.0, 150.0);
    y = std::clamp(y + way * std::sin(heading), -150.0, 150.0);
    z = uniform(-3, 3);
    text.xyz(x, y, z);
  }
  return text.done("random corners", true);
}

PlanProgram tip_at_rest() {
  Text text(true);
  text.line("G0 X50 Y30 Z20 A10 C0");
  text.line("G1 F3000");
  for (const auto& [a, c] : {std::pair{25, 90}, {5, 150}, {30, 60}, {12, -40}, {20, 0}})
    text.line(fmt::format("A{} C{}", a, c));
  return text.done("tip at rest");
}

PlanProgram circle_with_c() {
  Text text(true);
  text.line("G0 X60 Y0 Z20 A15 C0");
  text.line("G3 X60 Y0 I-60 J0 A15 C360 F4000");
  text.line("G3 X60 Y0 I-60 J0 A15 C720");
  return text.done("circle, C follows");
}

/// Points p(t) with tool axis d(t), t from 0 to 1.
template <class PointAt>
PlanProgram axes_along(const std::string& name, double feed_mm_min, int points, PointAt at) {
  Text text(true);
  auto [p, d] = at(0.0);
  RotaryPair r{std::acos(std::clamp(d.z(), -1.0, 1.0)), std::atan2(d.x(), -d.y())};
  for (int i = 0; i <= points; ++i) {
    std::tie(p, d) = at(static_cast<double>(i) / points);
    r = rotary_from_axis(d, r);
    if (i == 1) text.line(fmt::format("G1 F{:.0f}", feed_mm_min));
    text.xyz(p.x() * 1e3, p.y() * 1e3, p.z() * 1e3, rotary(r) + (i == 0 ? " G0" : ""));
  }
  return text.done(name);
}

/// NAS 979: flank milling of a cone with half apex `half`, tilted by `tilt` [deg].
PlanProgram cone(double half, double tilt) {
  const double cone = half * kDegree, beta = tilt * kDegree;
  const Vec3 a(0, -std::sin(beta), std::cos(beta)), e1 = Vec3::UnitX(), e2 = a.cross(e1);
  return axes_along(fmt::format("cone {:g}/{:g}", half, tilt), 2000, 720, [&](double t) {
    const double psi = 2 * kPi * t + 0.4;
    const Vec3 r = std::cos(psi) * e1 + std::sin(psi) * e2;
    const Vec3 p = Vec3(0, 0, 0.03) + 0.05 * r;
    return std::pair{p, Vec3(std::cos(cone) * a - std::sin(cone) * r)};
  });
}

/// The tool axis passes the pole at `distance` [deg] while the tip runs straight on.
PlanProgram pole(double distance) {
  return axes_along(fmt::format("pole at {:g} deg", distance), 2000, 1200, [&](double t) {
    const Vec3 d(std::tan(10 * kDegree * (2 * t - 1)), std::tan(distance * kDegree), 1);
    return std::pair{Vec3(0.12 * t - 0.06, 0.02, 0.03), Vec3(d.normalized())};
  });
}

PlanProgram s_piece(int points) {
  const auto piece =
      make_piece(load_piece(std::string(VCNC_SOURCE_DIR) + "/configs/pieces/s_eq1.toml"));
  const std::vector<Station> stations = piece->scan_path(4e-3, 0.5e-3, 0.02, 2e-5);
  return axes_along(fmt::format("S-EQ1 {} points", points), 2000, points, [&](double t) {
    const double s = t * stations.back().s;
    const auto next =
        std::lower_bound(stations.begin() + 1, stations.end() - 1, s,
                         [](const Station& station, double at) { return station.s < at; });
    const Station &right = *next, &left = *(next - 1);
    const double share = (s - left.s) / (right.s - left.s);
    return std::pair{
        Vec3(left.centre + share * (right.centre - left.centre)),
        Vec3((left.tool_axis + share * (right.tool_axis - left.tool_axis)).normalized())};
  });
}

}  // namespace

Machine three_axis_machine() {
  Machine machine;
  for (const std::size_t i : {kX, kY, kZ}) machine.axes[i].limits = {-1, 1, 0, 0.5, 5, 50};
  machine.probe.in_spindle = false;
  return machine;
}

std::vector<PlanProgram> three_axis_programs() {
  return {square_spiral(), star(), slots(), contour(), surface(), corners()};
}

Machine five_axis_machine() {
  Machine machine = load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml");
  for (const std::size_t i : {kA, kC}) {
    AxisLimits& limits = machine.axes[i].limits;
    limits.velocity = 60 * kDegree;
    limits.acceleration = 600 * kDegree;
    limits.jerk = 6000 * kDegree;
  }
  machine.probe.in_spindle = false;
  return machine;
}

std::vector<PlanProgram> five_axis_programs() {
  return {tip_at_rest(), circle_with_c(), cone(15, 15), cone(15, 30), cone(45, 10), pole(0),
          pole(0.05),    pole(0.5),       pole(2),      s_piece(250), s_piece(2000)};
}

}  // namespace vcnc
