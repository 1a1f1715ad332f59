#include "controller/player.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bus/tick.hpp"
#include "controller/gcode.hpp"
#include "controller/path.hpp"
#include "controller/planner.hpp"
#include "model/effects/chain.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {
namespace {

// A longer run stops once in between, so that planning it takes bounded memory.
constexpr std::size_t kMostMoves = 50'000;
constexpr double kLongestWay = 200;       ///< [m] of the controlled point
constexpr double kLongestSeconds = 3600;  ///< at the programmed feed
constexpr double kMostNodes = 1e7;        ///< of the plan, estimated
constexpr double kLongestMove = 36000;    ///< [s] at the limits of the axes
constexpr double kExactCorner = 1.0 * kDegree;
constexpr double kLargestChord = 2 * kPi / 3;  ///< angle of a chord
constexpr int kMostChords = 20'000;            ///< per arc
constexpr double kReactionCycles = 5;   ///< from the deflection to braking axes, measured 3 to 4
constexpr double kOrientSeconds = 0.2;  ///< from a standing spindle into its M19 position

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

/// Checks the travel along a move: its end, and points between where the axes' path is curved.
void check_move(const Move& move, const Machine& machine, const std::string& path_name) {
  const std::string where = path_name + ":" + std::to_string(move.line);
  const FrameMap map(machine.kinematics, move.frame);
  const Coordinates way = map.to_axes(move.end) - map.to_axes(move.start);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double share = move.kind == Move::Kind::rapid ? machine.nc.rapid_limit : 1;
    const double hours = std::abs(way[static_cast<Eigen::Index>(i)]) /
                         (share * machine.axes[i].limits.velocity) / 3600;
    if (hours > kLongestMove / 3600)
      throw ProgramError(
          fmt::format("{}: at the largest velocity of {} the move would last {:.1f} h; allowed is "
                      "up to {:.0f} h",
                      where, kAxisNames[i], hours, kLongestMove / 3600));
  }
  if (!move.frame.rtcp && move.kind != Move::Kind::arc) {
    check_travel(move.end, machine, where);
    return;
  }
  constexpr double kStep = 2e-3, kTurn = 2 * kDegree;
  const PathSegment segment = make_segment(move, 0);
  const double turn =
      std::max((move.end - move.start).tail<2>().cwiseAbs().maxCoeff(), std::abs(move.arc.sweep));
  const int parts = 1 + static_cast<int>(std::max(segment.length / kStep, turn / kTurn));
  for (int i = 0; i <= parts; ++i)
    check_travel(map.to_axes(programmed_point(segment, segment.length * i / parts).x), machine,
                 where);
}

/// A probe that meets the piece at this feed must come to rest before its mechanism does.
void check_stopping_distance(const Move& move, const Machine& machine,
                             const std::string& path_name) {
  if (!machine.probe.in_spindle || move.feed_mode == Move::Feed::rotary ||
      move.kind == Move::Kind::rapid)
    return;
  const double way = way_of(move), time = seconds_of(move);
  if (!(way > 0) || !(time > 0)) return;
  double deceleration = machine.axes[kX].limits.acceleration;
  for (const std::size_t i : {kY, kZ})
    deceleration = std::min(deceleration, machine.axes[i].limits.acceleration);
  const double speed = way / time;
  const auto allowed = [&](const Vec3& way_in_probe) {
    return largest_probing_speed(machine.probe, way_in_probe, kReactionCycles * kCycle,
                                 deceleration);
  };
  double most = std::min(allowed(Vec3::UnitX()), allowed(Vec3::UnitZ()));
  const bool tool_along_z =
      machine.kinematics.type == KinematicsParams::Type::trunnion && !move.frame.rtcp;
  const bool turns = move.start.tail<2>() != move.end.tail<2>();
  if (move.kind == Move::Kind::line && !turns && (move.frame.rtcp || tool_along_z)) {
    // One direction in the probe's frame: lateral and axial shares of the way.
    const RotaryPair iso =
        Kinematics(machine.kinematics, 0, Vec3::Zero()).counted({move.end[kA], move.end[kC]});
    const Vec3 d = move.frame.rtcp ? tool_axis(iso.a, iso.c) : Vec3(Vec3::UnitZ());
    const Vec3 direction = (move.end - move.start).head<3>().normalized();
    const double axial = std::min(std::abs(direction.dot(d)), 1.0);
    most = allowed({std::sqrt(1 - axial * axial), 0, axial});
  }
  if (speed <= most) return;
  throw ProgramError(fmt::format(
      "{}:{}: F{:.0f} is too fast for the probe: in a crash it could not be stopped between its "
      "range and its limit, or not be counted; allowed in this direction is F{:.0f}",
      path_name, move.line, speed * 60e3, std::floor(most * 60e3)));
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

}  // namespace

struct Player::State {
  State(const std::string& file, const Machine& the_machine)
      : machine(the_machine), program(file, the_machine) {
    for (std::size_t i = 0; i < kAxisCount; ++i) step.position[i] = machine.axes[i].limits.start;
    machine_chain<PlanPort>(machine.effects, 0).step(allowed, {});
  }

