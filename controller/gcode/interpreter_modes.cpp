// The part of the interpreter that keeps the modes: planes, units, feeds, spindle, tools, offsets.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr double kLargestTolerance = 5e-3;
constexpr double kNoFeed = 0;
constexpr double kLargestTool = 1;  ///< radius [m]

}  // namespace

void ProgramRun::need_no_compensation(const char* what, int column) const {
  if (compensation_.active())
    fail(fmt::format("{} while cutter compensation is on; cancel with G40 first", what), column);
}

void ProgramRun::set_modes() {
  if (words_.has(GGroup::motion)) {
    const int code = words_.code(GGroup::motion);
    const bool in_cycle = modal_.motion >= 730 && modal_.motion != 800;
    if (!in_cycle) cycle_ = {};
    modal_.motion = code;
  }
  if (words_.has(GGroup::plane)) {
    const int code = words_.code(GGroup::plane);
    const std::size_t normal = code == 170 ? kZ : code == 180 ? kY : kX;
    if (normal != modal_.normal)
      need_no_compensation("change of the plane", words_.column(GGroup::plane));
    modal_.normal = normal;
  }
  if (words_.has(GGroup::units))
    modal_.length_unit = words_.code(GGroup::units) == 200 ? 25.4e-3 : 1e-3;
  if (words_.has(GGroup::distance)) modal_.absolute = words_.code(GGroup::distance) == 900;
  if (words_.has(GGroup::arc_distance))
    modal_.arc_absolute = words_.code(GGroup::arc_distance) == 901;
  if (words_.has(GGroup::retract)) modal_.to_initial = words_.code(GGroup::retract) == 980;
  if (words_.has(GGroup::feed)) {
    const int code = words_.code(GGroup::feed);
    if (modal_.feed != code) modal_.linear_feed = modal_.rotary_feed = kNoFeed;
    modal_.feed = code;
  }
  set_modal_stack();
}

void ProgramRun::set_path_mode() {
  if (!words_.has(GGroup::path)) return;
  modal_.exact = words_.code(GGroup::path) != 640;
  if (modal_.exact) return;
  words_.use("PQ");
  modal_.tolerance = machine_.nc.blend_tolerance;
  if (words_.has('P')) modal_.tolerance = length('P');
  if (!(modal_.tolerance >= 1e-8 && modal_.tolerance <= kLargestTolerance))
    fail("P of G64 must be a tolerance from 0.00001 to 5 mm", words_.column('P'));
}

/// G5.1 Q1 R1 (speed) .. R10 (quality), as Fanuc's AI contour control has them.
void ProgramRun::set_dynamics() {
  using Dynamics = NcParams::Dynamics;
  constexpr double kLevels = 10, kFastLevels = 5;
  const int column = words_.column(GGroup::once);
  words_.use("QRP");
  if (!words_.has('Q')) fail("G5.1 without Q", column);
  modal_.dynamics = machine_.nc.dynamics;
  if (words_.value('Q') == 0 || !words_.has('R')) return;
  const double level = words_.value('R');
  if (!(level >= 1 && level <= kLevels && level == std::floor(level)))
    fail("R of G5.1 must be a level from 1 (fast) to 10 (smooth)", words_.column('R'));
  modal_.dynamics = level <= kFastLevels ? Dynamics::fast : Dynamics::smooth;
}

/// G5 P10000, G5 P0 of Fanuc: blocks are always taken this fast.
void ProgramRun::set_high_speed() {
  const int column = words_.column(GGroup::once);
  if (!fanuc_) fail(fmt::format("unknown G5; allowed are {}", kKnownG), column);
  words_.use("P");
  if (!words_.has('P')) fail("G5 without P (10000: on, 0: off)", column);
}

