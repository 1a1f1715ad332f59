#include "apps/lockout_case.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "configs/config.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"

namespace vcnc {

namespace {

using CaseKind = Scenario::Kind;
using CaseTarget = Scenario::Target;

/// Unit vector in the direction `polar` away from `axis`, turned by `azimuth` about it.
Vec3 tilted(const Vec3& axis, double polar, double azimuth) {
  const Vec3 side = axis.unitOrthogonal();
  const Vec3 other = axis.cross(side);
  return std::cos(polar) * axis +
         std::sin(polar) * (std::cos(azimuth) * side + std::sin(azimuth) * other);
}

/// Where and how the ball meets the surface.
struct Meeting {
  Vec3 touch;     ///< ball centre, workpiece frame
  Vec3 way;       ///< of the ball
  Vec3 normal;    ///< of the surface
  RotaryPair at;  ///< rotary axes
};

std::string text_of_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path + ": cannot be opened");
  return {std::istreambuf_iterator<char>(in), {}};
}

class Builder {
 public:
  explicit Builder(const Scenario& scenario) : s_(scenario) {
    result_.machine = load_machine(s_.machine, s_.set, s_.inject);
    result_.within_limit = s_.within_limit;
  }

  LockoutCase build() {
    switch (s_.kind) {
      case CaseKind::program:
        own_program();
        break;
      case CaseKind::rotary:
        swing();
        break;
      case CaseKind::scan:
        scan();
        break;
      default:
        crash();
        break;
    }
    return std::move(result_);
  }

 private:
  Machine& machine() { return result_.machine; }
  Kinematics kinematics() const {
    const Machine& m = result_.machine;
    return {m.kinematics, m.tool_length(1), m.setup.work_offset[0]};
  }
  PieceParams machines_piece() const {
    if (result_.machine.setup.piece.empty())
      throw InputError(s_.machine + ": names no piece (setup.piece), which the scenario needs");
    return load_piece(result_.machine.setup.piece);
  }

  void own_program() {
    result_.program = s_.gcode.empty() ? text_of_file(s_.program) : s_.gcode;
    if (s_.has_piece())
      result_.piece = s_.piece;
    else if (!result_.machine.setup.piece.empty())
      result_.piece = machines_piece();
  }

  Meeting meet() {
    const Kinematics k = kinematics();
    Meeting m;
    if (s_.target == CaseTarget::piece) {
      result_.piece = machines_piece();
      const auto piece = make_piece(*result_.piece);
      const double height = 0.02;
      const auto path = piece->scan_path(machine().probe.ball_radius, 0, height, 5e-3);
      const Station& station = path[static_cast<std::size_t>(
          std::lround(s_.station * static_cast<double>(path.size() - 1)))];
      m.at = k.counted(rotary_from_axis(station.tool_axis, {}));
      m.touch = station.centre;
      m.normal = station.n;
      m.way = -station.n;
      return m;
    }
    m.touch = s_.at;
    m.at = {s_.a, s_.c};
    const RotaryPair iso = k.counted(m.at);
    m.way = tilted(-tool_axis(iso.a, iso.c), kPi / 2 - s_.axial_angle, s_.azimuth);
    m.normal = tilted(-m.way, s_.incidence, s_.incidence_azimuth);
    place(m);
    return m;
  }

  /// Puts the target where it meets the ball.
  void place(const Meeting& m) {
    const double ball = machine().probe.ball_radius;
    PieceParams piece;
    piece.name = "target";
    switch (s_.target) {
      case CaseTarget::sphere:
        piece.kind = PieceParams::Kind::sphere;
        piece.radius = s_.radius;
        piece.centre = m.touch - (ball + s_.radius) * m.normal;
        break;
      case CaseTarget::bore:
        piece.kind = PieceParams::Kind::ring;
        piece.bore = true;
        piece.radius = s_.radius;
        piece.height = 0.2;
        piece.direction = m.normal.unitOrthogonal();
        piece.centre = m.touch + (s_.radius - ball) * m.normal;
        break;
      default:
        piece.kind = PieceParams::Kind::plane;
        piece.centre = m.touch - ball * m.normal;
        piece.direction = m.normal;
        break;
    }
    result_.piece = piece;
  }

