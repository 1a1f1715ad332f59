#include "controller/program_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "controller/planner_limits.hpp"
#include "model/geometry/kinematics.hpp"

namespace vcnc {
namespace {

constexpr double kStationStep = 5e-5;                    ///< of scan_path before thinning [m]
constexpr double kAngleChordTolerance = 2e-3 * kDegree;  ///< of the tool axis between two points
constexpr double kLongestChord = 2e-3;                   ///< [m]

[[noreturn]] void fail(const std::string& reason) { throw std::invalid_argument(reason); }

void check_positive(double value, const char* name) {
  if (!(value > 0)) fail(fmt::format("{} must be greater than 0, not {}", name, value));
}

void check_options(const ProgramOptions& o) {
  check_positive(o.feed_mm_min, "feed_mm_min");
  check_positive(o.approach_feed_mm_min, "approach_feed_mm_min");
  check_positive(o.tolerance_um, "tolerance_um");
  check_positive(o.chord_tolerance_um, "chord_tolerance_um");
  check_positive(o.approach_mm, "approach_mm");
  check_positive(o.clearance_mm, "clearance_mm");
  if (!(o.settle_s >= 0)) fail("settle_s must not be negative");
  if (!(o.run_in_mm >= 0)) fail("run_in_mm must not be negative");
  if (o.laps < 1 || o.laps > 1000) fail("laps must be 1 to 1000");
}

double predeflection(const Machine& machine, const ProgramOptions& o) {
  const double value =
      o.predeflection_mm ? *o.predeflection_mm * 1e-3 : machine.setup.predeflection;
  if (!(value >= 0 && value < machine.probe.ball_radius))
    fail("predeflection_mm must be at least 0 and less than the ball radius");
  return value;
}

// ------------------------------------------------------------------------------------ text blocks

std::string header(const std::string& what, const Machine& machine, const ProgramOptions& o) {
  return fmt::format(
      "%\n"
      "({})\n"
      "(Machine: {}. Units: mm, deg, mm/min.)\n"
      "(Feed F{:g}, path tolerance {:g} um.)\n",
      what, machine.name, o.feed_mm_min, o.tolerance_um);
}

std::string modes(const ProgramOptions& o, int plane) {
  return fmt::format("G54 G90 G{} G21 G94 G40 G49\nG64 P{:.5f}\nM19 (spindle oriented, at rest)\n",
                     plane, o.tolerance_um * 1e-3);
}

std::string lift() { return "G49\nG91\nG28 Z0\n"; }
std::string go_home() { return lift() + "G28 X0 Y0\nG28 A0 C0\nG90\nM30\n"; }

/// A decimal without "-0.00000".
std::string decimal(double value, int digits) {
  std::string text = fmt::format("{:.{}f}", value, digits);
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text;
}

std::string point(const Vec3& p) {
  return fmt::format("X{} Y{} Z{}", decimal(p.x() * 1e3, 5), decimal(p.y() * 1e3, 5),
                     decimal(p.z() * 1e3, 5));
}

std::string angles(const RotaryPair& r) {
  return fmt::format("A{} C{}", decimal(r.a / kDegree, 6), decimal(r.c / kDegree, 6));
}

// ------------------------------------------------------------------------------------- scan laps

/// One station with its rotary positions as the control counts them.
struct Pose {
  Vec3 p, n;
  RotaryPair rotary;
};

/// Stations from `from` on (arc length, may be negative) over `length`, on a closed path.
std::vector<Station> unroll(const std::vector<Station>& closed, double from, double length) {
  const double lap = closed.back().s;
  std::vector<Station> open;
  for (double base = lap * std::floor(from / lap); base < from + length; base += lap)
    for (std::size_t i = 0; i + 1 < closed.size(); ++i) {
      const double s = base + closed[i].s;
      if (s < from || s > from + length) continue;
      open.push_back(closed[i]);
      open.back().s = s;
    }
  return open;
}

std::vector<Pose> poses(const std::vector<Station>& stations, const Machine& machine) {
  const double sign_a = machine.kinematics.a_reversed ? -1 : 1;
  const double sign_c = machine.kinematics.c_reversed ? -1 : 1;
  // The solution with A >= 0 and C within half a turn to begin with.
  const Vec3& d = stations.front().tool_axis;
  RotaryPair iso{std::acos(std::clamp(d.z(), -1.0, 1.0)), std::atan2(d.x(), -d.y())};
  std::vector<Pose> result;
  result.reserve(stations.size());
  for (const Station& station : stations) {
    iso = rotary_from_axis(station.tool_axis, iso);
    result.push_back({station.centre, station.n, {sign_a * iso.a, sign_c * iso.c}});
  }
  return result;
}

/// Whether every pose between `first` and `last` lies on the straight line between these.
bool chord_holds(const std::vector<Pose>& poses, std::size_t first, std::size_t last,
                 double tolerance) {
  const Pose &a = poses[first], &b = poses[last];
  const Vec3 chord = b.p - a.p;
  const double length2 = chord.squaredNorm();
  if (length2 > kLongestChord * kLongestChord) return false;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double share = std::clamp((poses[i].p - a.p).dot(chord) / length2, 0.0, 1.0);
    if ((a.p + share * chord - poses[i].p).norm() > tolerance) return false;
    const double da = a.rotary.a + share * (b.rotary.a - a.rotary.a) - poses[i].rotary.a;
    const double dc = a.rotary.c + share * (b.rotary.c - a.rotary.c) - poses[i].rotary.c;
    if (std::hypot(da, dc * std::sin(a.rotary.a)) > kAngleChordTolerance) return false;
  }
  return true;
}

std::vector<Pose> thin(const std::vector<Pose>& poses, double tolerance) {
  std::vector<Pose> kept{poses.front()};
  std::size_t first = 0;
  while (first + 1 < poses.size()) {
    std::size_t last = first + 1;
    while (last + 1 < poses.size() && chord_holds(poses, first, last + 1, tolerance)) ++last;
    kept.push_back(poses[last]);
    first = last;
  }
  return kept;
}

std::string scan_program(const std::string& what, const Machine& machine, const Piece& piece,
                         double height_m, const ProgramOptions& o) {
  check_options(o);
  const double interference = predeflection(machine, o);
  const double ball = machine.probe.ball_radius;
  const double z = o.height_mm ? *o.height_mm * 1e-3 : height_m;
  std::vector<Station> closed = piece.scan_path(ball, interference, z, kStationStep);
  if ((closed.front().centre - closed.back().centre).norm() > 1e-9)
    fail("the piece has no closed scan path");
  // Scan paths keep the material to the left of travel: counter-clockwise seen from above.
  if (o.direction == ProgramOptions::Direction::clockwise) {
    const double total = closed.back().s;
    std::reverse(closed.begin(), closed.end());
    for (Station& station : closed) station.s = total - station.s;
  }
  const double lap = closed.back().s, run_in = o.run_in_mm * 1e-3, first = lap / 8;
  const std::vector<Station> stations = unroll(closed, first - run_in, lap + 2 * run_in);
  const std::vector<Pose> path = thin(poses(stations, machine), o.chord_tolerance_um * 1e-6);
  const Pose &begin = path.front(), &end = path.back();
  const Vec3 up(0, 0, o.clearance_mm * 1e-3);
  const double away = (interference + o.approach_mm * 1e-3);

  std::string text = header(what, machine, o);
  text += fmt::format(
      "(Ball radius {:g} mm, pre-deflection {:g} mm, height {:g} mm above the workpiece zero.)\n"
      "({} lap of {:.3f} mm from {:.3f} mm behind the first station; {:g} mm run-in before and\n",
      ball * 1e3, interference * 1e3, z * 1e3,
      o.laps == 1 ? "One" : std::to_string(o.laps) + " times a", lap * 1e3, first * 1e3,
      o.run_in_mm);
  text.pop_back();
  text += fmt::format(" after.)\n({} points, chord tolerance {:g} um.)\n", path.size(),
                      o.chord_tolerance_um);
  text += modes(o, 17);
  for (int n = 0; n < o.laps; ++n) {
    if (n > 0) text += lift() + "G90\n";
    text += fmt::format("G0 {}\n", angles(begin.rotary));
    text += "G43.4 H1 (RTCP: X Y Z are the ball centre in the workpiece)\n";
    text += fmt::format("G0 {}\n", point(begin.p + away * begin.n + up));
    text += fmt::format("G0 {}\n", point(begin.p + away * begin.n));
    text +=
        fmt::format("G1 {} F{:g} (approach along -n)\n", point(begin.p), o.approach_feed_mm_min);
    if (o.settle_s > 0) text += fmt::format("G4 P{:g}\n", o.settle_s);
    for (std::size_t i = 1; i < path.size(); ++i) {
      text += fmt::format("G1 {} {}", point(path[i].p), angles(path[i].rotary));
      if (i == 1) text += fmt::format(" F{:g}", o.feed_mm_min);
      text += '\n';
    }
    if (o.settle_s > 0) text += fmt::format("G4 P{:g}\n", o.settle_s);
    text += fmt::format("G1 {} F{:g} (leave along +n)\n", point(end.p + away * end.n),
                        o.approach_feed_mm_min);
    text += fmt::format("G0 {}\n", point(end.p + away * end.n + up));
  }
  return text + go_home();
}

// ---------------------------------------------------------------------------------------- circle

struct Circle {
  Vec3 centre;    ///< as words of G54 under G43 H1
  double radius;  ///< of the controlled point
  bool inside_ring;
};

Circle choose_circle(const Machine& machine, const Piece* piece, const ProgramOptions& o) {
  const Vec3& offset = machine.setup.work_offset[0];
  if (!piece) {
    if (!o.radius_mm) fail("radius_mm is needed for a circle without a ring");
    check_positive(*o.radius_mm, "radius_mm");
    Vec3 start(machine.axes[kX].limits.start, machine.axes[kY].limits.start,
               machine.axes[kZ].limits.start - machine.tool_length(1));
    return {start - offset, *o.radius_mm * 1e-3, false};
  }
  const PieceParams& ring = piece->params();
  if (ring.kind != PieceParams::Kind::ring || !ring.bore || ring.direction.z() < 0.999999)
    fail("a circle is scanned inside a ring (kind = ring, bore = true) whose axis is z");
  if (o.plane != 17) fail("plane must be 17 for a circle in a ring");
  Vec3 centre = ring.centre;
  if (o.height_mm) centre.z() = *o.height_mm * 1e-3;
  const auto path =
      piece->scan_path(machine.probe.ball_radius, predeflection(machine, o), centre.z(), 1e-2);
  const double radius = (path.front().centre - centre).head<2>().norm();
  return {centre, o.radius_mm ? *o.radius_mm * 1e-3 : radius, true};
}

/// The feed asked for, or what the probe allows of it where the axis starts.
double step_feed(const Machine& machine, const ProgramOptions& o, double scale) {
  const std::optional<ProbingLimit> probing = probing_limit(machine);
  if (!probing) return o.feed_mm_min;
  AxisVector speeds{};
  speeds[o.axis] = o.feed_mm_min * scale / 60;
  const double factor = probing->at(as_axes(start_coordinates(machine)), speeds).factor;
  return factor < 1 ? std::floor(o.feed_mm_min * factor) : o.feed_mm_min;
}

}  // namespace