void ProgramRun::set_feed() {
  const bool dwell = siemens_dialect_ && words_.code(GGroup::once) == 40;
  if (!words_.has('F') || dwell) {
    // Inverse time holds for one block only.
    if (modal_.feed == 930) modal_.linear_feed = modal_.rotary_feed = kNoFeed;
    return;
  }
  words_.use("F");
  const double f = words_.value('F');
  if (!(f > 0)) fail(fmt::format("F{:g} must be greater than 0", f), words_.column('F'));
  switch (modal_.feed) {
    case 930:
      modal_.linear_feed = modal_.rotary_feed = f / 60;
      break;
    case 950:
      modal_.linear_feed = f * modal_.length_unit;
      modal_.rotary_feed = f * kDegree;
      break;
    default:
      modal_.linear_feed = f * modal_.length_unit / 60;
      modal_.rotary_feed = f * kDegree / 60;
  }
}

void ProgramRun::check_speed(double rpm) const {
  const double most = machine_.spindle.max_speed;
  if (!(rpm >= 0 && (options_.bare || rpm * unit::rpm.to_si <= most * (1 + 1e-9))))
    fail(fmt::format("S{:g} is out of range; allowed is 0 to {:.0f} rpm", rpm,
                     most / unit::rpm.to_si),
         words_.column('S'));
}

/// G96 S D: S in m/min or ft/min at the distance of X from the 0 of the program, at most D rpm.
/// G97: S in rpm; without it the speed stays what it has become.
void ProgramRun::set_surface_speed() {
  constexpr double kFoot = 0.3048;
  const int column = words_.column(GGroup::spindle);
  if (words_.code(GGroup::spindle) == 970) {
    modal_.spindle_speed = spindle_speed_at(position_[kX]);
    modal_.surface.reset();
    return;
  }
  if (words_.code(GGroup::spindle) == 960) {
    words_.use("D");
    if (!words_.has('S')) fail("G96 without S (the speed of the surface)", column);
    if (work_.rotated()) fail("G96 while coordinates are rotated; cancel with G69", column);
    const double most = words_.value_or('D', 0) * unit::rpm.to_si;
    if (words_.has('D') && !(most > 0))
      fail(fmt::format("D{:g} of G96: allowed is a speed of more than 0 rpm", words_.value('D')),
           words_.column('D'));
    modal_.surface.emplace();
    modal_.surface->most = machine_.spindle.max_speed;
    if (words_.has('D') && (options_.bare || most < modal_.surface->most))
      modal_.surface->most = most;
    if (modal_.speed_limit > 0)
      modal_.surface->most = std::min(modal_.surface->most, modal_.speed_limit);
  }
  words_.use("S");
  const double speed = words_.value('S');
  if (!(speed > 0))
    fail(fmt::format("S{:g} under G96 must be greater than 0", speed), words_.column('S'));
  modal_.surface->speed = speed * (modal_.length_unit == 1e-3 ? 1 : kFoot) / 60;
  modal_.surface->axis = work_.to_frame(0, kX);
}

double ProgramRun::spindle_speed_at(double x) const {
  return modal_.surface ? modal_.surface->at(x) : modal_.spindle_speed;
}

void ProgramRun::set_spindle() {
  if (siemens_dialect_ && words_.code(GGroup::once) == 40) return;  // turns of G4
  if (fanuc_ && words_.code(GGroup::once) == 920 && words_.has('S')) {
    words_.use("S");
    check_speed(words_.value('S'));
    modal_.speed_limit = words_.value('S') * unit::rpm.to_si;
    if (modal_.surface) modal_.surface->most = modal_.speed_limit;
    return;
  }
  const bool by_surface = words_.has(GGroup::spindle) || (modal_.surface && words_.has('S'));
  if (by_surface) set_surface_speed();
  if (words_.has('S') && !modal_.surface) {
    words_.use("S");
    check_speed(words_.value('S'));
    modal_.spindle_speed = words_.value('S') * unit::rpm.to_si;
  }
  if (words_.has(MGroup::spindle)) {
    emit_spindle(words_.code(MGroup::spindle));
  } else if ((words_.has('S') || by_surface) && (modal_.spindle == 3 || modal_.spindle == 4)) {
    emit_spindle(modal_.spindle);
  }
}

