#include "controller/player.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <stdexcept>

#include "bus/tick.hpp"
#include "controller/gcode/interpreter.hpp"
#include "controller/path.hpp"
#include "controller/planner.hpp"
#include "controller/planner_limits.hpp"
#include "controller/rate_planner.hpp"
#include "model/effects/chain.hpp"

namespace vcnc {
namespace {

// A longer run is planned in batches of about this size, so that it takes bounded memory.
constexpr std::size_t kMostMoves = 20'000;
constexpr double kLongestWay = 20;          ///< [m] of the controlled point
constexpr double kLongestSeconds = 600;     ///< at the programmed feed
constexpr double kMostNodes = 4e6;          ///< of the plan, estimated
constexpr double kLongestTraverse = 36000;  ///< [s] at the limits of the axes
constexpr double kExactCorner = 1.0 * kDegree;
constexpr double kLargestChord = 2 * kPi / 3;  ///< angle of a chord
constexpr int kMostChords = 20'000;            ///< per arc

/// About how far the controlled point goes in a move [m].
double way_of(const Move& move) {
  if (move.kind == Move::Kind::arc) {
    Vec3 radius = move.start.head<3>() - move.arc.centre;
    radius[static_cast<Eigen::Index>(move.arc.normal)] = 0;
    return radius.norm() * std::abs(move.arc.sweep);
  }
  return (move.end - move.start).head<3>().norm();
}

/// How long a move takes at its feed; rapids count nothing.
double seconds_of(const Move& move) {
  switch (move.feed_mode) {
    case Move::Feed::none:
      return 0;
    case Move::Feed::tip:
      return way_of(move) / move.feed;
    case Move::Feed::rotary:
      return (move.end - move.start).tail<2>().norm() / move.feed;
    case Move::Feed::time:
      return move.feed;
  }
  return 0;
}

/// At most about how many nodes planning a move takes: they stand denser than the hat is wide, and
/// that widens from a corner of the tolerance to at most a few mm (controller/path.hpp).
double nodes_of(const Move& move) {
  constexpr double kPerWidth = 4, kLargestStep = 1e-3, kNarrowest = 3;
  const double way =
      std::max(way_of(move), Path::kRotaryLength * (move.end - move.start).tail<2>().norm());
  if (move.kind == Move::Kind::arc) {
    const double radius = way / std::abs(move.arc.sweep);
    const double width = std::sqrt(12 * std::min(Path::kArcTolerance, move.tolerance) * radius);
    return kPerWidth * way / std::min(width, Path::kLargestWidth);
  }
  const double narrowest = kNarrowest * move.tolerance;
  const double widest = std::min(way, Path::kLargestWidth);
  const double opening =
      2 * kPerWidth / Path::kWidthSlope * std::log(std::max(1.0, widest / narrowest));
  return way / kLargestStep + std::min(kPerWidth * way / narrowest, opening);
}

/// Into how many parts a move is cut for checks along it.
int parts_of(const Move& move, double length) {
  constexpr double kStep = 2e-3, kTurn = 2 * kDegree;
  const double turn =
      std::max((move.end - move.start).tail<2>().cwiseAbs().maxCoeff(), std::abs(move.arc.sweep));
  return 1 + static_cast<int>(std::max(length / kStep, turn / kTurn));
}

/// Throws where a position leaves the travel of an axis.
void check_travel(const Coordinates& q, const Machine& machine, const std::string& where) {
  constexpr double kRounding = 1e-9;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisLimits& axis = machine.axes[i].limits;
    const double position = q[static_cast<Eigen::Index>(i)];
    if (position >= axis.min - kRounding && position <= axis.max + kRounding) continue;
    const double scale = is_rotary(i) ? kDegree : 1e-3;
    throw ProgramError(fmt::format(
        "{}: {} would reach {:.3f} {}; allowed is {:.3f} to {:.3f}", where, kAxisNames[i],
        position / scale, is_rotary(i) ? "deg" : "mm", axis.min / scale, axis.max / scale));
  }
}

/// "FILE:LINE:COLUMN" of a move.
std::string place_of(const Move& move, const std::string& path_name) {
  return move.column > 0 ? fmt::format("{}:{}:{}", path_name, move.line, move.column)
                         : fmt::format("{}:{}", path_name, move.line);
}

/// Checks the travel along a move: its end, and points between where the axes' path is curved.
void check_move(const Move& move, const Machine& machine, const std::string& path_name) {
  const std::string where = place_of(move, path_name);
  const FrameMap map(machine.kinematics, move.frame);
  const Coordinates way = map.to_axes(move.end) - map.to_axes(move.start);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double share = move.kind == Move::Kind::rapid ? machine.nc.rapid_limit : 1;
    const double hours = std::abs(way[static_cast<Eigen::Index>(i)]) /
                         (share * machine.axes[i].limits.velocity) / 3600;
    if (hours > kLongestTraverse / 3600)
      throw ProgramError(
          fmt::format("{}: at the largest velocity of {} the move would last {:.1f} h; allowed is "
                      "up to {:.0f} h",
                      where, kAxisNames[i], hours, kLongestTraverse / 3600));
  }
  if (!move.frame.rtcp && move.kind != Move::Kind::arc) {
    check_travel(move.end, machine, where);
    return;
  }
  const PathSegment segment = make_segment(move, 0);
  const int parts = parts_of(move, segment.length);
  for (int i = 0; i <= parts; ++i)
    check_travel(map.to_axes(programmed_point(segment, segment.length * i / parts).x), machine,
                 where);
}