  const Machine machine;
  GcodeInterpreter program;
  PlanPort::Signal<double> allowed;
  std::optional<Block> pending;  ///< read, not yet played
  std::optional<Trajectory> run;
  Tick cycle = 0, cycles = 0;  ///< within the run or the dwell
  PlayerStep step;
  bool holding = false;
  Tick hold_cycle = 0;    ///< since the hold
  double hold_time = 0;   ///< T_h [s]
  double hold_start = 0;  ///< time on the path when it began [s]

  /// Begins to brake where the run stands now.
  void begin_hold() {
    constexpr double kShortest = 10 * kCycle, kShare = 0.5, kSteepest = 1.5;
    holding = true;
    hold_cycle = 0;
    hold_time = kShortest;
    if (!run) return;
    hold_start = std::min(seconds(cycle), run->duration());
    const MotionSample now = run->at(hold_start);
    for (std::size_t i = 0; i < kAxisCount; ++i)
      hold_time = std::max(hold_time, kSteepest * std::abs(now.dq[i]) /
                                          (kShare * machine.axes[i].limits.acceleration));
  }

  bool held() const { return holding && (!run || seconds(hold_cycle) >= hold_time); }

  /// One cycle of braking along the path.
  void brake() {
    ++hold_cycle;
    const double s = std::min(seconds(hold_cycle) / hold_time, 1.0);
    const double rate = 1 - s * s * (3 - 2 * s);
    const double passed = hold_time * (s - s * s * s + 0.5 * s * s * s * s);
    const MotionSample sample = run->at(std::min(hold_start + passed, run->duration()));
    step.position = sample.q;
    step.line = sample.line;
    step.feed = sample.tip_speed * rate;
    for (std::size_t i = 0; i < kAxisCount; ++i) step.velocity[i] = sample.dq[i] * rate;
  }

  Block take() {
    if (!pending) return program.next();
    Block block = std::move(*pending);
    pending.reset();
    return block;
  }

  /// Collects the moves that follow without a stop, and plans them.
  void begin_run(Move first) {
    std::vector<Move> moves{std::move(first)};
    double way = way_of(moves.back()), time = seconds_of(moves.back());
    double nodes = nodes_of(moves.back());
    while (moves.size() < kMostMoves && way < kLongestWay && time < kLongestSeconds &&
           nodes < kMostNodes) {
      pending = program.next();
      Move* next = std::get_if<Move>(&*pending);
      if (!next || !continues(moves.back(), *next)) break;
      moves.push_back(std::move(*next));
      pending.reset();
      way += way_of(moves.back());
      time += seconds_of(moves.back());
      nodes += nodes_of(moves.back());
    }
    Path path(as_allowed(std::move(moves)), machine.nc.angle_tolerance);
    if (path.segments().empty()) return;
    run.emplace(std::move(path), machine);
    begin_wait(run->duration());
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
    cycle = 0;
    cycles = static_cast<Tick>(std::ceil(seconds / kCycle - 1e-9));
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
    begin_wait(change / machine.spindle.acceleration +
               (word.mode == Mode::orient ? kOrientSeconds : 0));
  }

  /// Starts blocks until one takes time or the program ends.
  void begin_next() {
    while (cycle >= cycles && !step.done) {
      Block block = take();
      if (Move* move = std::get_if<Move>(&block)) {
        step.line = move->line;
        begin_run(std::move(*move));
      } else if (const Dwell* dwell = std::get_if<Dwell>(&block)) {
        step.line = dwell->line;
        begin_wait(dwell->seconds);
      } else if (const SpindleWord* word = std::get_if<SpindleWord>(&block)) {
        step.line = word->line;
        begin_spindle(*word);
      } else if (const ProgramStop* stop = std::get_if<ProgramStop>(&block)) {
        step.line = stop->line;
        if (!stop->optional) begin_wait(kProgramStopSeconds);
      } else {
        step.line = std::get<ProgramEnd>(block).line;
        step.spindle = PlayerStep::Spindle::off;
        step.spindle_speed = 0;
        step.done = true;
      }
    }
  }
};

Player::Player(const std::string& path, const Machine& machine) {
  GcodeInterpreter check(path, machine);
  for (Block block = check.next(); !std::holds_alternative<ProgramEnd>(block); block = check.next())
    if (const Move* move = std::get_if<Move>(&block)) {
      check_move(*move, machine, path);
      check_stopping_distance(*move, machine, path);
    }
  state_ = std::make_unique<State>(path, machine);
}

Player::~Player() = default;

void Player::hold() {
  if (!state_->holding) state_->begin_hold();
}

bool Player::held() const { return state_->held(); }

PlayerStep Player::step() {
  State& state = *state_;
  if (state.holding) {
    state.step.velocity = {};
    state.step.feed = 0;
    if (state.run) state.brake();
    return state.step;
  }
  if (state.cycle >= state.cycles) state.begin_next();
  PlayerStep& step = state.step;
  step.velocity = {};
  step.feed = 0;
  step.dwell = false;
  if (step.done) return step;
  ++state.cycle;
  if (!state.run) {
    step.dwell = true;
    return step;
  }
  const double t = std::min(seconds(state.cycle), state.run->duration());
  const MotionSample sample = state.run->at(t);
  step.position = sample.q;
  step.velocity = sample.dq;
  step.feed = sample.tip_speed;
  step.line = sample.line;
  if (state.cycle == state.cycles) state.run.reset();
  return step;
}

}  // namespace vcnc