void ProgramRun::emit_spindle(int code) {
  if (fanuc_ || code == 19) words_.use("R");
  const int column = words_.column(MGroup::spindle);
  SpindleWord word{SpindleWord::Mode::off, 0, line_number()};
  if (code == 19) word.mode = SpindleWord::Mode::orient;
  if (code == 3 || code == 4) {
    if (machine_.probe.in_spindle && !options_.bare)
      fail(fmt::format("M{}: probe in spindle: only M19 is allowed", code), column);
    word.speed = spindle_speed_at(position_[kX]);
    word.surface = modal_.surface;
    if (!(word.speed > 0) && !options_.bare && words_.has(MGroup::spindle))
      fail(fmt::format("M{} without S", code), column);
    word.mode = code == 3 ? SpindleWord::Mode::clockwise : SpindleWord::Mode::counter_clockwise;
  }
  modal_.spindle = code;
  emit(word);
}

// --------------------------------------------------------------------------------------- tools

const ToolEntry& ProgramRun::tool(double number, char letter) {
  const ToolEntry* entry = tools_.find(whole_number(number));
  if (!entry)
    fail(fmt::format("unknown {}{:g}; allowed are {}", letter, number, tools_.known()),
         words_.column(letter));
  return *entry;
}

void ProgramRun::set_tool() {
  if (words_.has('T')) {
    words_.use("T");
    tool(words_.value('T'), 'T');
    selected_tool_ = whole_number(words_.value('T'));
  }
  const int override = words_.code(MGroup::override);
  if (override == 48 || override == 49) modal_.feed_override = override == 48;
  if (override >= 50) words_.use("P");
  if (override == 50) modal_.feed_override = words_.value_or('P', 1) != 0;
  const int code = words_.code(MGroup::tool);
  if (code < 0) return;
  need_no_compensation("tool change", words_.column(MGroup::tool));
  if (code == 61) {
    words_.use("Q");
    if (!words_.has('Q'))
      fail("M61 without Q (the number of the tool)", words_.column(MGroup::tool));
    tool(words_.value('Q'), 'Q');
    tool_in_spindle_ = whole_number(words_.value('Q'));
    return;
  }
  tool_in_spindle_ = selected_tool_;
  modal_.spindle = 5;
  emit(ProgramStop{true, line_number(), true});
}

/// M62 .. M68. Outputs act on nothing. Inputs are all off and stay so: M66 with L0 reads 0, L4
/// (off) is met at once, every other wait ends after Q seconds with #5399 = -1.
void ProgramRun::set_outputs() {
  const int code = words_.code(MGroup::output);
  if (code < 0) return;
  constexpr int kMostPins = 64;
  constexpr double kLongestWait = 36000;
  const int column = words_.column(MGroup::output);
  const auto pin = [&](char letter) {
    words_.use(std::string_view(&letter, 1));
    if (!words_.has(letter))
      fail(fmt::format("M{} without {} (which input or output)", code, letter), column);
    const int number = whole_number(words_.value(letter));
    if (number < 0 || number >= kMostPins)
      fail(fmt::format("{}{:g} of M{}: allowed are 0 to {}", letter, words_.value(letter), code,
                       kMostPins - 1),
           words_.column(letter));
  };
  if (code <= 65) {
    pin('P');
    return;
  }
  if (code >= 67) {
    pin('E');
    words_.use("Q");
    return;
  }
  need_no_compensation("M66", column);
  if (words_.has('P') == words_.has('E'))
    fail("M66 needs P (digital input) or E (analog input), one of both", column);
  pin(words_.has('P') ? 'P' : 'E');
  words_.use("LQ");
  const int how = words_.has('L') ? whole_number(words_.value('L')) : 0;
  if (how < 0 || how > 4)
    fail(fmt::format("L{:g} of M66: allowed are 0 to 4", words_.value('L')), words_.column('L'));
  if (words_.has('E') && how != 0)
    fail("M66 E with L: an analog input can only be read (L0)", words_.column('L'));
  const double wait = words_.value_or('Q', 0);
  if (!(wait >= 0 && wait <= kLongestWait))
    fail("Q of M66 must be 0 to 36000 seconds", words_.column('Q'));
  if (how > 0 && !(wait > 0)) fail("M66 that waits needs Q (seconds) greater than 0", column);
  const bool waits = how >= 1 && how <= 3;
  input_ = waits ? -1 : 0;
  if (waits) emit(Dwell{wait, line_number()});
}

