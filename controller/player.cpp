#include "controller/player.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "bus/tick.hpp"
#include "controller/gcode/interpreter.hpp"
#include "controller/path.hpp"
#include "controller/planner.hpp"
#include "controller/planner_limits.hpp"
#include "model/effects/chain.hpp"

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
                        const std::string& path_name) {
  const ProbingBound bound = probing_bound(move, machine, probing);
  const char* side = bound.by == ProbingBound::By::axial ? "axial" : "lateral";
  if (bound.factor <= 0)
    throw ProgramError(fmt::format(
        "{}:{}: in a crash the probe could not be stopped between its range and its {} limit at "
        "any speed: see probe.range_mm, probe.overtravel_{}_mm, probe.overtravel_force_{}_N",
        path_name, move.line, side, side, side));
  if (move.feed_mode == Move::Feed::none || bound.factor >= 1 - kFeedRounding) return;
  const double feed = move.feed_mode == Move::Feed::tip      ? move.feed * 60e3
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
  throw ProgramError(fmt::format("{}:{}: {} is too fast for the probe: {}{}; allowed {} is {} {}",
                                 path_name, move.line, feed_word(feed), why, lever,
                                 move.feed_mode == Move::Feed::tip ? "in this direction" : "here",
                                 feed_word(feed * bound.factor),
                                 move.feed_mode == Move::Feed::tip      ? "mm/min"
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

}  // namespace

struct Player::State {
  State(const std::string& file, const Machine& the_machine)
      : machine(the_machine), program(file, the_machine) {
    for (std::size_t i = 0; i < kAxisCount; ++i) step.position[i] = machine.axes[i].limits.start;
    step.tip = start_coordinates(machine).head<3>();
    machine_chain<PlanPort>(machine.effects, 0).step(allowed, {});
  }

  const Machine machine;
  GcodeInterpreter program;
  PlanPort::Signal<double> allowed;
  std::optional<Block> pending;  ///< read, not yet played
  std::optional<Trajectory> run;
  Tick cycle = 0, cycles = 0;  ///< within the run or the dwell
  Tick begun = 0;              ///< cycles of the program when it began
  PlayerStep step;
  Tick played = 0;  ///< cycles since the program began
  bool holding = false, rising = false;
  Tick rate_cycle = 0;    ///< since the hold, or since the feed began to rise
  double rate_time = 0;   ///< T_h, T_g [s]
  double rate_start = 0;  ///< time on the path when it began [s]
  double held_rate = 0;   ///< r

  /// Time on the path of the run now [s].
  double path_time() const {
    if (!run) return 0;
    const double s = std::min(seconds(rate_cycle) / rate_time, 1.0);
    const double tau =
        holding  ? rate_start + held_rate * rate_time * (s - s * s * s + 0.5 * s * s * s * s)
        : rising ? rate_start + rate_time * (s * s * s - 0.5 * s * s * s * s)
                 : seconds(cycle);
    return std::min(tau, run->duration());
  }

  /// d tau / dt now.
  double rate() const {
    const double s = std::min(seconds(rate_cycle) / rate_time, 1.0);
    const double share = s * s * (3 - 2 * s);
    return holding ? held_rate * (1 - share) : rising ? share : 1;
  }

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
    const double tau = path_time();
    held_rate = rising ? rate() : 1;
    rate_time = run ? time_for(held_rate, tau) : kCycle;
    rate_start = tau;
    rate_cycle = 0;
    holding = true;
    rising = false;
  }

  bool held() const { return holding && (!run || seconds(rate_cycle) >= rate_time); }

  /// Time on the path at which a hold comes to rest [s].
  double rest_time() const {
    return run ? std::min(rate_start + 0.5 * held_rate * rate_time, run->duration()) : 0;
  }

  /// Whole cycles of the run or dwell that have passed at a time on its path.
  Tick whole_cycles(double tau) const {
    return run ? std::min(static_cast<Tick>(std::floor(tau / kCycle)), cycles) : cycle;
  }

  void begin_rise() {
    if (!run) {  // a dwell simply goes on
      holding = false;
      return;
    }
    const double tau = path_time();
    double time = time_for(1, tau);
    constexpr int kLooks = 8;
    for (int i = 1; i <= kLooks; ++i) time = std::max(time, time_for(1, tau + time * i / kLooks));
    // T_g / 2 = (n + fraction) cycles, so that tau is whole at its end.
    const Tick whole = whole_cycles(tau);
    const double fraction = tau / kCycle - static_cast<double>(whole);
    const double n = std::ceil(0.5 * time / kCycle);
    rate_time = 2 * (n + fraction) * kCycle;
    cycle = whole - static_cast<Tick>(n);  // what is added until then: n + fraction of T_g
    rate_start = tau;
    rate_cycle = 0;
    holding = false;
    rising = true;
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
  }

  void brake() {
    ++rate_cycle;
    move_on_path();
  }

  void rise() {
    ++rate_cycle;
    if (seconds(rate_cycle) < rate_time) {
      move_on_path();
      return;
    }
    cycle += rate_cycle;  // whole again
    rising = false;
    played = begun + cycle;
    play();
  }

  /// The run at whole cycles, as programmed.
  void play() {
    const MotionSample sample = run->at(std::min(seconds(cycle), run->duration()));
    step.position = sample.q;
    step.velocity = sample.dq;
    step.tip = sample.tip;
    step.feed = sample.tip_speed;
    step.line = sample.line;
    if (cycle >= cycles) {
      cycle = cycles;
      played = begun + cycle;
      run.reset();
    }
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
    begun = played;
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
  const std::optional<ProbingLimit> probing = probing_limit(machine);
  for (Block block = check.next(); !std::holds_alternative<ProgramEnd>(block); block = check.next())
    if (const Move* move = std::get_if<Move>(&block)) {
      check_move(*move, machine, path);
      if (probing) check_probing_feed(*move, machine, *probing, path);
    }
  state_ = std::make_unique<State>(path, machine);
}

Player::~Player() = default;

void Player::hold() {
  if (!state_->holding) state_->begin_hold();
}

bool Player::held() const { return state_->held(); }

void Player::go_on() {
  if (state_->held()) state_->begin_rise();
}

bool Player::at_full_rate() const { return !state_->holding && !state_->rising; }

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
  while (state.played < time.cycles && !state.step.done) step();
  if (state.played != time.cycles) throw std::out_of_range("the program ends before that moment");
  state.holding = true;
  state.rate_start = time.on_path;
  state.held_rate = 0;
  state.rate_time = seconds(1);
  state.rate_cycle = 1;
  if (state.run) state.move_on_path();
}

PlayerStep Player::step() {
  State& state = *state_;
  PlayerStep& step = state.step;
  step.velocity = {};
  step.feed = 0;
  if (state.holding) {
    if (state.run) state.brake();
    return step;
  }
  if (state.rising) {
    state.rise();
    return step;
  }
  if (state.cycle >= state.cycles) state.begin_next();
  step.dwell = false;
  if (step.done) return step;
  ++state.cycle;
  ++state.played;
  if (state.run)
    state.play();
  else
    step.dwell = true;
  return step;
}

}  // namespace vcnc
