#include "controller/gcode.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

namespace vcnc {
namespace {

constexpr std::string_view kAllowedG =
    "G0 G1 G2 G3 G4 G17 G18 G19 G20 G21 G28 G40 G43 G43.4 G49 G53 G54..G59 G61 G64 G90 G91 G93 G94";
constexpr std::string_view kAllowedM = "M0 M1 M2 M3 M4 M5 M19 M30";
constexpr std::string_view kAxisLetters = "XYZAC";
constexpr double kRadiusTolerance = 2e-6, kRadiusToleranceShare = 1e-3;
constexpr double kLargestTolerance = 5e-3;

/// Words of one group exclude each other in a line.
enum class Group { motion, once, plane, units, cutter, length, offset, path, distance, feed };

/// G codes by ten times their number (G43.4 = 434).
const std::map<int, Group>& g_codes() {
  static const std::map<int, Group> codes{
      {0, Group::motion},     {10, Group::motion},    {20, Group::motion},
      {30, Group::motion},    {40, Group::once},      {280, Group::once},
      {530, Group::once},     {170, Group::plane},    {180, Group::plane},
      {190, Group::plane},    {200, Group::units},    {210, Group::units},
      {400, Group::cutter},   {430, Group::length},   {434, Group::length},
      {490, Group::length},   {540, Group::offset},   {550, Group::offset},
      {560, Group::offset},   {570, Group::offset},   {580, Group::offset},
      {590, Group::offset},   {610, Group::path},     {640, Group::path},
      {900, Group::distance}, {910, Group::distance}, {930, Group::feed},
      {940, Group::feed}};
  return codes;
}

enum class MGroup { stop, spindle };
const std::map<int, MGroup>& m_codes() {
  static const std::map<int, MGroup> codes{{0, MGroup::stop},    {1, MGroup::stop},
                                           {2, MGroup::stop},    {30, MGroup::stop},
                                           {3, MGroup::spindle}, {4, MGroup::spindle},
                                           {5, MGroup::spindle}, {19, MGroup::spindle}};
  return codes;
}

/// The number of a code word in steps of 1/scale, or -1 where it is none.
int code_number(double value, double scale) {
  const double scaled = value * scale;
  const double whole = std::round(scaled);
  return value >= 0 && std::abs(scaled - whole) < 1e-6 ? static_cast<int>(whole) : -1;
}

Coordinates as_coordinates(const AxisVector& q) { return Eigen::Map<const Coordinates>(q.data()); }

AxisVector as_axes(const Coordinates& x) { return {x[0], x[1], x[2], x[3], x[4]}; }

Coordinates start_position(const Machine& machine) {
  Coordinates q;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    q[static_cast<Eigen::Index>(i)] = machine.axes[i].limits.start;
  return q;
}

}  // namespace

FrameMap::FrameMap(const KinematicsParams& params, const MotionFrame& frame) {
  if (frame.rtcp) kinematics_.emplace(params, frame.tool_length, frame.p_MW);
}

Coordinates FrameMap::to_axes(const Coordinates& x) const {
  if (!kinematics_) return x;
  return as_coordinates(kinematics_->inverse(x.head<3>(), x[kA], x[kC]));
}

Coordinates FrameMap::from_axes(const Coordinates& q) const {
  if (!kinematics_) return q;
  Coordinates x = q;
  x.head<3>() = kinematics_->forward(as_axes(q)).p_WT;
  return x;
}

// ------------------------------------------------------------------------------------ one line

struct GcodeInterpreter::Line {
  std::map<Group, int> g;
  std::map<MGroup, int> m;
  std::array<std::optional<double>, 26> words;

