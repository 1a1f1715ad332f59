// The part of the interpreter that turns axis words into moves.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr double kStillTip = 1e-7;      ///< a shorter way counts as a pure turn of A and C [m]
constexpr double kLongestMove = 36000;  ///< [s]; beyond it F is surely a mistake
constexpr double kLongestDwell = 36000;
constexpr int kMostTurns = 10'000;
constexpr std::size_t kMostProbings = 100'000;
constexpr std::string_view kCentreLetters = "IJK";

bool is_cycle(int code) {
  return code == 730 || code == 740 || code == 760 || (code > 800 && code <= 890);
}

}  // namespace

// ------------------------------------------------------------------------------------- targets

Coordinates ProgramRun::target(bool machine_coordinates) {
  Coordinates end = position_;
  words_.use(kAxisLetters);
  if ((work_.rotated() || polar_) && !machine_coordinates) {
    Coordinates words = work_.to_words(position_);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (!words_.has(kAxisLetters[i])) continue;
      const auto row = static_cast<Eigen::Index>(i);
      const double word = in_si(i, words_.value(kAxisLetters[i]));
      words[row] = absolute(kAxisLetters[i]) ? word : words[row] + word;
    }
    if (polar_) put_polar(words);
    Coordinates x = work_.to_frame(words);
    for (const char letter : {'A', 'C'})
      if (const Way way = way_[static_cast<std::size_t>(letter - 'A')]; way >= Way::shortest) {
        const auto row = static_cast<Eigen::Index>(letter == 'A' ? kA : kC);
        x[row] = turned(x[row], position_[row], way);
      }
    return x;
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const char letter = kAxisLetters[i];
    if (!words_.has(letter)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double word = in_si(i, words_.value(letter));
    if (machine_coordinates)
      end[row] = word;
    else if (absolute(letter))
      end[row] = work_.to_frame(word, row);
    else
      end[row] += word;
    if (const Way way = way_[static_cast<std::size_t>(letter - 'A')]; way >= Way::shortest)
      end[row] = turned(end[row], position_[row], way);
  }
  return end;
}

/// G16: the first axis of the plane is a radius, the second an angle. Under G90 they count from the
/// 0 of the program and from the first axis, under G91 from the present position and angle.
void ProgramRun::put_polar(Coordinates& words) {
  const auto u = static_cast<Eigen::Index>((modal_.normal + 1) % 3);
  const auto v = static_cast<Eigen::Index>((modal_.normal + 2) % 3);
  const char radius = kAxisLetters[static_cast<std::size_t>(u)];
  const char angle = kAxisLetters[static_cast<std::size_t>(v)];
  if (!words_.has(radius) && !words_.has(angle)) return;
  if (words_.has(radius)) {
    const Coordinates here = work_.to_words(position_);
    polar_->centre = modal_.absolute ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(here[u], here[v]);
    polar_->radius = length(radius);
  }
  if (words_.has(angle))
    polar_->angle = words_.value(angle) * kDegree + (absolute(angle) ? 0 : polar_->angle);
  words[u] = polar_->centre[0] + polar_->radius * std::cos(polar_->angle);
  words[v] = polar_->centre[1] + polar_->radius * std::sin(polar_->angle);
}

/// How lengths and the sense of rotation in the active plane change on their way into the frame.
PlaneMap ProgramRun::plane_map(const char* what) const {
  constexpr double kRounding = 1e-9;
  const auto n = static_cast<Eigen::Index>(modal_.normal);
  const auto u = (n + 1) % 3, v = (n + 2) % 3;
  const Mat3 m = work_.linear();
  PlaneMap map;
  map.turn << m(u, u), m(u, v), m(v, u), m(v, v);
  map.scale = map.turn.col(0).norm();
  map.mirrored = map.turn.determinant() < 0;
  const Eigen::Matrix2d square = map.turn.transpose() * map.turn;
  const double most = kRounding * map.scale * map.scale;
  if (!square.isApprox(map.scale * map.scale * Eigen::Matrix2d::Identity(), kRounding))
    fail(fmt::format(
             "{} while the axes of the plane are scaled differently: it would be an ellipse", what),
         words_.column(GGroup::motion));
  if (std::abs(m(n, u)) > most || std::abs(m(n, v)) > most)
    fail(fmt::format("{} in the plane G{} while coordinates are rotated out of it", what,
                     19 - modal_.normal),
         words_.column(GGroup::motion));
  return map;
}

