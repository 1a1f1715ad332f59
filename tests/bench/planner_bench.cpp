// The planner on programs that are hard to plan: cutting time against the shortest possible without
// jerk limits on the same path (time_bound.hpp) and, of lines and arcs of X, Y, Z, with them on any
// path within the tolerance (jerk_bound.hpp), use of the limits, deviation of the tip, planning
// time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <string>

#include "bus/tick.hpp"
#include "controller/limit_use.hpp"
#include "controller/planner.hpp"
#include "tests/bench/jerk_bound.hpp"
#include "tests/bench/plan_programs.hpp"
#include "tests/bench/time_bound.hpp"
#include "tests/controller/program_file.hpp"

namespace vcnc {
namespace {

double distance_to(const Vec3& p, const Move& move) {
  const Vec3 a = move.start.head<3>(), d = move.end.head<3>() - a;
  if (move.kind == Move::Kind::arc) {
    const PathSegment arc = make_segment(move, 0);
    Vec3 from = p - move.arc.centre;
    const double height = p[static_cast<Eigen::Index>(move.arc.normal)] -
                          a[static_cast<Eigen::Index>(move.arc.normal)];
    from[static_cast<Eigen::Index>(move.arc.normal)] = 0;
    return std::hypot(from.norm() - arc.radius0, height);
  }
  const double length2 = d.squaredNorm();
  const double share = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return (p - a - share * d).norm();
}

/// Distance of a tip position from the programmed path near a line of the program.
double deviation(const Vec3& tip, const std::vector<Move>& moves, std::size_t near) {
  constexpr std::size_t kAround = 6;
  double least = 1e9;
  const std::size_t last = std::min(near + kAround, moves.size() - 1);
  for (std::size_t i = near - std::min(near, kAround); i <= last; ++i)
    least = std::min(least, distance_to(tip, moves[i]));
  return least;
}

const char* only = nullptr;  ///< part of the name of the programs to measure

void measure(const PlanProgram& program, const Machine& machine, NcParams::Dynamics dynamics) {
  std::vector<Move> moves = read_moves(program.text, machine);
  std::erase_if(moves, [](const Move& move) { return move.kind == Move::Kind::rapid; });
  for (Move& move : moves) move.dynamics = dynamics;
  const std::clock_t begin = std::clock();  // of this thread alone: others may be busy
  const Trajectory run(Path(moves, machine.nc.angle_tolerance), machine);
  const double planning_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;

  const FrameMap map(machine.kinematics, run.path().frame());
  LimitUse use(machine, run.at(0).q);
  double off = 0;
  std::size_t near = 0;
  const Tick cycles = static_cast<Tick>(std::ceil(run.duration() / kCycle));
  for (Tick k = 1; k <= cycles + 3; ++k) {
    const MotionSample sample = run.at(std::min(seconds(k), run.duration()));
    use.add(sample.q);
    while (near + 1 < moves.size() && moves[near].line < sample.line) ++near;
    const Vec3 tip = map.from_axes(Eigen::Map<const Coordinates>(sample.q.data())).head<3>();
    off = std::max(off, deviation(tip, moves, near));
  }
  const double bound = time_bound(run.path(), machine);
  fmt::print("{:<20}{:9.3f}{:9.3f}{:7.2f}   {:5.3f} {:5.3f} {:5.3f}{:9.3f}{:10.4f}", program.name,
             run.duration(), bound, run.duration() / bound, use.largest(1), use.largest(2),
             use.largest(3), off * 1e6, planning_s / run.duration());
  if (!run.path().frame().rtcp) fmt::print("{:10.3f}", jerk_bound(moves, machine));
  if (program.corners)
    fmt::print("{:10.3f}{:10.3f}", trapezoid_time(moves, machine),
               time_with_stops(moves, machine, true));
  fmt::print("{}\n", run.given_up() > 0 ? "  smooth in parts" : "");
  std::fflush(stdout);
}

void measure_all(const char* title, const std::vector<PlanProgram>& programs,
                 const Machine& machine, NcParams::Dynamics dynamics) {
  fmt::print("{}\n{:<20}{:>9}{:>9}{:>7}   {:<17}{:>9}{:>10}{:>10}{:>10}{:>10}\n", title, "",
             "time s", "bound s", "ratio", "use of v, a, j", "off um", "plan s/s", "jerk b. s",
             "trapez. s", "stops s");
  for (const PlanProgram& program : programs)
    if (!only || program.name.find(only) != std::string::npos) measure(program, machine, dynamics);
}

/// The three-axis set as files, for another planner, each with the least time of any planner [s].
void write_programs(const std::string& folder) {
  const Machine machine = three_axis_machine();
  for (const PlanProgram& program : three_axis_programs()) {
    const std::string file = folder + "/" + program.name;
    std::ofstream(file + ".ngc") << program.text;
    std::ofstream(file + ".bound") << jerk_bound(read_moves(program.text, machine), machine);
  }
}

}  // namespace
}  // namespace vcnc

int main(int argc, char** argv) {
  if (argc > 2 && std::string(argv[1]) == "--programs") {
    vcnc::write_programs(argv[2]);
    return 0;
  }
  if (argc > 1) vcnc::only = argv[1];
  using Dynamics = vcnc::NcParams::Dynamics;
  for (const Dynamics dynamics : {Dynamics::smooth, Dynamics::fast}) {
    const std::string name = dynamics == Dynamics::fast ? "fast" : "smooth";
    vcnc::measure_all((name + ", three axes").c_str(), vcnc::three_axis_programs(),
                      vcnc::three_axis_machine(), dynamics);
    vcnc::measure_all((name + ", five axes").c_str(), vcnc::five_axis_programs(),
                      vcnc::five_axis_machine(), dynamics);
  }
}