std::string s_piece_program(const Machine& machine, const Piece& piece,
                            const ProgramOptions& options) {
  const PieceParams& p = piece.params();
  if (p.kind != PieceParams::Kind::ruled) fail("an s-piece program needs a piece of kind = ruled");
  double bottom = 0, top = 0;
  for (const Vec3& point_ : p.bottom) bottom += point_.z() / static_cast<double>(p.bottom.size());
  for (const Vec3& point_ : p.top) top += point_.z() / static_cast<double>(p.top.size());
  return scan_program("Scan around the rim of " + p.name, machine, piece, 0.5 * (bottom + top),
                      options);
}

std::string cone_program(const Machine& machine, const Piece& piece,
                         const ProgramOptions& options) {
  const PieceParams& p = piece.params();
  if (p.kind != PieceParams::Kind::cone) fail("a cone program needs a piece of kind = cone");
  const double middle = p.centre.z() + 0.5 * p.height * p.direction.normalized().z();
  return scan_program("Scan around " + p.name, machine, piece, middle, options);
}

std::string circle_program(const Machine& machine, const Piece* piece, const ProgramOptions& o) {
  check_options(o);
  if (o.plane < 17 || o.plane > 19) fail("plane must be 17, 18 or 19");
  const Circle circle = choose_circle(machine, piece, o);
  const auto normal = static_cast<Eigen::Index>(19 - o.plane);
  const Eigen::Index u = (normal + 1) % 3, v = (normal + 2) % 3;
  const bool clockwise = o.direction == ProgramOptions::Direction::clockwise;
  const double turn = clockwise ? -1 : 1;
  const char* g = clockwise ? "G2" : "G3";
  constexpr double kRunIn = 45 * kDegree;
  const auto at = [&](double angle, double radius) {
    Vec3 p = circle.centre;
    p[u] += radius * std::cos(turn * angle);
    p[v] += radius * std::sin(turn * angle);
    return p;
  };
  const auto arc = [&](const Vec3& from, const Vec3& to, const Vec3& centre) {
    static constexpr const char* kLetters[] = {"I", "J", "K"};
    static constexpr const char* kAxes[] = {"X", "Y", "Z"};
    return fmt::format("{} {}{} {}{} {}{} {}{}", g, kAxes[u], decimal(to[u] * 1e3, 5), kAxes[v],
                       decimal(to[v] * 1e3, 5), kLetters[u],
                       decimal((centre[u] - from[u]) * 1e3, 5), kLetters[v],
                       decimal((centre[v] - from[v]) * 1e3, 5));
  };

  const Vec3 c = circle.centre, entry = at(-kRunIn, circle.radius), zero = at(0, circle.radius);
  const Vec3 exit = at(kRunIn, circle.radius);
  std::string text =
      header(circle.inside_ring ? "Circle inside " + piece->params().name : "Circle", machine, o);
  text += fmt::format(
      "({} full circle{} of {:.5f} mm radius, {}; entered from and left to the centre by half\n",
      o.laps, o.laps == 1 ? "" : "s", circle.radius * 1e3,
      clockwise ? "clockwise" : "counter-clockwise");
  text.pop_back();
  text += " circles, with 45 deg run-in and run-out at full feed.)\n";
  text += modes(o, o.plane);
  text += "G0 A0 C0\nG43 H1\n";
  if (circle.inside_ring) {
    text += fmt::format("G0 {}\n", point(c + Vec3(0, 0, o.clearance_mm * 1e-3)));
    text += fmt::format("G1 {} F{:g}\n", point(c), std::max(o.feed_mm_min, 1000.0));
  }
  if (o.settle_s > 0) text += fmt::format("G4 P{:g}\n", o.settle_s);
  text += arc(c, entry, 0.5 * (c + entry)) + fmt::format(" F{:g}\n", o.feed_mm_min);
  text += arc(entry, zero, c) + "\n";
  for (int lap = 0; lap < o.laps; ++lap) text += arc(zero, zero, c) + "\n";
  text += arc(zero, exit, c) + "\n";
  text += arc(exit, c, 0.5 * (c + exit)) + "\n";
  if (circle.inside_ring) text += fmt::format("G0 Z{}\n", decimal(c.z() * 1e3 + o.clearance_mm, 5));
  return text + go_home();
}