constexpr double kFeedRounding = 1e-7;  ///< relative

/// Rounded down to what a person would program.
std::string feed_word(double feed) {
  const double digit = feed >= 10 ? 1 : 0.01;
  return fmt::format("F{:g}", std::floor(feed * (1 + kFeedRounding) / digit) * digit);
}

/// What the feed of a move must be multiplied by for the probe, and why; the strictest on the way.
ProbingBound probing_bound(const Move& move, const Machine& machine, const ProbingLimit& probing) {
  const FrameMap map(machine.kinematics, move.frame);
  const PathSegment segment = make_segment(move, 0);
  const bool straight = move.kind != Move::Kind::arc && move.start.tail<2>() == move.end.tail<2>();
  const int parts = straight ? 1 : parts_of(move, segment.length);
  ProbingBound strictest{.factor = std::numeric_limits<double>::infinity()};
  for (int i = 0; i <= parts; ++i) {
    PathPoint point = programmed_point(segment, segment.length * i / parts);
    double pace = 1;  // ds/dt at the feed
    switch (move.feed_mode) {
      case Move::Feed::none:
        break;
      case Move::Feed::tip:
        pace = move.feed / point.dx.head<3>().norm();
        point.dx.tail<2>().setZero();
        break;
      case Move::Feed::rotary:
        pace = move.feed / point.dx.tail<2>().norm();
        break;
      case Move::Feed::time:
        pace = segment.length / move.feed;
        break;
    }
    if (!std::isfinite(pace)) continue;
    const AxisPoint axes = axis_point(map, point);
    const ProbingBound here = probing.at(as_axes(axes.q), as_axes(pace * axes.dq));
    if (here.factor < strictest.factor) strictest = here;
  }
  return strictest;
}

/// A probe that meets the piece at this feed must come to rest before its mechanism does. The feed
/// of the controlled point, of rotary axes or by time is what a program asks for, so it is refused;
/// rapids, and what axes do besides in order to turn, the planner slows down.
void check_probing_feed(const Move& move, const Machine& machine, const ProbingLimit& probing,
                        const std::string& path_name, bool inches) {
  const ProbingBound bound = probing_bound(move, machine, probing);
  const char* side = bound.by == ProbingBound::By::axial ? "axial" : "lateral";
  if (bound.factor <= 0)
    throw ProgramError(fmt::format(
        "{}: in a crash the probe could not be stopped between its range and its {} limit at "
        "any speed: see probe.range_mm, probe.overtravel_{}_mm, probe.overtravel_force_{}_N",
        place_of(move, path_name), side, side, side));
  if (move.feed_mode == Move::Feed::none || bound.factor >= 1 - kFeedRounding) return;
  const double feed = move.feed_mode == Move::Feed::tip ? move.feed * 60 / (inches ? 25.4e-3 : 1e-3)
                      : move.feed_mode == Move::Feed::rotary ? move.feed * 60 / kDegree
                                                             : 60 / move.feed;
  const std::string why =
      bound.by == ProbingBound::By::counting
          ? "its periods could not be counted"
          : fmt::format("in a crash it could not be stopped between its range and its {} limit",
                        side);
  const std::string lever = bound.lever > 0
                                ? fmt::format(" ({} moves the ball at a lever of {:.1f} mm)",
                                              kAxisNames[bound.axis], bound.lever * 1e3)
                                : "";
  throw ProgramError(fmt::format("{}: {} is too fast for the probe: {}{}; allowed {} is {} {}",
                                 place_of(move, path_name), feed_word(feed), why, lever,
                                 move.feed_mode == Move::Feed::tip ? "in this direction" : "here",
                                 feed_word(feed * bound.factor),
                                 move.feed_mode == Move::Feed::tip ? inches ? "inch/min" : "mm/min"
                                 : move.feed_mode == Move::Feed::rotary ? "deg/min"
                                                                        : "1/min"));
}