void ProgramRun::set_tool_length() {
  using Length = GcodeModal::Length;
  int code = words_.code(GGroup::length);
  if (siemens_ == 1) code = 434;
  if (siemens_ == 2) code = 490;
  if (code < 0) return;
  const int column = words_.column(GGroup::length);
  const std::string name = siemens_ ? "TRAORI" : code_name(code);
  if (code == 490) {
    modal_.length = Length::none;
    modal_.tool_length = 0;
    work_.tool.setZero();
    h_ = 0;
  } else {
    if (modal_.length == Length::rtcp || modal_.length == Length::vector)
      fail(fmt::format("{} while G43.4 is active; cancel with G49 first", name), column);
    if (code == 431) {
      words_.use(kAxisLetters);
      for (std::size_t i = 0; i < kAxisCount; ++i)
        if (words_.has(kAxisLetters[i]))
          work_.tool[static_cast<Eigen::Index>(i)] = in_si(i, words_.value(kAxisLetters[i]));
      if (!words_.any_axis()) fail("G43.1 without axis words", column);
      modal_.length = Length::offset;
    } else {
      words_.use("H");
      double h = words_.value_or('H', tool_in_spindle_);
      if (siemens_ && !words_.has('H') && tool_in_spindle_ == 0) h = d_ > 0 ? d_ : 1;
      if (!words_.has('H') && !siemens_ && code != 430)
        fail(fmt::format("{} without H", name), column);
      const ToolEntry& entry = tool(h, 'H');
      h_ = whole_number(h);
      if (code == 432) {
        work_.tool += entry.offset;
        modal_.length = Length::offset;
      } else {
        work_.tool = entry.offset;
        modal_.length = code == 430 ? Length::offset : code == 434 ? Length::rtcp : Length::vector;
        if (code != 430) {
          need_no_compensation(name.c_str(), column);
          if (work_.g68_angle != 0 || work_.g5x().rotation != 0)
            fail(fmt::format("{} while coordinates are rotated; cancel with G69", name), column);
          modal_.tool_length = entry.offset[kZ];
        }
      }
    }
  }
  enter_frame();
}

void ProgramRun::set_cutter() {
  if (words_.has('D')) {
    if (fanuc_ || siemens_dialect_) {
      words_.use("D");
      tool(words_.value('D'), 'D');
      d_ = whole_number(words_.value('D'));
    }
  }
  const int code = words_.code(GGroup::cutter);
  if (code < 0) return;
  const int column = words_.column(GGroup::cutter);
  if (code == 400) {
    compensation_.end();
    return;
  }
  const std::string name = code_name(code);
  if (compensation_.active())
    fail(name + " while cutter compensation is on; cancel with G40 and a straight move", column);
  if (frame_.rtcp) fail(name + " while G43.4 is active; cancel with G49 first", column);
  words_.use("D");
  double radius = 0;
  if (code == 411 || code == 421) {
    words_.use("L");
    if (!words_.has('D')) fail(name + " without D (the diameter)", column);
    radius = 0.5 * length('D');
  } else {
    const double d = words_.value_or('D', fanuc_ ? d_ : tool_in_spindle_);
    radius = 0.5 * tool(d, 'D').diameter;
  }
  bool left = code < 420;
  if (radius < 0) {
    left = !left;
    radius = -radius;
  }
  if (radius > kLargestTool) fail(name + ": a tool of more than 2 m", column);
  if (work_.rotated() && plane_map(name.c_str()).mirrored) left = !left;
  if (radius > 0) compensation_.begin(radius, left, modal_.normal);
}

// ------------------------------------------------------------------------------------- offsets

