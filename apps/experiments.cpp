#include "apps/experiments.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "apps/builtin_files.hpp"
#include "apps/virtual_machine.hpp"
#include "bus/inproc.hpp"
#include "configs/config.hpp"
#include "controller/program_writer.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/geometry/piece.hpp"

namespace vcnc {
namespace {

constexpr double kCircleRadius = 25e-3;
constexpr double kAirGap = 1e-3;        ///< between ball and piece at the start [m]
constexpr double kBlend = 0.5e-6;       ///< G64 P of the straight and circular motions [m]
constexpr double kCornerBlend = 20e-6;  ///< and of the square
constexpr double kSquareSide = 20e-3;
constexpr double kProbeCalm = 0.3;       ///< after which a free probe has swung out [s]
constexpr double kClearOfPiece = 20e-6;  ///< the ball is surely free [m]
constexpr double kSettle = 0.2;          ///< [s]
constexpr double kApproachFeed = 600;    ///< [mm/min]

/// Collects program lines and remembers which are worth looking at.
class ProgramText {
 public:
  explicit ProgramText(double blend, int plane = 17) {
    line(fmt::format("G54 G90 G{} G21 G94 G40 G49", plane));
    line(fmt::format("G64 P{:.5f}", blend * 1e3));
    line("M19");
  }
  /// The number of the line that was added.
  int line(const std::string& words) {
    text_ += words + '\n';
    return ++lines_;
  }
  int go(const Vec3& p, double feed_mm_min) {
    return line("G1 " + point(p) + fmt::format(" F{:g}", feed_mm_min));
  }
  int dwell(double seconds) { return line(fmt::format("G4 P{:g}", seconds)); }
  std::string end() {
    line("M30");
    return text_;
  }
  static std::string point(const Vec3& p) {
    return fmt::format("X{:.5f} Y{:.5f} Z{:.5f}", p.x() * 1e3 + 0.0, p.y() * 1e3 + 0.0,
                       p.z() * 1e3 + 0.0);
  }