/// Angle between the end of one move and the begin of the next, in the path's own metric.
double corner(const Move& a, const Move& b) {
  const PathSegment from = make_segment(a, 0), to = make_segment(b, 0);
  Coordinates t1 = programmed_point(from, from.length).dx, t2 = programmed_point(to, 0).dx;
  t1.tail<2>() *= Path::kRotaryLength;
  t2.tail<2>() *= Path::kRotaryLength;
  const double cosine = t1.dot(t2) / (t1.norm() * t2.norm());
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

/// The moves belong to one run: no stop between them.
bool continues(const Move& a, const Move& b) {
  if (a.alone || b.alone || !(a.frame == b.frame)) return false;
  if ((a.kind == Move::Kind::rapid) != (b.kind == Move::Kind::rapid)) return false;
  return !(a.exact || b.exact) || corner(a, b) <= kExactCorner;
}

/// Replaces an arc by chords no higher than `sagitta`.
void add_chords(const Move& arc, double sagitta, std::vector<Move>& moves) {
  const PathSegment segment = make_segment(arc, 0);
  const double radius = std::max(segment.radius0, segment.radius1);
  const double half = std::acos(std::max(1 - sagitta / radius, std::cos(0.5 * kLargestChord)));
  const double count = std::ceil(std::abs(arc.arc.sweep) / (2 * half) - 1e-6);
  const int chords = static_cast<int>(std::clamp<double>(count, 1, kMostChords));
  Move chord = arc;
  chord.kind = Move::Kind::line;
  chord.arc = {};
  if (chord.feed_mode == Move::Feed::time) chord.feed /= chords;
  for (int i = 1; i <= chords; ++i) {
    chord.start = i == 1 ? arc.start : chord.end;
    chord.end = i == chords ? arc.end : programmed_point(segment, segment.length * i / chords).x;
    moves.push_back(chord);
  }
}

/// A feed per turn while the spindle's speed follows the surface (G96), as pieces along which that
/// speed changes by at most kSpeedStep.
void add_by_turns(const Move& move, const SurfaceSpeed& surface, std::vector<Move>& moves) {
  constexpr double kSpeedStep = 0.02;
  constexpr int kFirst = 8, kMostHalvings = 10;
  const PathSegment segment = make_segment(move, 0);
  const auto point = [&](double share) {
    return share == 1 ? move.end : programmed_point(segment, segment.length * share).x;
  };
  Move piece = move;
  const auto add = [&](const auto& self, double from, double to, int halvings) -> void {
    const Coordinates end = point(to);
    const double middle = 0.5 * (from + to);
    const double speeds[] = {surface.at(piece.start[kX]), surface.at(point(middle)[kX]),
                             surface.at(end[kX])};
    const auto [least, most] = std::minmax_element(std::begin(speeds), std::end(speeds));
    if (halvings<kMostHalvings&& * most> * least * (1 + kSpeedStep)) {
      self(self, from, middle, halvings + 1);
      self(self, middle, to, halvings + 1);
      return;
    }
    piece.end = end;
    piece.arc.sweep = move.arc.sweep * (to - from);
    piece.feed = move.feed_per_turn * speeds[1] / (2 * kPi);
    moves.push_back(piece);
    piece.start = end;
  };
  // An axis of rotation between the ends is not to be missed.
  const int first = move.kind == Move::Kind::arc ? kFirst : 1;
  const double zero = (surface.axis - move.start[kX]) / (move.end[kX] - move.start[kX]);
  if (first == 1 && zero > 0 && zero < 1) {
    add(add, 0, zero, 0);
    add(add, zero, 1, 0);
    return;
  }
  for (int i = 0; i < first; ++i)
    add(add, static_cast<double>(i) / first, static_cast<double>(i + 1) / first, 0);
}

/// From where the axes are switched on to where a program begins in its middle.
std::deque<Block> approach_to(const BlockStart& start, const Machine& machine) {
  const Kinematics kinematics(machine.kinematics, 0, Vec3::Zero());
  const AxisVector target = as_axes(start.position);
  const ToolPose pose = kinematics.forward(target);
  AxisVector before =
      kinematics.inverse(pose.p_WT + Player::kStandOff * pose.R_WT.col(2), target[kA], target[kC]);
  constexpr double kRounding = 1e-12;
  for (std::size_t i = 0; i < kA; ++i) {
    const AxisLimits& limits = machine.axes[i].limits;
    if (std::abs(before[i] - target[i]) < kRounding) before[i] = target[i];
    if (before[i] < limits.min || before[i] > limits.max) before = target;
  }
  std::deque<Block> blocks;
  Move move;
  move.kind = Move::Kind::rapid;
  move.alone = true;
  move.tolerance = machine.nc.blend_tolerance;
  move.line = start.line;
  move.end = start_coordinates(machine);
  const auto go = [&](std::initializer_list<std::size_t> axes, const Coordinates& to) {
    move.start = move.end;
    for (const std::size_t axis : axes)
      move.end[static_cast<Eigen::Index>(axis)] = to[static_cast<Eigen::Index>(axis)];
    if (move.start != move.end) blocks.emplace_back(move);
  };
  const Coordinates stand_off = Eigen::Map<const Coordinates>(before.data());
  Coordinates up = move.end;
  up[kZ] = std::max(up[kZ], stand_off[kZ]);
  if (move.end != start.position) {
    go({kZ}, up);
    go({kA, kC}, stand_off);
    go({kX, kY}, stand_off);
    go({kZ}, stand_off);
  }
  if (start.spindle.mode != SpindleWord::Mode::off) blocks.emplace_back(start.spindle);
  move.kind = Move::Kind::line;
  move.feed_mode = Move::Feed::tip;
  move.feed = Player::kApproachSpeed;
  go({kX, kY, kZ}, start.position);
  return blocks;
}

}  // namespace

/// A probing move that is being played.
struct Player::Search {
  Move::Probe probe = Move::Probe::none;
  ProbeTouch touch;              ///< what it comes to
  Vec3 way = Vec3::Zero();       ///< of X, Y, Z, of length 1; 0: not a straight one
  std::optional<double> stop{};  ///< on the path: where it ends before its end [s]
  bool replayed = false;         ///< all of this is known from before
  bool found = false;
  double end = 0;  ///< of its path [s]
  Tick late = 0;   ///< cycles waited at its end
};

struct Player::State {
  State(const std::string& file, const Machine& the_machine, const PlayerOptions& options)
      : machine(the_machine),
        file_name(file),
        program(file, the_machine, options.interpreter),
        rates(the_machine),
        probing(probing_limit(the_machine)),
        feels(options.feels),
        trigger(the_machine.probe),
        touches(options.interpreter.touches) {
    panel.block_delete = options.interpreter.block_delete;
    data = options.interpreter.data;
    for (std::size_t i = 0; i < kAxisCount; ++i) step.position[i] = machine.axes[i].limits.start;
    step.tip = start_coordinates(machine).head<3>();
    machine_chain<PlanPort>(machine.effects, 0).step(allowed, {});
    constexpr double kLongestHold = 3.5, kMore = 1;  // of v/a: time_for() of rate 1, and rounding
    for (const AxisParams& axis : machine.axes)
      ahead =
          std::max(ahead, kMore + kLongestHold * axis.limits.velocity / axis.limits.acceleration);
    if (options.from_line > 0) {
      begins_at = program.run_to(options.from_line);
      approach = approach_to(*begins_at, machine);
      for (const Block& block : approach)
        if (const Move* move = std::get_if<Move>(&block)) check_move(*move, machine, file);
      done_touches = begins_at->probings;
    }
    program.forget_touches();
  }