void ProgramRun::set_offsets() {
  const int code = words_.code(GGroup::offset);
  if (code < 0) return;
  const int column = words_.column(GGroup::offset);
  auto system = static_cast<std::size_t>(code % 10 ? 5 + code % 10 : code / 10 - 54);
  if (code == 541 || (fanuc_ && code == 540 && words_.has('P'))) {
    words_.use("P");
    if (!words_.has('P')) fail("G54.1 without P (1 to 48)", column);
    const int p = whole_number(words_.value('P'));
    if (p < 1 || p > static_cast<int>(WorkCoordinates::kMore))
      fail(fmt::format("P{:g} of {}: allowed are 1 to {}", words_.value('P'), code_name(code),
                       WorkCoordinates::kMore),
           words_.column('P'));
    system = WorkCoordinates::kSystems + static_cast<std::size_t>(p - 1);
  }
  if (system != work_.active && !siemens_dialect_) need_no_scaling(code_name(code).c_str(), column);
  if (system != work_.active) need_no_compensation("change of the work offset", column);
  if (frame_.rtcp && work_.systems[system].rotation != 0)
    fail(fmt::format("{} is rotated and G43.4 is active", code_name(code)), column);
  work_.select(system);
  enter_frame();
}

MotionFrame ProgramRun::frame() const {
  using Length = GcodeModal::Length;
  const bool rtcp = modal_.length == Length::rtcp || modal_.length == Length::vector;
  MotionFrame f;
  if (!rtcp && !tilted_) return f;
  f.rtcp = true;
  f.p_MW = work_.g5x().shift.head<3>();
  f.tool_length = rtcp ? modal_.tool_length : work_.tool[kZ];
  if (tilted_) {
    f.tilt_origin = frame_.tilt_origin;
    f.tilt = frame_.tilt;
  }
  return f;
}

void ProgramRun::enter_frame() {
  const MotionFrame wanted = frame();
  work_.rtcp = wanted.rtcp;
  if (wanted == frame_) return;
  const Coordinates q = map_.to_axes(position_);
  frame_ = wanted;
  map_ = FrameMap(machine_.kinematics, frame_);
  position_ = map_.from_axes(q);
}

void ProgramRun::need_no_scaling(const char* what, int column) const {
  if (!siemens_dialect_ && !work_.program().none())
    fail(fmt::format("{} under G51 or G51.1; cancel with G50 or G50.1 first", what), column);
}

/// G15, G16: what axis words of the plane are, see put_polar().
void ProgramRun::set_polar() {
  if (words_.code(GGroup::polar) == 150) {
    polar_.reset();
    return;
  }
  const Coordinates here = work_.to_words(position_);
  const auto u = static_cast<Eigen::Index>((modal_.normal + 1) % 3);
  const auto v = static_cast<Eigen::Index>((modal_.normal + 2) % 3);
  polar_.emplace();
  polar_->radius = std::hypot(here[u], here[v]);
  polar_->angle = std::atan2(here[v], here[u]);
}

/// P I J K of G51: a factor below 10, or in thousandths from 100 on.
double ProgramRun::scale_factor(char letter) const {
  constexpr double kFactors = 10, kThousandths = 100, kMost = 999'999;
  const double word = words_.value(letter), size = std::abs(word);
  const double factor = size < kFactors ? word : word / 1000;
  const bool allowed = size > 0 && (size < kFactors || (size >= kThousandths && size <= kMost)) &&
                       (letter != 'P' || word > 0);
  if (!allowed)
    fail(fmt::format("{}{:g} of G51: allowed is a factor below 10, or thousandths from 100 on",
                     letter, word),
         words_.column(letter));
  return factor;
}