 private:
  std::string text_;
  int lines_ = 0;
};

/// Lets the machine start with the ball centre at p (workpiece) and the rotary axes at a, c.
void start_at(Machine& machine, const Vec3& p, double a = 0, double c = 0) {
  const Kinematics kinematics(machine.kinematics, machine.tool_length(1),
                              machine.setup.work_offset[0]);
  const AxisVector q = kinematics.inverse(p, a, c);
  for (std::size_t i = 0; i < kAxisCount; ++i) machine.axes[i].limits.start = q[i];
}

/// The wall that a ball centre programmed through `point` presses against.
PieceParams wall_beside(const Machine& machine, const Vec3& point, const Vec3& normal) {
  PieceParams p;
  p.name = "wall";
  p.kind = PieceParams::Kind::plane;
  p.direction = normal.normalized();
  p.centre = point - (machine.probe.ball_radius - machine.setup.predeflection) * p.direction;
  p.radius = 0.2;
  return p;
}

/// From the programmed path to where the ball is clear of the wall.
Vec3 clear_of(const Machine& machine, const Vec3& normal) {
  return (machine.setup.predeflection + kAirGap) * normal.normalized();
}

Vec3 unit(std::size_t axis) { return Vec3::Unit(static_cast<Eigen::Index>(axis)); }

/// The axis that moves along an inclined wall or is square to a guide wall.
std::size_t partner(std::size_t axis) { return axis == kX ? kY : kX; }

void need(bool rotary, std::size_t axis, const char* what) {
  if (axis >= kAxisCount || is_rotary(axis) != rotary)
    throw std::invalid_argument(
        fmt::format("{} needs a {} axis", what, rotary ? "rotary" : "linear"));
}

// -------------------------------------------------------------------------------------- circles

void make_circles(Experiment& e, const ExperimentOptions& o) {
  if (is_rotary(e.axis)) e.axis = kX;
  const bool zx = e.axis == kZ;
  e.u = zx ? 2 : 0;
  e.v = zx ? 0 : 1;
  PieceParams ring;
  ring.name = "ring gauge";
  ring.kind = PieceParams::Kind::ring;
  ring.bore = true;
  ring.direction = zx ? Vec3::UnitY() : Vec3::UnitZ();
  ring.radius = kCircleRadius + e.machine.probe.ball_radius - e.machine.setup.predeflection;
  e.piece = ring;
  e.abscissa = Abscissa::angle;
  start_at(e.machine, Vec3::Zero());

  static constexpr const char* kAxis = "XYZ";
  static constexpr const char* kCentre = "IJK";
  ProgramText text(kBlend, zx ? 18 : 17);
  text.line("G43 H1");
  text.dwell(0.05);
  const auto lap = [&](int direction, double feed_mm_min) {
    const auto at = [&](double angle) {
      Vec3 p = Vec3::Zero();
      p[e.u] = kCircleRadius * std::cos(direction * angle);
      p[e.v] = kCircleRadius * std::sin(direction * angle);
      return p;
    };
    const auto arc = [&](const Vec3& from, const Vec3& to, const Vec3& centre) {
      const auto word = [](char letter, double metres) {
        return fmt::format(" {}{:.5f}", letter, metres * 1e3 + 0.0);
      };
      return text.line((direction > 0 ? "G3" : "G2") + word(kAxis[e.u], to[e.u]) +
                       word(kAxis[e.v], to[e.v]) + word(kCentre[e.u], centre[e.u] - from[e.u]) +
                       word(kCentre[e.v], centre[e.v] - from[e.v]) +
                       fmt::format(" F{:g}", feed_mm_min));
    };
    // In and out by half circles; an eighth of a turn before and after so that the lap is steady
    // and its beginning, too, is seen from both sides.
    const Vec3 entry = at(-kPi / 4), zero = at(0), exit = at(kPi / 4);
    arc(Vec3::Zero(), entry, 0.5 * entry);
    arc(entry, zero, Vec3::Zero());
    const int line = arc(zero, zero, Vec3::Zero());
    arc(zero, exit, Vec3::Zero());
    arc(exit, Vec3::Zero(), 0.5 * exit);
    text.dwell(0.05);
    return line;
  };
  if (e.showing == Showing::circle) {
    const double feed = o.feed_mm_min > 0 ? o.feed_mm_min : 3000;
    for (const int direction : {1, -1}) {
      const int line = lap(direction, feed);
      e.passes.push_back(
          {direction > 0 ? "CCW" : "CW", line, line, feed * unit::mm_min.to_si, direction});
    }
  } else {
    const double fastest = o.feed_mm_min > 0 ? o.feed_mm_min : 6000;
    for (const double share : {0.25, 0.5, 1.0}) {
      const double feed = fastest * share;
      const int line = lap(1, feed);
      e.passes.push_back({fmt::format("F{:g}", feed), line, line, feed * unit::mm_min.to_si, 1});
    }
  }
  e.program = text.end();
}

// ---------------------------------------------------------------------------------------- lines

void make_line(Experiment& e, const ExperimentOptions& o) {
  using Wall = ExperimentOptions::Wall;
  need(false, e.axis, "line");
  e.abscissa = Abscissa::position;
  const double travel = (o.travel_mm > 0 ? o.travel_mm : 80) * 1e-3;
  const double feed = o.feed_mm_min > 0 ? o.feed_mm_min : 2000;
  const Vec3 along = unit(e.axis), other = unit(partner(e.axis));
  Vec3 way = travel * along, normal = other;
  double path_feed = feed;
  if (o.wall == Wall::inclined) {
    way += travel * other;
    normal = (along - other).normalized();
    path_feed *= std::sqrt(2.0);
    e.lever = std::sqrt(2.0);
  }
  const Vec3 from = -0.5 * way, to = 0.5 * way;
  Vec3 away = Vec3::Zero();
  if (o.wall != Wall::none) {
    e.piece = wall_beside(e.machine, Vec3::Zero(), normal);
    away = clear_of(e.machine, normal);
  }
  start_at(e.machine, from + away);
  ProgramText text(kBlend);
  text.line("G43 H1");
  text.dwell(0.05);
  if (o.wall != Wall::none) text.go(from, kApproachFeed);
  text.dwell(kSettle);
  const int there = text.go(to, path_feed);
  text.dwell(o.seconds > 0 ? o.seconds : kSettle);
  const int back = text.go(from, path_feed);
  text.dwell(0.05);
  e.program = text.end();
  const double speed = feed * unit::mm_min.to_si;
  e.passes = {{"forward", there, there, speed, 1}, {"back", back, back, speed, -1}};
}

void make_reversals(Experiment& e, const ExperimentOptions& o) {
  need(false, e.axis, "reversals");
  e.abscissa = Abscissa::time;
  const bool free = o.wall == ExperimentOptions::Wall::none;
  const double stroke = (o.travel_mm > 0 ? o.travel_mm : free ? 120 : 0.4) * 1e-3;
  const double feed = o.feed_mm_min > 0 ? o.feed_mm_min : free ? 30000 : 300;
  const Vec3 normal = unit(e.axis);
  const Vec3 middle = Vec3::Zero();
  Vec3 away = Vec3::Zero();
  if (!free) {
    e.piece = wall_beside(e.machine, middle, normal);
    away = clear_of(e.machine, normal);
  }
  start_at(e.machine, middle + away);
  ProgramText text(kBlend);
  text.line("G43 H1");
  text.dwell(0.05);
  if (!free) text.go(middle, kApproachFeed);
  text.dwell(kSettle);
  int first = 0, last = 0;
  for (int i = 0; i < 6; ++i) {
    last = text.go(middle + (i % 2 == 0 ? 0.5 : -0.5) * stroke * normal, feed);
    if (i == 0) first = last;
    last = text.dwell(o.seconds > 0 ? o.seconds : 0.1);
  }
  text.go(middle, feed);
  text.dwell(0.05);
  e.program = text.end();
  e.passes = {{"there and back", first, last, feed * unit::mm_min.to_si, 1}};
}

void make_standstill(Experiment& e, const ExperimentOptions& o) {
  if (is_rotary(e.axis)) e.axis = kX;
  e.abscissa = Abscissa::time;
  const double seconds = o.seconds > 0 ? o.seconds : 2;
  const Vec3 normal = unit(e.axis), rest = Vec3::Zero();
  e.piece = wall_beside(e.machine, rest, normal);
  start_at(e.machine, rest + clear_of(e.machine, normal));
  ProgramText text(kBlend);
  text.line("G43 H1");
  text.go(rest, kApproachFeed);
  text.dwell(kSettle);
  const int line = text.dwell(seconds);
  text.dwell(0.05);
  e.program = text.end();
  e.passes = {{"at rest", line, line, 0, 1}};
}

// --------------------------------------------------------------------------------------- rotary

void make_spin(Experiment& e, const ExperimentOptions& o) {
  need(true, e.axis, "spin");
  e.abscissa = Abscissa::position;
  const bool table = e.axis == kC;
  const double span = (table ? 360 : 100) * kDegree;
  const double feed = o.feed_mm_min > 0 ? o.feed_mm_min : table ? 4800 : 1800;  // [deg/min]
  const Vec3 normal = o.normal.isZero() ? (table ? Vec3::UnitX() : Vec3::UnitY()) : o.normal;
  const Vec3 rest(30e-3, table ? 0 : 30e-3, 10e-3);
  e.piece = wall_beside(e.machine, rest, normal);
  const double from = -0.5 * span, to = 0.5 * span;
  start_at(e.machine, rest + clear_of(e.machine, normal), table ? 0 : from, table ? from : 0);
  ProgramText text(kBlend);
  text.line("G43.4 H1");
  text.go(rest, kApproachFeed);
  text.dwell(kSettle);
  const auto turn = [&](double angle) {
    return text.line(
        fmt::format("G1 {}{:.6f} F{:g}", kAxisNames[e.axis], angle / kDegree + 0.0, feed));
  };
  const int there = turn(to);
  text.dwell(kSettle);
  const int back = turn(from);
  text.dwell(0.05);
  e.program = text.end();
  const double speed = feed * kDegree / 60;
  e.passes = {{"forward", there, there, speed, 1}, {"back", back, back, speed, -1}};
}

// ------------------------------------------------------------------------------ S piece, corner

void make_s_piece(Experiment& e, const ExperimentOptions& o) {
  e.abscissa = Abscissa::station;
  e.piece = parse_piece(kSPiece, "S piece");
  const auto piece = make_piece(*e.piece);
  ProgramOptions options;
  options.feed_mm_min = o.feed_mm_min > 0 ? o.feed_mm_min : 4000;
  options.settle_s = kSettle;
  options.run_in_mm = 5;
  e.program = s_piece_program(e.machine, *piece, options);
  // The scan stands between the two dwells.
  const std::size_t settle = e.program.find("\nG4 "), leave = e.program.rfind("\nG4 ");
  const auto line_of = [&](std::size_t at) {
    return static_cast<int>(
        std::count(e.program.begin(), e.program.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
  };
  e.passes = {{fmt::format("one lap, F{:g}", options.feed_mm_min), line_of(settle) + 3,
               line_of(leave) + 1, options.feed_mm_min * unit::mm_min.to_si, 1}};
}

void make_corner(Experiment& e, const ExperimentOptions& o) {
  e.abscissa = Abscissa::station;
  if (is_rotary(e.axis)) e.axis = kX;
  const double feed = o.feed_mm_min > 0 ? o.feed_mm_min : 2000;
  start_at(e.machine, Vec3(0.5 * kSquareSide, 0, 0));
  ProgramText text(kCornerBlend);
  text.line("G43 H1");
  text.dwell(0.05);
  const double s = kSquareSide;
  int last = 0;
  const int first = text.go(Vec3(s, 0, 0), feed);
  for (const Vec3& p : {Vec3(s, s, 0), Vec3(0, s, 0), Vec3(0, 0, 0), Vec3(0.5 * s, 0, 0)})
    last = text.go(p, feed);
  text.dwell(0.05);
  e.program = text.end();
  e.passes = {{fmt::format("F{:g}", feed), first, last, feed * unit::mm_min.to_si, 1}};
}

/// Signed distance from the square 0..side, + outside, and how far along it from the middle of its
/// lower side, counter-clockwise.
struct OnSquare {
  double off = 0, way = 0;
};
OnSquare on_square(const Vec3& p) {
  const double s = kSquareSide;
  const std::array<Eigen::Vector2d, 5> corner{Eigen::Vector2d(0, 0), Eigen::Vector2d(s, 0),
                                              Eigen::Vector2d(s, s), Eigen::Vector2d(0, s),
                                              Eigen::Vector2d(0, 0)};
  const Eigen::Vector2d q = p.head<2>();
  double least = 1e9, way = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d side = (corner[i + 1] - corner[i]) / s;
    const double along = std::clamp((q - corner[i]).dot(side), 0.0, s);
    const double off = (q - corner[i] - along * side).norm();
    if (off < least) least = off, way = static_cast<double>(i) * s + along;
  }
  const bool inside = q.x() > 0 && q.x() < s && q.y() > 0 && q.y() < s;
  const double from_middle = way - 0.5 * s;
  return {inside ? -least : least, from_middle < 0 ? from_middle + 4 * s : from_middle};
}

/// Keeps every row with its error.
class Recorder : public TelemetrySink {
 public:
  Recorder(const Machine& declared, const Piece* piece, Observation& into)
      : error_(declared, piece), into_(into) {}
  void begin(const RunBegin&) override {}
  void row(const TelemetryRow& row) override {
    into_.rows.push_back(row);
    into_.errors.push_back(error_.evaluate(row));
  }
  void alarm(const Alarm& alarm) override { into_.alarms.push_back(alarm); }
  void end(const RunEnd&) override {}

 private:
  DynamicError error_;
  Observation& into_;
};

/// A program file that is gone with this object.
class ProgramFile {
 public:
  explicit ProgramFile(const std::string& text) {
    static std::atomic<int> number{0};
    path_ = std::filesystem::temp_directory_path() /
            fmt::format("vcnc-experiment-{}-{}.ngc", ::getpid(), ++number);
    std::ofstream out(path_);
    out << text;
    out.close();
    if (!out) throw std::runtime_error(path_.string() + ": cannot be written");
  }
  ~ProgramFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace

Machine ideal_machine() {
  Machine machine = parse_machine(kIdealTrunnion, "ideal trunnion");
  machine.setup.piece.clear();
  return machine;
}

Experiment experiment(Showing showing, std::size_t axis, const Machine& machine,
                      const ExperimentOptions& options) {
  Experiment e;
  e.showing = showing;
  e.axis = axis;
  e.machine = declared(machine);
  e.machine.setup.piece.clear();
  // What runs free runs at the feeds of cutting.
  e.machine.probe.in_spindle = options.wall != ExperimentOptions::Wall::none;
  switch (showing) {
    case Showing::circle:
    case Showing::circle_feeds:
      make_circles(e, options);
      break;
    case Showing::line:
      make_line(e, options);
      break;
    case Showing::reversals:
      make_reversals(e, options);
      break;
    case Showing::standstill:
      make_standstill(e, options);
      break;
    case Showing::spin:
      make_spin(e, options);
      break;
    case Showing::s_piece:
      make_s_piece(e, options);
      break;
    case Showing::corner:
      make_corner(e, options);
      break;
  }
  return e;
}

Observation observe(const Experiment& e, std::uint64_t seed) {
  const ProgramFile file(e.program);
  const std::unique_ptr<Piece> piece = e.piece ? make_piece(*e.piece) : nullptr;
  VirtualMachine modules(e.machine, e.piece ? &*e.piece : nullptr, seed);
  InprocTransport transport(modules.nodes());
  Observation observation;
  Recorder recorder(declared(e.machine), piece.get(), observation);
  NcRunOptions options;
  options.program = file.path();
  options.seed = seed;
  observation.nc = run_nc(e.machine, options, transport, recorder);
  return observation;
}

Quantity usual_quantity(Showing showing) {
  return showing == Showing::corner ? Quantity::contour : Quantity::machine_error;
}

std::vector<Curve> curves(const Experiment& e, const Observation& observation, Quantity quantity) {
  const Machine declared_machine = declared(e.machine);
  const Kinematics kinematics(declared_machine.kinematics, declared_machine.tool_length(1),
                              declared_machine.setup.work_offset[0]);
  const bool needs_contact = quantity == Quantity::machine_error ||
                             quantity == Quantity::total_error ||
                             quantity == Quantity::free_reading;
  const double force_limit = e.machine.axes[e.axis].mechanics.force_limit;
  // Positions of linear axes count from the middle of the piece.
  const double centre = is_rotary(e.axis) ? 0 : kinematics.inverse(Vec3::Zero(), 0, 0)[e.axis];
  std::vector<Curve> result;
  for (const Pass& pass : e.passes) {
    Curve curve;
    curve.label = pass.label;
    double way = 0, t0 = -1, line_since = 0;
    int last_line = 0;
    for (std::size_t i = 0; i < observation.rows.size(); ++i) {
      const TelemetryRow& row = observation.rows[i];
      const ErrorSample& error = observation.errors[i];
      const int line = static_cast<int>(row.line);
      if (line < pass.first_line || line > pass.last_line) continue;
      const double t = seconds(error.tick);
      if (t0 < 0) t0 = t;
      if (line != last_line) line_since = t, last_line = line;
      if (needs_contact && !error.near_piece) continue;
      if (e.showing == Showing::s_piece &&
          !(error.near_piece && std::abs(error.e_plan) < e.station_tolerance))
        continue;
      const OnSquare square = on_square(kinematics.forward(row.q_act).p_WT);
      double x = 0, y = 0;
      switch (e.abscissa) {
        case Abscissa::angle: {
          x = std::atan2(error.theoretical[e.v], error.theoretical[e.u]);
          if (x < 0) x += 2 * kPi;
          break;
        }
        case Abscissa::position:
          x = row.q_cmd[e.axis] - centre;
          break;
        case Abscissa::time:
          x = t - t0;
          break;
        case Abscissa::station:
          way += error.travel;
          x = e.showing == Showing::corner ? square.way : way;
          break;
      }
      switch (quantity) {
        case Quantity::machine_error:
          y = e.lever * (error.e_n - error.e_plan);
          break;
        case Quantity::total_error:
          y = e.lever * error.e_n;
          break;
        case Quantity::following:
          y = error.following[e.axis];
          break;
        case Quantity::force:
          y = row.force[e.axis] * force_limit;
          break;
        case Quantity::free_reading:
          if (error.distance < e.machine.probe.ball_radius + kClearOfPiece) continue;
          if (t - line_since < kProbeCalm) continue;
          y = Vec3(row.deflection.data()).norm();
          break;
        case Quantity::contour:
          y = square.off;
          break;
      }
      curve.add(x, y);
    }
    result.push_back(std::move(curve));
  }
  return result;
}

}  // namespace vcnc