  const Machine machine;
  const std::string file_name;
  GcodeInterpreter program;
  PlanPort::Signal<double> allowed;
  std::optional<BlockStart> begins_at;
  std::deque<Block> approach;           ///< to it, still to be played
  std::optional<Block> pending;         ///< read, not yet played
  std::optional<Move> last;             ///< taken into the run
  std::optional<SurfaceSpeed> surface;  ///< G96
  std::optional<Trajectory> run;
  double ahead = 0;            ///< how much of its path has to be known [s]
  Tick cycle = 0, cycles = 0;  ///< within the run or the dwell
  Tick begun = 0;              ///< cycles of the program when it began
  PlayerStep step;
  Tick played = 0;  ///< cycles since the program began

  bool whole = true;  ///< the run is at whole cycles of its own, at rate 1
  RateChange law;     ///< otherwise this is how its time passes
  Tick law_cycle = 0, law_base = 0;
  bool holding = false, rising = false;  ///< hold(), go_on()

  RatePlanner rates;
  const std::optional<ProbingLimit> probing;
  PanelSwitches panel;
  bool feed_held = false;             ///< the operator's
  bool attended = false;              ///< somebody will press cycle start
  bool unchecked = false;             ///< the switches have made another program of it
  std::optional<RateChange> planned;  ///< what has to begin at its place on the path
  double boosted_for = 0;             ///< override that the present rate above 1 was chosen for
  double next_try = 0;                ///< on the path: not before it a rate above 1 is looked for
  double next_stop = 0;               ///< on the path: not before it a block's end is looked for
  Tick tries = 0;                     ///< cycles in which a change had to wait
  enum class Wait { none, block, stop };
  Wait wait = Wait::none;  ///< for cycle start, besides a feed hold
  Tick idle = 0;           ///< cycles at rest in it
  Tick stop_cycles = 0;    ///< that the stop counts in the program's time
  bool block_done = false;
  NcData data;
  Tick data_at = 0;  ///< when it was looked at

  const bool feels;
  TouchTrigger trigger;
  std::vector<ProbeTouch> touches;
  std::size_t done_touches = 0;  ///< of them
  bool seeking = false;          ///< what is known is done again
  std::optional<Search> search;
  Tick settling = 0;  ///< cycles waited before a probing move
  ProbeFault fault = ProbeFault::none;

  /// Time on the path of the run now [s].
  double path_time() const {
    if (!run) return 0;
    if (search && search->stop && !whole && !changing()) return *search->stop;
    const double tau = whole ? seconds(cycle) : law.path_time(seconds(law_cycle));
    return std::min(tau, end_of_run());
  }

  /// Where the run ends on its path [s].
  double end_of_run() const { return search && search->stop ? *search->stop : run->duration(); }

  /// d tau / dt now.
  double rate() const { return whole ? 1 : law.rate(seconds(law_cycle)); }
  bool changing() const { return !whole && !law.over(seconds(law_cycle)); }

  /// Time in which the rate can change by `rate` so that no axis takes more than half of its
  /// acceleration limit for it, at the velocities of the path at `tau`.
  double time_for(double rate, double tau) const {
    constexpr double kShortest = 10 * kCycle, kShare = 0.5, kSteepest = 1.5;
    double time = kShortest;
    const MotionSample now = run->at(tau);
    for (std::size_t i = 0; i < kAxisCount; ++i)
      time = std::max(time, kSteepest * std::abs(rate * now.dq[i]) /
                                (kShare * machine.axes[i].limits.acceleration));
    return time;
  }

  /// Begins to brake where the run stands now.
  void begin_hold() {
    if (search && search->stop && !search->replayed) {  // it brakes already
      holding = true;
      return;
    }
    const double tau = path_time(), now = rate();
    law = {tau, now, 0, run ? time_for(now, tau) : kCycle};
    law_cycle = 0;
    whole = false;
    holding = true;
    rising = false;
    planned.reset();
  }

  bool held() const { return holding && (!run || law.over(seconds(law_cycle))); }

  /// Time on the path at which a hold comes to rest [s].
  double rest_time() const {
    return run ? std::min(law.start + 0.5 * law.from * law.time, end_of_run()) : 0;
  }

  /// Whole cycles of the run or dwell that have passed at a time on its path.
  Tick whole_cycles(double tau) const {
    return run ? std::min(static_cast<Tick>(std::floor(tau / kCycle)), cycles) : cycle;
  }

  void begin_rise() {
    holding = false;
    if (!run) {  // a dwell simply goes on
      whole = true;
      return;
    }
    if (search && search->stop) {
      end_run();
      return;
    }
    const double tau = path_time();
    const double to = std::min(goal(run->at(tau)), 1.0);
    if (feed_held || wait == Wait::block || to == 0) {
      law = {tau, 0, 0, 0};
      return;
    }
    double time = time_for(to, tau);
    constexpr int kLooks = 8;
    for (int i = 1; i <= kLooks; ++i) time = std::max(time, time_for(to, tau + time * i / kLooks));
    const double fraction = tau / kCycle - std::floor(tau / kCycle);
    if (to == 1) time = 2 * (std::ceil(0.5 * time / kCycle) + fraction) * kCycle;
    begin_change({tau, 0, to, time});
    rising = true;
  }