/// G43.5 and TRAORI: the tool's direction in the workpiece instead of A and C.
void ProgramRun::take_tool_vector(Coordinates& end) {
  Vec3 d = Vec3::Zero();
  int column = 0;
  if (vector_given_) {
    if (modal_.length != GcodeModal::Length::rtcp && modal_.length != GcodeModal::Length::vector)
      fail("A3= B3= C3= without TRAORI");
    if (!work_.program().shifts_only())
      fail("A3= B3= C3= under ROT, SCALE or MIRROR; allowed is TRANS");
    d = Vec3(vector_[0], vector_[1], vector_[2]);
  } else if (modal_.length == GcodeModal::Length::vector && words_.any_of("IJK")) {
    words_.use("IJK");
    for (const char c : kCentreLetters) {
      if (words_.has(c)) column = words_.column(c);
      d[c - 'I'] = words_.value_or(c, 0);
    }
  } else {
    return;
  }
  if (words_.any_of("AC")) fail("A or C together with the direction of the tool", column);
  if (!(d.norm() > 1e-9)) fail("the direction of the tool is 0", column);
  if (tilted_) d = tilt_rotation(frame_.tilt) * d;
  const Kinematics kinematics(machine_.kinematics, 0, Vec3::Zero());
  const RotaryPair before = kinematics.counted({position_[kA], position_[kC]});
  const RotaryPair after = kinematics.counted(rotary_from_axis(d.normalized(), before));
  end[kA] = after.a;
  end[kC] = after.c;
}

// -------------------------------------------------------------------------------------- motion

void ProgramRun::emit_motion() {
  const int code = modal_.motion;
  if (words_.code(GGroup::once) == 40 || words_.code(MGroup::tool) >= 0) {
    if (words_.code(GGroup::once) == 40 && words_.any_axis()) fail("G4 takes no axis words");
  }
  // What G43.1 or G68.2 took are no end points.
  const bool taken = words_.code(GGroup::length) == 431 || words_.code(GGroup::rotation) == 680 ||
                     words_.code(GGroup::rotation) == 682 || words_.code(GGroup::scaling) == 510 ||
                     words_.has(GGroup::mirror);
  const bool explicit_motion = words_.has(GGroup::motion);
  if (taken && explicit_motion && code != 800)
    fail("a motion word and one that takes its axis words in one block; write them in two blocks",
         words_.column(GGroup::motion));
  const bool moves =
      !taken &&
      (words_.any_axis() || vector_given_ ||
       (modal_.length == GcodeModal::Length::vector && code <= 10 && words_.any_of("IJK")));
  const bool machine_coordinates = words_.code(GGroup::once) == 530;
  if (is_cycle(code)) {
    if (moves || explicit_motion) emit_cycle(code);
    return;
  }
  if (code == 20 || code == 30 || code == kCircleThroughPoint || code == kTangentialCircle) {
    if (taken) return;
    const bool centre = words_.any_of("IJKR") || via_given_ != 0;
    if (!moves && !centre) {
      if (explicit_motion)
        fail("arc without end point and centre; allowed are axis words with I J K or R",
             words_.column(GGroup::motion));
      return;
    }
    if (machine_coordinates) fail("G53 with G2 or G3; allowed are G0 and G1");
    emit_arc();
    return;
  }
  if (!moves) {
    if (machine_coordinates) fail("G53 without axis words");
    if (code >= 310 && code <= 385 && explicit_motion)
      fail(code_name(code) + " without axis words");
    return;
  }
  if (code == 800)
    fail("axis words without G0, G1, G2, G3 or a cycle",
         words_.column(kAxisLetters[static_cast<std::size_t>(
                                        std::find_if(kAxisLetters.begin(), kAxisLetters.end(),
                                                     [&](char c) { return words_.has(c); }) -
                                        kAxisLetters.begin()) %
                                    kAxisCount]));
  if (code == 330 || code == 331)
    emit_thread(code);
  else if (measures_ && code == 10)
    emit_probe(310);
  else if (code >= 310)
    emit_probe(code);
  else
    emit_straight(code);
}