  bool has(char letter) const { return words[static_cast<std::size_t>(letter - 'A')].has_value(); }
  double value(char letter) const { return *words[static_cast<std::size_t>(letter - 'A')]; }
  bool is(Group group, int code) const {
    const auto found = g.find(group);
    return found != g.end() && found->second == code;
  }
  bool any_axis() const {
    for (const char letter : kAxisLetters)
      if (has(letter)) return true;
    return false;
  }
};

GcodeInterpreter::GcodeInterpreter(const std::string& path, const Machine& machine)
    : machine_(machine),
      lines_(path),
      map_(machine.kinematics, {}),
      position_(start_position(machine)) {
  modal_.tolerance = machine.nc.blend_tolerance;
}

void GcodeInterpreter::fail(const std::string& reason) const {
  throw ProgramError(lines_.where() + ": " + reason);
}

Block GcodeInterpreter::next() {
  std::string text;
  while (ready_.empty()) {
    if (ended_) return ProgramEnd{lines_.number()};
    if (!lines_.next(text)) {
      if (lines_.number() == 0) throw ProgramError(lines_.where() + ": the program is empty");
      fail("the program does not end with M2 or M30");
    }
    read_line(text);
  }
  Block block = std::move(ready_.front());
  ready_.pop_front();
  return block;
}

GcodeInterpreter::Line GcodeInterpreter::sort_words(const std::vector<Word>& words) const {
  Line line;
  for (const Word& word : words) {
    if (word.letter == 'G') {
      const auto code = g_codes().find(code_number(word.value, 10));
      if (code == g_codes().end())
        fail(fmt::format("unknown {}; allowed are {}", word.text, kAllowedG));
      if (!line.g.emplace(code->second, code->first).second)
        fail(fmt::format("{} and another G word of the same group in one block; allowed is one",
                         word.text));
    } else if (word.letter == 'M') {
      const auto code = m_codes().find(code_number(word.value, 1));
      if (code == m_codes().end())
        fail(fmt::format("unknown {}; allowed are {}", word.text, kAllowedM));
      if (!line.m.emplace(code->second, code->first).second)
        fail(fmt::format("{} and another M word of the same group in one block; allowed is one",
                         word.text));
    } else if (std::string_view("ACFHIJKNOPRSXYZ").find(word.letter) == std::string_view::npos) {
      fail(fmt::format("unknown word {}; allowed letters are A C F G H I J K M N O P R S X Y Z",
                       word.text));
    } else {
      auto& slot = line.words[static_cast<std::size_t>(word.letter - 'A')];
      if (slot) fail(fmt::format("{} given twice in one block; allowed is once", word.text));
      slot = word.value;
    }
  }
  return line;
}

void GcodeInterpreter::read_line(const std::string& text) {
  const Line line = sort_words(split_words(text, lines_.where()));
  const bool dwell = line.is(Group::once, 40), reference = line.is(Group::once, 280);
  const bool motion_word = line.g.contains(Group::motion);
  if ((dwell || reference) && motion_word)
    fail("G4 or G28 together with a motion word in one block; write them in two blocks");
  if (dwell && line.any_axis()) fail("G4 takes no axis words; allowed is P (seconds)");
  const bool wants_p = dwell || line.is(Group::path, 640);
  if (dwell && line.is(Group::path, 640)) fail("G4 and G64 in one block both use P");
  if (line.has('P') && !wants_p) fail("P without G4 or G64");

  set_modes(line);
  set_feed(line);
  set_spindle(line);
  if (dwell) {
    if (!line.has('P')) fail("G4 without P (seconds)");
    const double seconds = line.value('P');
    if (!(seconds >= 0 && seconds <= 36000)) fail("P of G4 must be 0 to 36000 seconds");
    ready_.emplace_back(Dwell{seconds, lines_.number()});
  }
  if (reference)
    emit_reference_return(line);
  else
    emit_motion(line);

  if (const auto stop = line.m.find(MGroup::stop); stop != line.m.end()) {
    if (stop->second <= 1) {
      ready_.emplace_back(ProgramStop{stop->second == 1, lines_.number()});
    } else {
      ready_.emplace_back(ProgramEnd{lines_.number()});
      ended_ = true;
    }
  }
}

// --------------------------------------------------------------------------------------- modes

void GcodeInterpreter::set_modes(const Line& line) {
  for (const auto& [group, code] : line.g) {
    switch (group) {
      case Group::motion: modal_.motion = code / 10; break;
      case Group::plane: modal_.normal = code == 170 ? kZ : code == 180 ? kY : kX; break;
      case Group::units: modal_.length_unit = code == 200 ? 25.4e-3 : 1e-3; break;
      case Group::distance: modal_.absolute = code == 900; break;
      case Group::feed:
        if (modal_.inverse_time != (code == 930)) modal_.linear_feed = modal_.rotary_feed = 0;
        modal_.inverse_time = code == 930;
        break;
      case Group::offset: modal_.offset = static_cast<std::size_t>(code / 10 - 54); break;
      default: break;
    }
  }
  if (line.is(Group::path, 610)) modal_.exact = true;
  if (line.is(Group::path, 640)) {
    modal_.exact = false;
    modal_.tolerance = machine_.nc.blend_tolerance;
    if (line.has('P')) modal_.tolerance = line.value('P') * modal_.length_unit;
    if (!(modal_.tolerance >= 1e-8 && modal_.tolerance <= kLargestTolerance))
      fail("P of G64 must be a tolerance from 0.00001 to 5 mm");
  }
  if (const auto length = line.g.find(Group::length); length != line.g.end())
    set_tool_length(line, length->second);
  else if (line.has('H'))
    fail("H without G43 or G43.4");
  enter_frame();
}

void GcodeInterpreter::set_tool_length(const Line& line, int code) {
  if (code == 490) {
    if (line.has('H')) fail("H together with G49");
    modal_.length = Modal::Length::none;
    modal_.tool_length = 0;
    return;
  }
  const char* name = code == 434 ? "G43.4" : "G43";
  if (modal_.length == Modal::Length::rtcp)
    fail(fmt::format("{} while G43.4 is active; cancel with G49 first", name));
  if (!line.has('H')) fail(fmt::format("{} without H", name));
  const int h = code_number(line.value('H'), 1);
  try {
    modal_.tool_length = machine_.tool_length(h);
  } catch (const std::out_of_range&) {
    const std::size_t known = machine_.setup.tool_length.size();
    fail(fmt::format("unknown H{}; allowed are H0 to H{}", line.value('H'), known > 0 ? known : 1));
  }
  modal_.length = code == 434 ? Modal::Length::rtcp : Modal::Length::along_z;
}

MotionFrame GcodeInterpreter::frame() const {
  if (modal_.length != Modal::Length::rtcp) return {};
  return {true, machine_.setup.work_offset[modal_.offset], modal_.tool_length};
}

void GcodeInterpreter::enter_frame() {
  const MotionFrame wanted = frame();
  if (wanted == frame_) return;
  const Coordinates q = map_.to_axes(position_);
  frame_ = wanted;
  map_ = FrameMap(machine_.kinematics, frame_);
  position_ = map_.from_axes(q);
}

void GcodeInterpreter::set_feed(const Line& line) {
  if (!line.has('F')) {
    // Inverse time holds for one block only.
    if (modal_.inverse_time) modal_.linear_feed = modal_.rotary_feed = 0;
    return;
  }
  const double f = line.value('F');
  if (!(f > 0)) fail(fmt::format("F{} must be greater than 0", f));
  modal_.linear_feed = modal_.inverse_time ? f / 60 : f * modal_.length_unit / 60;
  modal_.rotary_feed = modal_.inverse_time ? f / 60 : f * kDegree / 60;
}

void GcodeInterpreter::set_spindle(const Line& line) {
  if (line.has('S')) {
    const double rpm = line.value('S');
    modal_.spindle_speed = rpm * unit::rpm.to_si;
    if (!(rpm >= 0 && modal_.spindle_speed <= machine_.spindle.max_speed * (1 + 1e-9)))
      fail(fmt::format("S{} is out of range; allowed is 0 to {:.0f} rpm", rpm,
                       machine_.spindle.max_speed / unit::rpm.to_si));
  }
  const auto found = line.m.find(MGroup::spindle);
  if (found == line.m.end()) return;
  SpindleWord word{SpindleWord::Mode::off, 0, lines_.number()};
  if (found->second == 19) word.mode = SpindleWord::Mode::orient;
  if (found->second == 3 || found->second == 4) {
    if (machine_.probe.in_spindle)
      fail(fmt::format("M{}: probe in spindle: only M19 is allowed", found->second));
    if (!(modal_.spindle_speed > 0)) fail(fmt::format("M{} without S", found->second));
    word.mode = found->second == 3 ? SpindleWord::Mode::clockwise
                                   : SpindleWord::Mode::counter_clockwise;
    word.speed = modal_.spindle_speed;
  }
  ready_.emplace_back(word);
}

// -------------------------------------------------------------------------------------- motion

Coordinates GcodeInterpreter::target(const Line& line, bool machine_coordinates) const {
  Coordinates end = position_;
  const Vec3& offset = machine_.setup.work_offset[modal_.offset];
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const char letter = kAxisLetters[i];
    if (!line.has(letter)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double word = line.value(letter) * (is_rotary(i) ? kDegree : modal_.length_unit);
    if (!modal_.absolute) {
      end[row] += word;
      continue;
    }
    end[row] = word;
    if (machine_coordinates || is_rotary(i) || frame_.rtcp) continue;
    end[row] += offset[row];
    if (i == kZ) end[row] += modal_.tool_length;
  }
  return end;
}

void GcodeInterpreter::emit_motion(const Line& line) {
  const bool machine_coordinates = line.is(Group::once, 530);
  const bool arc = modal_.motion.value_or(0) >= 2;
  const bool arc_words = line.has('I') || line.has('J') || line.has('K') || line.has('R');
  if (arc_words && !arc) fail("I, J, K or R without G2 or G3");
  if (!line.any_axis() && !arc_words) {
    if (machine_coordinates) fail("G53 without axis words");
    if (line.g.contains(Group::motion) && arc)
      fail("arc without end point and centre; allowed are axis words with I J K or R");
    return;
  }
  if (line.is(Group::once, 40)) return;
  if (!modal_.motion) fail("axis words without G0, G1, G2 or G3");
  if (machine_coordinates) {
    if (arc) fail("G53 with G2 or G3; allowed are G0 and G1");
    if (!modal_.absolute) fail("G53 under G91; allowed is G90");
    if (frame_.rtcp) fail("G53 while G43.4 is active; cancel with G49 first");
  }

  Move move;
  move.start = position_;
  move.end = target(line, machine_coordinates);
  move.alone = machine_coordinates;
  if (arc) {
    move.kind = Move::Kind::arc;
    move.arc = arc_to(line, move.end);
  } else {
    move.kind = *modal_.motion == 0 ? Move::Kind::rapid : Move::Kind::line;
  }
  if (move.kind != Move::Kind::rapid) {
    if (!(modal_.linear_feed > 0))
      fail(fmt::format("G{} without F{}", *modal_.motion,
                       modal_.inverse_time ? "; under G93 every block needs its own" : ""));
    const bool turns_only = !arc && move.start.head<3>() == move.end.head<3>();
    move.feed_mode = modal_.inverse_time ? Move::Feed::time
                     : turns_only        ? Move::Feed::rotary
                                         : Move::Feed::tip;
    move.feed = modal_.inverse_time ? 1 / modal_.linear_feed
                : turns_only        ? modal_.rotary_feed
                                    : modal_.linear_feed;
  }
  emit_move(std::move(move));
}

Arc GcodeInterpreter::arc_to(const Line& line, const Coordinates& end) const {
  if (!frame_.rtcp && (line.has('A') || line.has('C')))
    fail("G2 or G3 with A or C; allowed only while G43.4 is active");
  const std::size_t n = modal_.normal;
  const auto u = static_cast<Eigen::Index>((n + 1) % 3), v = static_cast<Eigen::Index>((n + 2) % 3);
  constexpr std::string_view kCentreLetters = "IJK";
  if (line.has(kCentreLetters[n]))
    fail(fmt::format("{} does not lie in the plane G{}", kCentreLetters[n], 19 - n));
  const Eigen::Vector2d from(position_[u], position_[v]), to(end[u], end[v]);
  const char centre_u = kCentreLetters[static_cast<std::size_t>(u)];
  const char centre_v = kCentreLetters[static_cast<std::size_t>(v)];
  const bool by_centre = line.has(centre_u) || line.has(centre_v);
  const bool clockwise = *modal_.motion == 2;
  if (by_centre == line.has('R'))
    fail(by_centre ? "arc with R and with I J K; allowed is one of both"
                   : "arc without centre; allowed are I J K or R");

  Eigen::Vector2d centre = from;
  if (by_centre) {
    if (line.has(centre_u)) centre[0] += line.value(centre_u) * modal_.length_unit;
    if (line.has(centre_v)) centre[1] += line.value(centre_v) * modal_.length_unit;
  } else {
    const double r = line.value('R') * modal_.length_unit;
    const Eigen::Vector2d chord = to - from;
    const double half = chord.norm() / 2;
    if (half < 1e-9) fail("arc by R that ends where it starts; give the centre by I J K");
    const double excess = half - std::abs(r);
    if (excess > kRadiusTolerance + kRadiusToleranceShare * std::abs(r))
      fail(fmt::format("R{} is shorter than half the chord, {:.4f} mm", line.value('R'),
                       half * 1e3));
    // Up to half a turn for R > 0, more for R < 0; the centre lies left of the chord for the
    // shorter counter-clockwise arc.
    const double rise = std::sqrt(std::max(0.0, r * r - half * half));
    const Eigen::Vector2d left = Eigen::Vector2d(-chord[1], chord[0]) / (2 * half);
    centre = from + chord / 2 + left * (((r > 0) != clockwise) ? rise : -rise);
  }

  const Eigen::Vector2d r0 = from - centre, r1 = to - centre;
  if (r0.norm() < 1e-9) fail("arc of radius 0");
  const double mismatch = std::abs(r0.norm() - r1.norm());
  if (mismatch > kRadiusTolerance + kRadiusToleranceShare * r0.norm())
    fail(fmt::format("radius mismatch: {:.4f} mm at the start, {:.4f} mm at the end; allowed is a "
                     "difference of 2 um + 0.1 %",
                     r0.norm() * 1e3, r1.norm() * 1e3));
  double sweep = std::atan2(r0[0] * r1[1] - r0[1] * r1[0], r0.dot(r1));
  const bool closed = (to - from).norm() < 1e-9;
  if (clockwise)
    sweep = closed ? -2 * kPi : sweep >= 0 ? sweep - 2 * kPi : sweep;
  else
    sweep = closed ? 2 * kPi : sweep <= 0 ? sweep + 2 * kPi : sweep;

  Arc arc{Vec3::Zero(), n, sweep};
  arc.centre[u] = centre[0];
  arc.centre[v] = centre[1];
  return arc;
}

void GcodeInterpreter::emit_reference_return(const Line& line) {
  if (!line.any_axis()) fail("G28 without axis words; allowed are the axes that shall go home");
  if (frame_.rtcp) fail("G28 while G43.4 is active; cancel with G49 first");
  const Coordinates home = start_position(machine_);
  Move move;
  move.kind = Move::Kind::rapid;
  move.alone = true;
  move.start = position_;
  move.end = target(line, false);
  const Coordinates via = move.end;
  emit_move(move);
  move.start = move.end = via;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (line.has(kAxisLetters[i]))
      move.end[static_cast<Eigen::Index>(i)] = home[static_cast<Eigen::Index>(i)];
  emit_move(move);
}

void GcodeInterpreter::emit_move(Move move) {
  move.frame = frame_;
  move.exact = modal_.exact;
  move.tolerance = modal_.tolerance;
  move.line = lines_.number();
  position_ = move.end;
  if (move.start == move.end && move.kind != Move::Kind::arc) return;
  ready_.emplace_back(std::move(move));
}

}  // namespace vcnc