  void begin_change(const RateChange& change) {
    const AlignedChange exact = aligned(change);
    law = exact.change;
    law_base = exact.base;
    law_cycle = 0;
    whole = false;
    planned.reset();
    tries = 0;
    next_stop = 0;
  }

  /// One cycle along the path at the rate that holds then.
  void move_on_path() {
    const MotionSample sample = run->at(path_time());
    const double share = rate();
    step.position = sample.q;
    step.tip = sample.tip;
    step.line = sample.line;
    step.feed = sample.tip_speed * share;
    for (std::size_t i = 0; i < kAxisCount; ++i) step.velocity[i] = sample.dq[i] * share;
    turn_spindle();
  }

  void turn_spindle() {
    if (surface) step.spindle_speed = surface->at(step.tip.x());
  }

  void brake() {
    ++law_cycle;
    move_on_path();
  }

  /// One cycle by the law of the rate.
  void roll() {
    ++law_cycle;
    if (!changing()) {
      rising = false;
      if (law.to == 1 && law.from != 1) {
        cycle = law_base + law_cycle;
        whole = true;
        played = begun + cycle;
        play();
        return;
      }
    }
    move_on_path();
    const bool stopped = search && search->stop && !changing();
    if (stopped || (run->complete() && path_time() >= run->duration())) end_run();
  }

  /// The run at whole cycles, as programmed.
  void play() {
    const MotionSample sample = run->at(std::min(seconds(cycle), end_of_run()));
    step.position = sample.q;
    step.velocity = sample.dq;
    step.tip = sample.tip;
    step.feed = sample.tip_speed;
    step.line = sample.line;
    turn_spindle();
    if (cycle >= cycles) end_run();
  }

  void end_run() {
    if (search) search->end = end_of_run();
    cycle = cycles;
    played = begun + cycle;
    run.reset();
    whole = true;
    rising = false;
    planned.reset();
    block_done = true;
    if (search && (search->found || search->replayed)) end_search();
  }

  // ---------------------------------------------------------------------------------- probing

  /// What a probing move looks for is there.
  bool is_there(Move::Probe probe) const { return trigger.tripped() != leaves(probe); }

  void begin_search(const Move& move) {
    search.emplace();
    search->probe = move.probe;
    search->touch = program.probing();
    const FrameMap map(machine.kinematics, move.frame);
    const Coordinates way = map.to_axes(move.end) - map.to_axes(move.start);
    if (way.tail<2>().isZero(0)) search->way = way.head<3>().normalized();
    search->replayed = seeking && done_touches < touches.size();
    if (search->replayed) {
      search->touch = touches[done_touches];
      search->stop = search->touch.at;
    } else {
      touches.resize(done_touches);
    }
  }

  /// The trigger has changed as the probing move waits for.
  void found(const ProbeReading& reading) {
    search->found = true;
    search->touch.touched = true;
    search->touch.found = touch_point(machine, reading, search->way);
    if (run) search->stop = brake_here();
    search->touch.at = run ? *search->stop : search->end;
    search->touch.rest = run ? run->at(*search->stop).q : step.position;
    touches.push_back(search->touch);
  }

  /// Brakes within the limits, if the axes do not come to rest already; where they will stand [s].
  double brake_here() {
    const double tau = path_time(), now = rate();
    rising = false;
    planned.reset();
    if (now == 0) {
      whole = false;
      law = {tau, 0, 0, 0};
    } else if (whole || law.to != 0) {
      const auto change = rates.change(*run, tau, now, 0, 1);
      begin_change(change ? *change : rates.slowest(*run, tau, now, 0));
    }
    return std::min(law.start + law.way(), run->duration());
  }

  /// At the end of a probing move: the reading is younger than the set-point.
  void await() {
    if (seconds(++search->late) < kSettleSeconds) return;
    if (must_find(search->probe)) {
      fault = ProbeFault::not_found;
      return;
    }
    search->touch.touched = false;
    search->touch.at = search->end;
    search->touch.found = search->touch.rest = step.position;
    touches.push_back(search->touch);
    end_search();
  }

  void end_search() {
    program.probed(search->touch);
    done_touches = search->replayed ? done_touches + 1 : touches.size();
    search.reset();
    unchecked = true;
  }

  // ----------------------------------------------------------------------------- the operator

  bool rapid() const { return run->path().segments().front().move.kind == Move::Kind::rapid; }

  /// The rate that the switches ask for.
  double goal(const MotionSample& now) const {
    if (rapid()) return panel.rapid;
    return now.panel == Move::Panel::acts ? panel.feed : 1;
  }

  bool at_rest() const { return !run || (!changing() && rate() == 0); }
  bool waiting() const { return at_rest() && (feed_held || wait != Wait::none); }

  /// Waits for cycle start, which nobody needs to press where nobody is there.
  void stand() {
    ++idle;
    if (!attended && seconds(idle) >= kProgramStopSeconds) start();
  }

  void start() {
    idle = 0;
    feed_held = false;
    block_done = false;
    if (wait == Wait::stop) played += stop_cycles;
    wait = Wait::none;
  }