  void start_at(const Vec3& p, const RotaryPair& at) {
    const AxisVector q = kinematics().inverse(p, at.a, at.c);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      AxisLimits& limits = machine().axes[i].limits;
      if (!(q[i] >= limits.min && q[i] <= limits.max))
        throw InputError(fmt::format("{}: the way would begin at {} {:.3f}, beyond its travel",
                                     s_.name, kAxisNames[i],
                                     q[i] / (is_rotary(i) ? kDegree : 1e-3)));
      limits.start = q[i];
    }
  }

  static std::string words(const Vec3& p) {
    return fmt::format("X{:.6f} Y{:.6f} Z{:.6f}", p.x() * 1e3, p.y() * 1e3, p.z() * 1e3);
  }
  std::string feed() const { return fmt::format(" F{:.3f}", s_.feed * 60e3); }

  void deviate(const std::string& key, double value) {
    machine().effects.deviations.push_back({key, value});
  }

  void crash() {
    const Meeting m = meet();
    Vec3 believed = Vec3::Zero();  ///< programmed minus real position
    const double error = s_.depth - machine().setup.predeflection;
    if (s_.kind == CaseKind::wrong_offset) {
      believed = -error * m.way;
      const Vec3 real = machine().setup.work_offset[0] - error * m.way;
      for (Eigen::Index i = 0; i < 3; ++i)
        deviate(std::string("setup.g54_mm.") + "xyz"[i], real[i] * 1e3);
    } else if (s_.kind == CaseKind::wrong_length) {
      believed = -error * m.way;
      deviate("probe.length_mm", (machine().probe.length + error) * 1e3);
    }
    const Vec3 start = m.touch - s_.run_up * m.way + believed;
    const Vec3 end = m.touch + s_.depth * m.way + believed;
    start_at(start, m.at);
    std::string& text = result_.program;
    text = "G90 G21 G54\nG43.4 H1\n";
    if (s_.kind == CaseKind::spindle_start) text += "S1000 M3\n";
    if (s_.predeflection > 0)
      text +=
          "G1 " + words(m.touch + s_.predeflection * m.way + believed) + feed() + "\nG4 P0.05\n";
    if (s_.kind == CaseKind::not_retracted) {
      text += "G0 " + words(end) + "\n";
    } else {
      text += "G1 " + words(end);
      if (s_.turn != 0) text += fmt::format(" C{:.6f}", (m.at.c + s_.turn) / kDegree);
      text += feed() + "\n";
    }
    text += "M30\n";
  }

  void swing() {
    const RotaryPair at{s_.a, s_.c};
    const Kinematics k = kinematics();
    const AxisVector touching = k.inverse(s_.at, at.a, at.c);
    AxisVector further = touching;
    further[kA] += 1e-4;
    const Vec3 speed = (k.forward(further).p_WT - s_.at) / 1e-4;  // [m/rad]
    const double radius = speed.norm();
    if (radius < 5e-3)
      throw InputError(s_.name +
                       ": at_mm: the ball stands on the A axis, a swing does not move it");
    Meeting m{s_.at, speed / radius, -speed / radius, at};
    place(m);
    AxisVector start = touching;
    start[kA] -= s_.run_up / radius;
    const double end = touching[kA] + s_.depth / radius;
    for (std::size_t i = 0; i < kAxisCount; ++i) machine().axes[i].limits.start = start[i];
    result_.program = fmt::format("G90 G21 G54\nG1 A{:.6f} F{:.4f}\nM30\n", end / kDegree,
                                  s_.rotary_feed / kDegree * 60);
  }

  void scan() {
    const Meeting m = meet();
    const Vec3 n = m.normal;
    const Vec3 before = m.touch + s_.run_up * n, in = m.touch - s_.predeflection * n;
    Vec3 along = n.unitOrthogonal();
    if (s_.target == CaseTarget::bore) along = result_.piece->direction;
    const Vec3 beside = in + s_.sideways * along;
    start_at(before, m.at);
    std::string& text = result_.program;
    text = "G90 G21 G54\nG43.4 H1\n";
    text += "G1 " + words(in) + feed() + "\nG4 P0.05\n";
    text += "G1 " + words(beside);
    if (s_.turn != 0) text += fmt::format(" C{:.6f}", (m.at.c + s_.turn) / kDegree);
    text += "\n";
    text += "G1 " + words(beside + (s_.run_up + s_.predeflection) * n) + "\n";
    text += "G0 " + words(beside + (s_.run_up + s_.predeflection + 5e-3) * n) + "\nM30\n";
  }

  const Scenario& s_;
  LockoutCase result_;
};

BusFaults faults_of(const Scenario& scenario) {
  BusFaults faults;
  for (const std::string& text : scenario.faults) {
    const auto refuse = [&](const char* why) {
      throw InputError(scenario.name + ": faults: \"" + text + "\": " + why);
    };
    try {
      faults.push_back(parse_fault(text));
    } catch (const std::invalid_argument& e) {
      refuse(e.what());
    }
    if (faults.back().of_host()) refuse("needs processes; see vcnc lockout --processes");
  }
  return faults;
}

}  // namespace

LockoutCase make_case(const Scenario& scenario) {
  const BusFaults faults = faults_of(scenario);
  try {
    LockoutCase result = Builder(scenario).build();
    result.faults = faults;
    return result;
  } catch (const std::invalid_argument& e) {
    throw InputError(scenario.name + ": " + e.what());
  }
}

}  // namespace vcnc