std::string step_program(const Machine& machine, const ProgramOptions& options) {
  ProgramOptions o = options;
  check_options(o);
  if (o.axis >= kAxisCount) fail("axis must be one of X Y Z A C");
  if (o.step_size == 0 || !std::isfinite(o.step_size)) fail("step_size must not be 0");
  if (o.steps < 1 || o.steps > 10000) fail("steps must be 1 to 10000");
  if (!(o.dwell_s >= 0)) fail("dwell_s must not be negative");
  const AxisLimits& limits = machine.axes[o.axis].limits;
  const double scale = is_rotary(o.axis) ? kDegree : 1e-3;
  const double last = limits.start + o.steps * o.step_size * scale;
  if (last < limits.min - 1e-9 || last > limits.max + 1e-9)
    fail(fmt::format("steps x step_size leads {} to {:.3f}; allowed is {:.3f} to {:.3f}",
                     kAxisNames[o.axis], last / scale, limits.min / scale, limits.max / scale));

  o.feed_mm_min = step_feed(machine, o, scale);
  check_positive(o.feed_mm_min, "what the probe allows as feed_mm_min");
  std::string text =
      header(fmt::format("Steps of {} along {}", o.step_size, kAxisNames[o.axis]), machine, o);
  text += fmt::format("({} forward and back, {} time{}, {:g} s dwell at each.)\n", o.steps, o.laps,
                      o.laps == 1 ? "" : "s", o.dwell_s);
  text += modes(o, 17);
  text += fmt::format("G91 G1 F{:g}\nG4 P{:g}\n", o.feed_mm_min, o.dwell_s);
  for (int lap = 0; lap < o.laps; ++lap)
    for (const double sign : {1.0, -1.0})
      for (int i = 0; i < o.steps; ++i)
        text += fmt::format("G1 {}{}\nG4 P{:g}\n", kAxisNames[o.axis],
                            decimal(sign * o.step_size, 5), o.dwell_s);
  return text + "G90\nM30\n";
}

}  // namespace vcnc