  /// Before a cycle of motion: does the rate have to change from here on?
  void steer() {
    if (search && search->stop) return;
    constexpr Tick kBetweenTries = 10, kPatience = 500;
    const bool at_ease = panel.feed == 1 && panel.rapid == 1 && !panel.single_block && !feed_held;
    if (changing() || (at_ease && whole && !planned)) return;
    const double tau = path_time(), now = rate();
    if (planned && tau + now * kCycle > planned->start) {
      meet_planned(tau, now);
      return;
    }
    const MotionSample here = run->at(tau);
    double to = goal(here);
    if (panel.single_block) to = std::min(to, 1.0);
    if (feed_held && here.panel != Move::Panel::locked) to = 0;
    if (panel.single_block && now > 0 && to > 0 && !planned && tau >= next_stop)
      plan_stop(tau, now);
    if (now == 0) {
      if (to > 0) rise(tau, std::min(to, 1.0));
      return;
    }
    const bool fast = now > 1 && boosted_for == to;
    if (to > 1 && (now == 1 || fast)) {
      if (tau >= next_try) boost(tau, now, to);
      return;
    }
    if (to == now) return;
    if (tries++ % kBetweenTries != 0) return;
    to = std::min(to, 1.0);
    if (const auto change = rates.change(*run, tau, now, to))
      begin_change(*change);
    else if (tries > kPatience && now <= 1)
      begin_change(rates.slowest(*run, tau, now, to));
  }

  /// Begins a planned change, which ends where it was planned to.
  void meet_planned(double tau, double now) {
    const double end = planned->start + planned->way(), to = planned->to;
    begin_change({tau, now, to, 2 * std::max(end - tau, 0.0) / (now + to)});
    if (to == 0) wait = Wait::block;
  }

  /// From rest on the path.
  void rise(double tau, double to) {
    if (panel.single_block) {
      const double end = RatePlanner::block_end(*run, tau);
      if (end < run->duration()) {
        rise_within(tau, end, to);
        return;
      }
    }
    const auto change = rates.change(*run, tau, 0, to);
    begin_change(change ? *change : rates.slowest(*run, tau, 0, to));
  }

  /// From rest to rest within one block, at the largest rate that it has room for.
  void rise_within(double tau, double end, double to) {
    constexpr double kLess = 0.7, kLeast = 0.02, kShortest = 20 * kCycle;
    for (double most = to; most > kLeast; most *= kLess) {
      const auto up = rates.change(*run, tau, 0, most);
      if (!up) continue;
      const auto down = rates.change_ending(*run, end, most, 0, tau + up->way());
      if (!down) continue;
      begin_change(*up);
      planned = down;
      return;
    }
    const double most = std::min(to, (end - tau) / kShortest), time = (end - tau) / most;
    begin_change({tau, 0, most, time});
    planned = RateChange{tau + 0.5 * most * time, most, 0, time};
  }

  /// The end of this block, or of the next one that leaves room for braking.
  void plan_stop(double tau, double now) {
    constexpr int kMostBlocks = 50;
    constexpr double kNextLook = 0.02;  // more of the path is known then [s]
    double end = tau;
    for (int i = 0; i < kMostBlocks; ++i) {
      end = RatePlanner::block_end(*run, end);
      if (end >= run->duration()) break;
      planned = rates.change_ending(*run, end, now, 0, tau);
      if (planned) return;
    }
    next_stop = run->complete() ? end : tau + kNextLook;
  }

  /// Above the programmed feed as far as the plan leaves room for it, and back before that ends.
  void boost(double tau, double now, double to) {
    constexpr double kNextTry = 0.02, kNextLook = 0.2, kNarrow = 0.1;
    next_try = tau + kNextTry;
    for (const double share : {1.0, 0.75, 0.5, 0.25}) {
      const double fast = 1 + share * (to - 1);
      if (fast < now) break;
      // The way down is lengthened until it ends at a whole cycle.
      const double reserve = (2 + (1 + fast) / (fast - 1)) * kCycle;
      const double until = rates.fast_until(*run, tau, fast) - reserve;
      const double known = planned && fast == now ? planned->start + planned->way() : tau;
      if (until - known < kNarrow) continue;
      const auto up =
          fast > now ? rates.change(*run, tau, now, fast) : RateChange{tau, now, now, 0};
      if (!up) continue;
      const auto down =
          rates.change_ending(*run, until, fast, 1, tau + up->way() + 2 * fast * kCycle);
      if (!down) continue;
      if (fast > now) begin_change(*up);
      planned = down;
      boosted_for = to;
      next_try = tau + kNextLook;
      return;
    }
  }

  /// A run begins at rest, where its rate can be any at once.
  void begin_rate() {
    whole = true;
    planned.reset();
    tries = 0;
    next_try = next_stop = boosted_for = 0;
    const double to = std::min(goal(run->at(0)), 1.0);
    if (to != 1) {
      whole = false;
      law = {0, to, to, 0};
      law_cycle = 0;
    }
    if (!panel.single_block || to == 0) return;
    const double end = RatePlanner::block_end(*run, 0);
    if (end >= run->duration()) return;
    planned = rates.change_ending(*run, end, to, 0, 0);
    if (planned) return;
    whole = false;
    law = {0, 0, 0, 0};
    law_cycle = 0;
  }

  // ---------------------------------------------------------------------------------- blocks