/// G51 X Y Z P (I J K), G50: scaling about a point. G51.1 X Y Z, G50.1: mirrored at lines square to
/// the axes named. Mirrored first, then scaled, then rotated by G68; source: Fanuc series 30i.
void ProgramRun::set_scaling() {
  const int scaling = words_.code(GGroup::scaling), mirror = words_.code(GGroup::mirror);
  const int column = words_.column(scaling >= 0 ? GGroup::scaling : GGroup::mirror);
  const std::string name = code_name(scaling >= 0 ? scaling : mirror);
  if (siemens_dialect_) fail(fmt::format("unknown {}; allowed are SCALE and MIRROR", name), column);
  if (scaling >= 0 && mirror >= 0) fail("G51 and G51.1 in one block; write them in two", column);
  need_no_compensation(name.c_str(), column);
  if (work_.g68_angle != 0)
    fail(fmt::format("{} while coordinates are rotated; cancel with G69 first", name), column);
  if (words_.any_of("AC")) fail(name + " with A or C; allowed are X Y Z", column);
  const Coordinates here = work_.to_words(position_);
  constexpr std::string_view kLinear = "XYZ", kFactors = "IJK";
  if (scaling == 500) scaling_.factor = Vec3::Ones();
  if (scaling == 510) {
    words_.use("XYZPIJK");
    if (words_.has('P') == words_.any_of(kFactors))
      fail("G51 needs P (all axes) or I J K (each its own)", column);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      scaling_.centre[row] = words_.has(kLinear[i]) ? length(kLinear[i]) : here[row];
      const char letter = words_.has('P') ? 'P' : kFactors[i];
      scaling_.factor[row] = words_.has(letter) ? scale_factor(letter) : 1;
    }
  }
  if (mirror >= 0) words_.use("XYZ");
  if (mirror == 511 && !words_.any_of(kLinear)) fail("G51.1 without X, Y or Z", column);
  for (std::size_t i = 0; i < 3 && mirror >= 0; ++i) {
    const bool named = words_.has(kLinear[i]);
    if (mirror == 501 && (named || !words_.any_of(kLinear))) scaling_.mirrored[i] = false;
    if (mirror == 511 && named) {
      scaling_.mirrored[i] = true;
      scaling_.mirror[static_cast<Eigen::Index>(i)] = length(kLinear[i]);
    }
  }
  ProgramFrame own;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double factor = scaling_.factor[row], side = scaling_.mirrored[i] ? -1 : 1;
    const double mirrored = scaling_.mirrored[i] ? 2 * scaling_.mirror[row] : 0;
    own.linear(row, row) = factor * side;
    own.shift[row] = factor * mirrored + (1 - factor) * scaling_.centre[row];
  }
  work_.program(own);
}

void ProgramRun::set_rotation() {
  const int code = words_.code(GGroup::rotation);
  if (code != 680 && code != 690) return;
  const int column = words_.column(GGroup::rotation);
  if (code == 690) {
    if (work_.g68_angle != 0) need_no_compensation("G69", column);
    work_.g68_angle = 0;
    return;
  }
  if (frame_.rtcp) fail("G68 while G43.4 or G68.2 is active; cancel with G49 or G69 first", column);
  if (modal_.normal != kZ) fail("G68 turns in the plane G17 only", column);
  need_no_compensation("G68", column);
  if (!words_.has('R')) fail("G68 without R (the angle)", column);
  words_.use("XYR");
  const Coordinates here = work_.to_words(position_);
  Vec3 centre = here.head<3>();
  if (words_.has('X')) centre[0] = length('X');
  if (words_.has('Y')) centre[1] = length('Y');
  // Scaled and mirrored like everything else (Fanuc).
  const ProgramFrame& own = work_.program();
  work_.g68_centre = (own.linear * centre + own.shift.head<3>()).head<2>();
  const double side = own.linear.topLeftCorner<2, 2>().determinant() < 0 ? -1 : 1;
  const double angle = side * words_.value('R') * kDegree;
  work_.g68_angle = modal_.absolute ? angle : work_.g68_angle + angle;
}