void ProgramRun::emit_straight(int code) {
  const bool machine_coordinates = words_.code(GGroup::once) == 530;
  if (machine_coordinates) {
    const int column = words_.column(GGroup::once);
    if (!modal_.absolute) fail("G53 under G91; allowed is G90", column);
    if (frame_.rtcp) fail("G53 while G43.4 or G68.2 is active; cancel it first", column);
    need_no_compensation("G53", column);
  }
  Move move;
  move.start = position_;
  move.end = target(machine_coordinates);
  take_tool_vector(move.end);
  move.alone = machine_coordinates;
  move.kind = code == 0 ? Move::Kind::rapid : Move::Kind::line;
  if (code != 0) set_move_feed(move);
  emit_move(std::move(move));
}

/// Of the word that makes an arc what it is.
int ProgramRun::column_of_arc() const {
  for (const char letter : {'R', 'I', 'J', 'K', 'X', 'Y', 'Z'})
    if (words_.has(letter)) return words_.column(letter);
  return words_.column(GGroup::motion);
}

void ProgramRun::emit_arc() {
  Move move;
  move.start = position_;
  move.end = target();
  move.kind = Move::Kind::arc;
  try {
    move.arc = modal_.motion == kCircleThroughPoint ? arc_through_point(move.end)
               : modal_.motion == kTangentialCircle ? arc_along_tangent(move.end)
                                                    : arc_to(move.end);
    if (move.arc.sweep == 0) move.kind = Move::Kind::line;
  } catch (const LineError& error) {
    if (error.column > 0) throw;
    throw LineError(error.what(), column_of_arc());
  }
  set_move_feed(move);
  emit_move(std::move(move));
}

/// G31, G38.n.
void ProgramRun::emit_probe(int code) {
  const std::string name = measures_ ? "MEAS=" : code_name(code);
  need_no_compensation(name.c_str(), words_.column(GGroup::motion));
  if (modal_.feed != 940) fail(name + " needs a feed per minute (G94)");
  words_.use("P");
  Move move;
  move.start = position_;
  move.end = target();
  if ((move.end - move.start).isZero(0)) fail(name + " ends where it starts");
  move.kind = Move::Kind::line;
  move.probe = code == 382   ? Move::Probe::touch
               : code == 384 ? Move::Probe::leave
               : code == 385 ? Move::Probe::leave_or_end
                             : Move::Probe::touch_or_end;
  move.alone = true;
  set_move_feed(move);
  move.panel = Move::Panel::fixed;
  emit_move(std::move(move));
  if (++probings_ > kMostProbings)
    fail(fmt::format("more than {} probing moves", kMostProbings), words_.column(GGroup::motion));
  probing_ = {.line = line_number(), .touched = true};
  probing_.target = as_axes(work_.to_words(position_));
  probing_.found = probing_.rest = as_axes(map_.to_axes(position_));
  if (const ProbeTouch* known = known_touch())
    probing_ = *known;
  else if (guessed_ == 0)
    guessed_ = probing_.line;
  probed(probing_);
}

/// What is known of the probing move, if it is the same one: its line and what it is told to do.
const ProbeTouch* ProgramRun::known_touch() const {
  constexpr double kRounding = 1e-9;
  if (probings_ > options_.touches.size()) return nullptr;
  const ProbeTouch& known = options_.touches[probings_ - 1];
  bool same = known.line == probing_.line;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    same = same && std::abs(known.target[i] - probing_.target[i]) < kRounding;
  return same ? &known : nullptr;
}