  Block read() {
    if (!approach.empty()) {
      Block first = std::move(approach.front());
      approach.pop_front();
      return first;
    }
    Block block = program.next();
    if (const Move* move = std::get_if<Move>(&block); move && unchecked) {
      check_move(*move, machine, file_name);
      if (probing) check_probing_feed(*move, machine, *probing, file_name, program.inches());
    }
    return block;
  }

  Block take() {
    if (!pending) return read();
    Block block = std::move(*pending);
    pending.reset();
    return block;
  }

  /// Collects moves that follow without a stop, at most about as many as are planned at once.
  MoveBatch gather() {
    MoveBatch batch;
    double way = 0, time = 0, nodes = 0;
    while (!batch.open && !(last && last->probe != Move::Probe::none)) {
      if (!pending) pending = read();
      Move* next = std::get_if<Move>(&*pending);
      if (!next || (last && !continues(*last, *next))) break;
      way += way_of(*next);
      time += seconds_of(*next);
      nodes += nodes_of(*next);
      last = *next;
      if (surface && next->feed_per_turn > 0 && next->feed_mode == Move::Feed::tip)
        add_by_turns(*next, *surface, batch.moves);
      else
        batch.moves.push_back(std::move(*next));
      pending.reset();
      batch.open = batch.moves.size() >= kMostMoves || way >= kLongestWay ||
                   time >= kLongestSeconds || nodes >= kMostNodes;
    }
    batch.moves = as_allowed(std::move(batch.moves));
    return batch;
  }

  void begin_run(Move first) {
    last.reset();
    if (feels && first.probe != Move::Probe::none) begin_search(first);
    pending = std::move(first);
    MoveBatch batch = gather();
    Path path(std::move(batch.moves), machine.nc.angle_tolerance, batch.open);
    if (path.segments().empty()) {
      if (search && search->replayed) end_search();
      return;
    }
    run.emplace(std::move(path), machine, [this] { return gather(); });
    begin_wait(0);
    look_ahead();
    begin_rate();
  }

  /// Plans the run as far as it will be asked for in this cycle, by a hold and its end as well.
  void look_ahead() {
    const double tau = path_time();
    run->plan(tau, tau + ahead);
    const bool complete = run->complete() || (search && search->stop);
    cycles = complete ? cycles_of(end_of_run()) : std::numeric_limits<Tick>::max();
  }

  /// The moves of a run with what the planner allows itself.
  std::vector<Move> as_allowed(std::vector<Move> moves) const {
    for (Move& move : moves)
      if (!move.exact) move.tolerance += allowed.blend_tolerance;
    if (!(allowed.sagitta > 0)) return moves;
    std::vector<Move> result;
    result.reserve(moves.size());
    for (Move& move : moves) {
      if (move.kind == Move::Kind::arc)
        add_chords(move, allowed.sagitta, result);
      else
        result.push_back(std::move(move));
    }
    return result;
  }

  void begin_wait(double seconds) {
    begun = played;
    cycle = 0;
    cycles = cycles_of(seconds);
  }

  static Tick cycles_of(double seconds) {
    return static_cast<Tick>(std::ceil(seconds / kCycle - 1e-9));
  }

  void begin_spindle(const SpindleWord& word) {
    using Mode = SpindleWord::Mode;
    using Spindle = PlayerStep::Spindle;
    const double change = word.mode == Mode::off || word.mode == Mode::orient
                              ? step.spindle_speed
                              : word.speed + step.spindle_speed;
    switch (word.mode) {
      case Mode::off:
        step.spindle = Spindle::off;
        break;
      case Mode::clockwise:
        step.spindle = Spindle::clockwise;
        break;
      case Mode::counter_clockwise:
        step.spindle = Spindle::counter_clockwise;
        break;
      case Mode::orient:
        step.spindle = Spindle::orient;
        break;
    }
    step.spindle_speed = word.speed;
    surface = word.surface;
    begin_wait(change / machine.spindle.acceleration +
               (word.mode == Mode::orient ? kOrientSeconds : 0));
  }

  /// Before a probing move: its reading is that of axes at rest, or is waited for.
  bool settles(const Move& move) {
    const bool must = feels && !seeking && move.probe != Move::Probe::none && is_there(move.probe);
    settling = must ? settling + 1 : 0;
    if (seconds(settling) > kSettleSeconds) fault = ProbeFault::at_begin;
    return must;
  }

  /// Starts blocks until one takes time or the program ends.
  void begin_next() {
    constexpr Tick kDataEvery = 1000;
    if (played - data_at >= kDataEvery) {
      data = program.data();
      data_at = played;
    }
    while (cycle >= cycles && !step.done && wait == Wait::none && !search) {
      Block block = take();
      if (Move* move = std::get_if<Move>(&block)) {
        step.line = move->line;
        if (settles(*move)) {
          pending = std::move(block);
          return;
        }
        begin_run(std::move(*move));
      } else if (const Dwell* dwell = std::get_if<Dwell>(&block)) {
        step.line = dwell->line;
        begin_wait(dwell->seconds);
      } else if (const SpindleWord* word = std::get_if<SpindleWord>(&block)) {
        step.line = word->line;
        begin_spindle(*word);
      } else if (const ProgramStop* stop = std::get_if<ProgramStop>(&block)) {
        step.line = stop->line;
        const Tick counted = stop->optional ? 0 : cycles_of(kProgramStopSeconds);
        if (stop->optional ? panel.optional_stop && !stop->tool_change : attended) {
          wait = Wait::stop;
          stop_cycles = counted;
        } else {
          begin_wait(seconds(counted));
        }
      } else {
        step.line = std::get<ProgramEnd>(block).line;
        step.spindle = PlayerStep::Spindle::off;
        step.spindle_speed = 0;
        step.done = true;
        data = program.data();
      }
    }
  }
};