void ProgramRun::set_tilt() {
  const int code = words_.code(GGroup::rotation);
  const int column = words_.column(GGroup::rotation);
  if (code == 690 && tilted_) {
    tilted_ = false;
    enter_frame();
  }
  if (code != 682) return;
  need_no_compensation("G68.2", column);
  if (tilted_) fail("G68.2 while a plane is tilted already; cancel with G69 first", column);
  if (frame_.rtcp) fail("G68.2 while G43.4 is active; cancel with G49 first", column);
  if (work_.rotated()) fail("G68.2 while coordinates are rotated; cancel with G69 first", column);
  words_.use("XYZIJK");
  const auto euler = [&](char c) { return words_.value_or(c, 0) * kDegree; };
  MotionFrame tilted = frame_;
  tilted.tilt_origin = {words_.has('X') ? length('X') : 0, words_.has('Y') ? length('Y') : 0,
                        words_.has('Z') ? length('Z') : 0};
  tilted.tilt = {euler('I'), euler('J'), euler('K')};
  tilted_ = true;
  const Coordinates q = map_.to_axes(position_);
  frame_.tilt_origin = tilted.tilt_origin;
  frame_.tilt = tilted.tilt;
  frame_ = frame();
  work_.rtcp = true;
  map_ = FrameMap(machine_.kinematics, frame_);
  position_ = map_.from_axes(q);
}

/// G10: L1 L10 L11 tools, L2 L20 work offsets.
void ProgramRun::set_by_g10() {
  words_.use("LPXYZACR");
  const int column = words_.column(GGroup::once);
  const int l = words_.has('L') ? whole_number(words_.value('L')) : -1;
  if (!words_.has('P')) fail("G10 without P", column);
  const int p = whole_number(words_.value('P'));
  need_no_compensation("G10", column);
  need_no_scaling("G10", column);
  if (fanuc_ && l == 20) {
    set_further_offset(p, column);
    return;
  }
  if (l == 2 || l == 20) {
    if (p < 0 || p > static_cast<int>(WorkCoordinates::kSystems))
      fail(fmt::format("P{:g} of G10 L{}: allowed are 0 (the active offset) to 9",
                       words_.value('P'), l),
           words_.column('P'));
    const std::size_t system = p == 0 ? work_.active : static_cast<std::size_t>(p - 1);
    WorkOffset offset = work_.systems[system];
    Coordinates machine = map_.to_axes(position_);
    machine -= work_.tool;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const char letter = kAxisLetters[i];
      const auto row = static_cast<Eigen::Index>(i);
      if (!words_.has(letter)) continue;
      const double word = in_si(i, words_.value(letter));
      if (l == 2)
        offset.shift[row] = fanuc_ && !modal_.absolute ? offset.shift[row] + word : word;
      else if (frame_.rtcp)
        fail("G10 L20 while G43.4 is active; cancel with G49 first", column);
    }
    if (words_.has('R')) {
      if (l == 20) fail("R with G10 L20; allowed is it with L2", words_.column('R'));
      offset.rotation = words_.value('R') * kDegree;
      if (frame_.rtcp && offset.rotation != 0)
        fail("G10 L2 R while G43.4 is active", words_.column('R'));
    }
    if (l == 20) {
      // word + g92, turned, + shift = machine position, for the words that are given
      WorkCoordinates probe = work_;
      probe.systems[system] = offset;
      probe.systems[system].shift = Coordinates::Zero();
      probe.select(system);
      probe.tool.setZero();
      Coordinates words = work_.to_words(position_);
      if (system != work_.active) {
        probe.systems[system] = offset;
        probe.select(system);
        words = probe.to_words(machine);
        probe.systems[system].shift = Coordinates::Zero();
        probe.select(system);
      }
      for (std::size_t i = 0; i < kAxisCount; ++i)
        if (words_.has(kAxisLetters[i]))
          words[static_cast<Eigen::Index>(i)] = in_si(i, words_.value(kAxisLetters[i]));
      const Coordinates without_shift = probe.to_frame(words);
      const bool turned = offset.rotation != 0;
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        const auto row = static_cast<Eigen::Index>(i);
        const bool given = words_.has(kAxisLetters[i]) || (turned && i < 2 && words_.any_of("XY"));
        if (given) offset.shift[row] = machine[row] - without_shift[row];
      }
    }
    work_.systems[system] = offset;
    if (system == work_.active) work_.select(system);
    enter_frame();
    return;
  }
  if (l != 1 && l != 10 && l != 11 && !(fanuc_ && (l < 0 || (l >= 10 && l <= 13))))
    fail("G10 with an unknown L; allowed are L1 L2 L10 L11 L20", column);
  if (p < 1 || p > ToolTable::kLast)
    fail(fmt::format("P{:g} of G10 L{}: allowed is the number of a tool", words_.value('P'), l),
         words_.column('P'));
  if (fanuc_) {
    // L10 (or none): length, L12: radius; L11, L13: wear, which is added.
    ToolEntry& entry = tools_.entry(p);
    if (!words_.has('R')) fail("G10 without R", column);
    const double r = length('R');
    if (l == 12)
      entry.diameter = 2 * r;
    else if (l == 13)
      entry.diameter += 2 * r;
    else
      entry.offset[kZ] = l == 11 ? entry.offset[kZ] + r : r;
  } else {
    ToolEntry& entry = tools_.entry(p);
    Coordinates here = map_.to_axes(position_);
    here -= work_.tool;
    if (l == 10) here = work_.to_words(position_) + work_.tool;
    // L11: as if G59.3 were active.
    if (l == 11) here -= work_.systems[8].shift;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (!words_.has(kAxisLetters[i])) continue;
      const auto row = static_cast<Eigen::Index>(i);
      const double word = in_si(i, words_.value(kAxisLetters[i]));
      entry.offset[row] = l == 1 ? word : here[row] - word;
    }
    if (words_.has('R')) entry.diameter = 2 * length('R');
  }
}