void ProgramRun::probed(const ProbeTouch& touch) {
  probing_ = touch;
  const auto in_frame = [&](const AxisVector& q) {
    return map_.from_axes(Eigen::Map<const Coordinates>(q.data()));
  };
  position_ = in_frame(touch.rest);
  probed_ = work_.to_words(in_frame(touch.found));
  probe_success_ = touch.touched ? 1 : 0;
}

/// G33, G33.1: a line whose feed is K per turn of the spindle, at the speed that S gives it; what
/// the operator does must not part them. G33.1 taps: it goes back as it came, the spindle reversed.
void ProgramRun::emit_thread(int code) {
  const std::string name = code_name(code);
  const int column = words_.column(GGroup::motion);
  need_no_compensation(name.c_str(), column);
  words_.use("K");
  if (!words_.has('K')) fail(name + " without K (the way per turn)", column);
  if (!(length('K') > 0))
    fail(fmt::format("K{:g} of {}: allowed is more than 0", words_.value('K'), name),
         words_.column('K'));
  if (modal_.spindle != 3 && modal_.spindle != 4)
    fail(name + " with the spindle at rest; M3 or M4 first", column);
  if (modal_.surface) fail(name + " under G96; allowed is G97", column);
  if (!(modal_.spindle_speed > 0)) fail(name + " without S", column);
  if (words_.any_of("AC")) fail(name + " with A or C; allowed are X Y Z", column);
  Move move;
  move.start = position_;
  move.end = target();
  const Coordinates way = move.end - move.start;
  if (way.isZero(0)) fail(name + " ends where it starts", column);
  move.kind = Move::Kind::line;
  move.feed_mode = Move::Feed::tip;
  move.feed_per_turn = length('K');
  move.feed = move.feed_per_turn * modal_.spindle_speed / (2 * kPi);
  move.panel = Move::Panel::locked;
  move.alone = code == 331;
  for (std::size_t i = 0; i < 3 && !options_.bare && !frame_.rtcp; ++i) {
    const double most = machine_.axes[i].limits.velocity;
    const double needed = move.feed * std::abs(way[static_cast<Eigen::Index>(i)]) / way.norm();
    if (needed > most)
      fail(fmt::format("{}: at this S and K {} would need {:.0f} mm/min; allowed is {:.0f}", name,
                       kAxisNames[i], needed * 60e3, most * 60e3),
           column);
  }
  const Coordinates start = move.start, end = move.end;
  emit_move(move);
  if (code == 330) return;
  cycle_spindle(modal_.spindle == 3 ? 4 : 3);
  move.start = end;
  move.end = start;
  emit_move(move);
  cycle_spindle(modal_.spindle);
}

void ProgramRun::set_move_feed(Move& move) const {
  if (!(modal_.linear_feed > 0))
    fail(fmt::format("{} without F{}", code_name(modal_.motion),
                     modal_.feed == 930 ? "; under G93 every block needs its own" : ""));
  if (!modal_.feed_override) move.panel = Move::Panel::fixed;
  const Coordinates way = move.end - move.start;
  double tip = way.head<3>().norm();
  if (move.kind == Move::Kind::arc) {
    Vec3 radius = move.start.head<3>() - move.arc.centre;
    radius[static_cast<Eigen::Index>(move.arc.normal)] = 0;
    tip = std::max(tip, std::abs(move.arc.sweep) * radius.norm());
  }
  double per_minute = 1;
  if (modal_.feed == 950) {
    const double speed = spindle_speed_at(move.end[kX]);
    if (!(speed > 0)) fail("feed per turn (G95) without S");
    per_minute = speed / (2 * kPi);  // turns per second
    move.feed_per_turn = modal_.linear_feed;
  }
  double seconds = 0;
  if (modal_.feed == 930) {
    move.feed_mode = Move::Feed::time;
    seconds = move.feed = 1 / modal_.linear_feed;
  } else if (tip < kStillTip) {
    move.feed_mode = Move::Feed::rotary;
    move.feed = modal_.rotary_feed * per_minute;
    seconds = way.tail<2>().norm() / move.feed;
  } else {
    move.feed_mode = Move::Feed::tip;
    move.feed = modal_.linear_feed * per_minute;
    seconds = tip / move.feed;
  }
  if (seconds > kLongestMove)
    fail(fmt::format("at this F the move would last {:.1f} h; allowed is up to {:.0f} h",
                     seconds / 3600, kLongestMove / 3600));
}