Player::Player(const std::string& path, const Machine& machine, const PlayerOptions& options) {
  GcodeInterpreter check(path, machine, options.interpreter);
  const std::optional<ProbingLimit> probing = probing_limit(machine);
  for (Block block = check.next(); !std::holds_alternative<ProgramEnd>(block); block = check.next())
    if (const Move* move = std::get_if<Move>(&block)) {
      check_move(*move, machine, path);
      if (probing) check_probing_feed(*move, machine, *probing, path, check.inches());
    }
  if (options.from_line > 0) {
    const long passes =
        GcodeInterpreter(path, machine, options.interpreter).passes_of(options.from_line);
    if (passes != 1)
      throw ProgramError(fmt::format(
          "{}:{}: the program cannot begin here: {}", path, options.from_line,
          passes == 0 ? "this line is never read"
                      : fmt::format("this line is read {} times, in a loop or a subroutine; begin "
                                    "before it",
                                    passes)));
  }
  state_ = std::make_unique<State>(path, machine, options);
}

Player::~Player() = default;

void Player::feel(const ProbeReading& reading) {
  State& state = *state_;
  state.trigger.step(reading.deflection);
  const bool searches = state.search && !state.search->found && !state.search->replayed &&
                        state.fault == ProbeFault::none && !state.held();
  if (!searches || !state.is_there(state.search->probe)) return;
  state.found(reading);
  if (!state.run) state.end_search();
}

ProbeFault Player::probe_fault() const { return state_->fault; }

const std::vector<ProbeTouch>& Player::touches() const { return state_->touches; }

void Player::hold() {
  if (!state_->holding) state_->begin_hold();
}

bool Player::held() const { return state_->held(); }

void Player::go_on() {
  if (state_->held()) state_->begin_rise();
}

bool Player::at_full_rate() const { return !state_->holding && !state_->rising; }

void Player::operate(const PanelSwitches& switches) {
  State& state = *state_;
  if (switches.feed != state.panel.feed) state.next_try = 0;
  if (switches.single_block != state.panel.single_block) state.next_stop = 0;
  if (switches.block_delete != state.panel.block_delete) {
    state.program.block_delete(switches.block_delete);
    state.unchecked = true;
  }
  if (!switches.single_block && state.panel.single_block) {
    if (state.planned && state.planned->to == 0) state.planned.reset();
  }
  state.panel = switches;
}

void Player::feed_hold() { state_->feed_held = true; }

void Player::cycle_start() { state_->start(); }

void Player::attended(bool somebody) { state_->attended = somebody; }

bool Player::waiting() const { return state_->waiting(); }

bool Player::stands_at_zero() const {
  const State& state = *state_;
  return state.run && !state.holding && state.at_rest() && !state.waiting() &&
         state.goal(state.run->at(state.path_time())) == 0;
}

const std::optional<BlockStart>& Player::begins_at() const { return state_->begins_at; }

const NcData& Player::data() const { return state_->data; }

ProgramTime Player::time() const {
  const State& state = *state_;
  const double tau = state.holding ? state.rest_time() : state.path_time();
  return {state.begun + state.whole_cycles(tau), state.run ? tau : 0};
}

AxisVector Player::rest() const {
  const State& state = *state_;
  if (!state.run) return state.step.position;
  return state.run->at(state.holding ? state.rest_time() : state.path_time()).q;
}

void Player::seek(const ProgramTime& time) {
  State& state = *state_;
  state.seeking = true;
  while (state.played < time.cycles && !state.step.done && !(state.search && !state.run)) step();
  state.seeking = false;
  if (state.played != time.cycles) throw std::out_of_range("the program ends before that moment");
  state.holding = true;
  state.whole = false;
  state.law = {time.on_path, 0, 0, seconds(1)};
  state.law_cycle = 1;
  if (state.run) state.move_on_path();
}

PlayerStep Player::step() {
  State& state = *state_;
  PlayerStep& step = state.step;
  step.velocity = {};
  step.feed = 0;
  if (state.run) state.look_ahead();
  if (state.holding) {
    if (state.run) state.brake();
    return step;
  }
  if (state.rising) {
    state.roll();
    return step;
  }
  if (!state.run && state.cycle >= state.cycles && state.panel.single_block && state.block_done)
    state.wait = State::Wait::block;
  if (state.fault != ProbeFault::none) {
    step.dwell = true;
    return step;
  }
  if (state.waiting()) {
    state.stand();
    step.dwell = true;
    return step;
  }
  if (state.search && !state.run) {
    state.await();
    step.dwell = true;
    return step;
  }
  if (state.cycle >= state.cycles) state.begin_next();
  step.dwell = false;
  if (step.done) return step;
  if (state.settling > 0 || (state.search && !state.run)) {
    step.dwell = true;
    return step;
  }
  if (state.wait == State::Wait::stop) {  // M0, M1
    state.stand();
    step.dwell = true;
    return step;
  }
  if (state.run) {
    state.steer();
    if (!state.whole) {
      state.roll();
      return step;
    }
  }
  ++state.cycle;
  ++state.played;
  if (state.run) {
    state.play();
  } else {
    step.dwell = true;
    if (state.cycle >= state.cycles) state.block_done = true;
  }
  return step;
}

}  // namespace vcnc
