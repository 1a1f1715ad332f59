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

namespace vcnc {
namespace {

// A longer run stops once in between, so that planning it takes bounded memory.
constexpr std::size_t kMostMoves = 50'000;
constexpr double kLongestWay = 200;       ///< [m] of the controlled point
constexpr double kLongestSeconds = 3600;  ///< at the programmed feed
constexpr double kExactCorner = 1.0 * kDegree;
constexpr double kLargestChord = 2 * kPi / 3;  ///< angle of a chord
constexpr int kMostChords = 20'000;            ///< per arc
constexpr double kOrientSeconds = 0.2;         ///< from a standing spindle into its M19 position

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
    while (moves.size() < kMostMoves && way < kLongestWay && time < kLongestSeconds) {
      pending = program.next();
      Move* next = std::get_if<Move>(&*pending);
      if (!next || !continues(moves.back(), *next)) break;
      moves.push_back(std::move(*next));
      pending.reset();
      way += way_of(moves.back());
      time += seconds_of(moves.back());
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
    if (const Move* move = std::get_if<Move>(&block)) check_move(*move, machine, path);
  state_ = std::make_unique<State>(path, machine);
}

Player::~Player() = default;

PlayerStep Player::step() {
  State& state = *state_;
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