Arc ProgramRun::arc_to(const Coordinates& end) {
  if (modal_.length == GcodeModal::Length::vector)
    fail("G2 or G3 while G43.5 is active; allowed are G0 and G1");
  const std::size_t n = modal_.normal;
  const PlaneMap map = work_.rotated() ? plane_map("G2 or G3") : PlaneMap();
  const auto u = static_cast<Eigen::Index>((n + 1) % 3), v = static_cast<Eigen::Index>((n + 2) % 3);
  if (words_.has(kCentreLetters[n]))
    fail(fmt::format("{} does not lie in the plane G{}", kCentreLetters[n], 19 - n),
         words_.column(kCentreLetters[n]));
  const char centre_u = kCentreLetters[static_cast<std::size_t>(u)];
  const char centre_v = kCentreLetters[static_cast<std::size_t>(v)];
  const bool by_centre = words_.has(centre_u) || words_.has(centre_v);
  const bool clockwise = (modal_.motion == 20) != map.mirrored;
  if (by_centre == words_.has('R'))
    fail(by_centre ? "arc with R and with I J K; allowed is one of both"
                   : "arc without centre; allowed are I J K or R",
         words_.column('R'));
  const auto absolute_way = [&](char letter) {
    return words_.has(letter) && way_[static_cast<std::size_t>(letter - 'A')] == Way::absolute;
  };
  const bool centre_absolute = absolute_way(centre_u) || absolute_way(centre_v);
  words_.use("IJKRP");
  int turns = 1;
  if (words_.has('P')) {
    turns = whole_number(words_.value('P'));
    if (turns < 1 || turns > kMostTurns)
      fail(fmt::format("P{:g}: the turns of an arc are a whole number from 1 to {}",
                       words_.value('P'), kMostTurns),
           words_.column('P'));
  }
  const Vec2 from(position_[u], position_[v]), to(end[u], end[v]);
  PlanarArc planar;
  if (!by_centre) {
    planar = arc_of_radius(from, to, map.scale * length('R'), clockwise, turns);
  } else if (modal_.arc_absolute || centre_absolute) {
    if (!words_.has(centre_u) || !words_.has(centre_v))
      fail(fmt::format("under G90.1 an arc needs {} and {}", centre_u, centre_v));
    Coordinates centre = work_.to_words(position_);
    centre[u] = length(centre_u);
    centre[v] = length(centre_v);
    centre = work_.to_frame(centre);
    planar = arc_about(from, to, {centre[u], centre[v]}, clockwise, turns);
  } else {
    Vec2 way = Vec2::Zero();
    if (words_.has(centre_u)) way[0] = length(centre_u);
    if (words_.has(centre_v)) way[1] = length(centre_v);
    if (work_.rotated()) {
      way = map.turn * way;
    }
    planar = arc_about(from, to, from + way, clockwise, turns);
  }
  Arc arc{Vec3::Zero(), n, planar.sweep};
  arc.centre[u] = planar.centre[0];
  arc.centre[v] = planar.centre[1];
  return arc;
}

// ------------------------------------------------------------------------------------ the rest