/// G10 L20 P of Fanuc: the offsets of G54.1.
void ProgramRun::set_further_offset(int p, int column) {
  if (p < 1 || p > static_cast<int>(WorkCoordinates::kMore))
    fail(fmt::format("P{:g} of G10 L20: allowed are 1 to {} (G54.1)", words_.value('P'),
                     WorkCoordinates::kMore),
         words_.column('P'));
  if (words_.has('R')) fail("R with G10 L20; allowed is it with L2", column);
  const std::size_t system = WorkCoordinates::kSystems + static_cast<std::size_t>(p - 1);
  Coordinates& shift = work_.systems[system].shift;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!words_.has(kAxisLetters[i])) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double word = in_si(i, words_.value(kAxisLetters[i]));
    shift[row] = modal_.absolute ? word : shift[row] + word;
  }
  if (system == work_.active) work_.select(system);
  enter_frame();
}

void ProgramRun::set_g92() {
  const int code = words_.code(GGroup::once), column = words_.column(GGroup::once);
  need_no_scaling(code_name(code).c_str(), column);
  need_no_compensation(code_name(code).c_str(), column);
  switch (code) {
    case 921:
      work_.g92.setZero();
      work_.g92_kept.setZero();
      return;
    case 922:
      work_.g92.setZero();
      return;
    case 923:
      work_.g92 = work_.g92_kept;
      return;
    default:
      break;
  }
  words_.use(kAxisLetters);
  if (fanuc_ && words_.has('S') && !words_.any_axis()) return;
  if (!words_.any_axis()) fail(code_name(code) + " without axis words", column);
  const Coordinates here = work_.to_words(position_);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!words_.has(kAxisLetters[i])) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double word = in_si(i, words_.value(kAxisLetters[i]));
    work_.g92[row] = code == 520 ? word : work_.g92[row] + here[row] - word;
  }
  work_.g92_kept = work_.g92;
}

/// M70 keeps the modes, M71 forgets them, M72 restores them, M73 restores them on return.
void ProgramRun::set_modal_stack() {
  const int code = words_.code(MGroup::modes);
  if (code < 0) return;
  std::optional<GcodeModal>& kept = calls_.empty() ? saved_ : calls_.back().modal;
  if (code == 70 || code == 73) kept = modal_;
  if (code == 71) kept.reset();
  if (code == 72) {
    if (!kept) fail("M72 without M70 or M73", words_.column(MGroup::modes));
    const GcodeModal now = modal_;
    modal_ = *kept;
    modal_.motion = now.motion;
    modal_.length = now.length;
    modal_.tool_length = now.tool_length;
  }
}

}  // namespace vcnc