void ProgramRun::emit_dwell() {
  const int column = words_.column(GGroup::once);
  if (words_.has(GGroup::motion))
    fail("G4 or G28 together with a motion word in one block; write them in two blocks", column);
  if (words_.code(GGroup::path) == 640 && words_.has('P'))
    fail("G4 and G64 in one block both use P", column);
  double seconds = -1;
  if (words_.has('P')) {
    words_.use("P");
    // Fanuc counts P in milliseconds.
    seconds = words_.value('P') * (fanuc_ ? 1e-3 : 1);
  } else if (fanuc_ && words_.has('X')) {
    words_.use("X");
    seconds = words_.value('X');
  } else if (siemens_dialect_ && words_.has('F')) {
    words_.use("F");
    seconds = words_.value('F');
  } else if (siemens_dialect_ && words_.has('S')) {
    const double speed = spindle_speed_at(position_[kX]);
    if (!(speed > 0)) fail("G4 S (turns of the spindle) without a speed of the spindle", column);
    words_.use("S");
    seconds = words_.value('S') * 2 * kPi / speed;
  } else {
    if (words_.any_axis()) fail("G4 takes no axis words; allowed is P (seconds)", column);
    fail("G4 without P (seconds)", column);
  }
  if (words_.any_axis() && !(fanuc_ && !words_.any_of("YZAC")))
    fail("G4 takes no axis words; allowed is P (seconds)", column);
  if (!(seconds >= 0 && seconds <= kLongestDwell))
    fail("P of G4 must be 0 to 36000 seconds", words_.column('P'));
  emit(Dwell{seconds, line_number()});
}

/// G28, G30: by the point given to the reference position; G28.1, G30.1 keep the position as such.
void ProgramRun::emit_reference_return(int code) {
  const int column = words_.column(GGroup::once);
  Coordinates& reference = code < 300 ? home_ : second_home_;
  if (code == 281 || code == 301) {
    reference = map_.to_axes(position_);
    return;
  }
  const std::string name = code_name(code);
  if (frame_.rtcp) fail(name + " while G43.4 is active; cancel with G49 first", column);
  need_no_compensation(name.c_str(), column);
  need_no_scaling(name.c_str(), column);
  words_.use("P");
  Move move;
  move.kind = Move::Kind::rapid;
  move.alone = true;
  move.start = position_;
  move.end = target();
  const Coordinates via = move.end;
  const bool all = !words_.any_axis();
  if (!all) emit_move(move);
  move.start = move.end = via;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (all || words_.has(kAxisLetters[i]))
      move.end[static_cast<Eigen::Index>(i)] = reference[static_cast<Eigen::Index>(i)];
  emit_move(move);
}

/// G53.1: turns A and C until the tool stands along z of the tilted plane; X Y Z stand still.
void ProgramRun::emit_tool_align() {
  if (!tilted_) fail("G53.1 without G68.2", words_.column(GGroup::once));
  const Kinematics kinematics(machine_.kinematics, 0, Vec3::Zero());
  const Vec3 d = tilt_rotation(frame_.tilt) * Vec3::UnitZ();
  const RotaryPair before = kinematics.counted({position_[kA], position_[kC]});
  const RotaryPair after = kinematics.counted(rotary_from_axis(d, before));
  Move move;
  move.kind = Move::Kind::rapid;
  move.alone = true;
  move.start = move.end = map_.to_axes(position_);
  move.end[kA] = after.a;
  move.end[kC] = after.c;
  const Coordinates end = move.end;
  if (move.start != move.end) {
    move.exact = modal_.exact;
    move.tolerance = modal_.tolerance;
    move.dynamics = modal_.dynamics;
    move.line = line_number();
    move.column = column_of_block();
    emit(move);
  }
  position_ = map_.from_axes(end);
}

void ProgramRun::emit_move(Move move) {
  move.frame = frame_;
  move.exact = modal_.exact || words_.code(GGroup::once) == 90;
  move.tolerance = modal_.tolerance;
  move.dynamics = modal_.dynamics;
  move.line = line_number();
  move.column = column_of_block();
  if (siemens_dialect_) turn_tangent(move);
  position_ = move.end;
  if (move.start == move.end && move.kind != Move::Kind::arc) return;
  emit(std::move(move));
}

}  // namespace vcnc
