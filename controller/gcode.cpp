#include "controller/gcode.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace vcnc {
namespace {

using Group = GcodeLine::Group;
using MGroup = GcodeLine::MGroup;

constexpr double kLargestTolerance = 5e-3;

}  // namespace

GcodeInterpreter::GcodeInterpreter(const std::string& path, const Machine& machine)
    : machine_(machine),
      lines_(path),
      map_(machine.kinematics, {}),
      position_(start_coordinates(machine)) {
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
      if (lines_.number() == 0) throw ProgramError(lines_.path() + ": the program is empty");
      fail("the program does not end with M2 or M30");
    }
    read_line(text);
  }
  Block block = std::move(ready_.front());
  ready_.pop_front();
  return block;
}

void GcodeInterpreter::read_line(const std::string& text) {
  const GcodeLine line = sort_words(split_words(text, lines_.where()), lines_.where());
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

void GcodeInterpreter::set_modes(const GcodeLine& line) {
  for (const auto& [group, code] : line.g) {
    switch (group) {
      case Group::motion:
        modal_.motion = code / 10;
        break;
      case Group::plane:
        modal_.normal = code == 170 ? kZ : code == 180 ? kY : kX;
        break;
      case Group::units:
        modal_.length_unit = code == 200 ? 25.4e-3 : 1e-3;
        break;
      case Group::distance:
        modal_.absolute = code == 900;
        break;
      case Group::feed:
        if (modal_.inverse_time != (code == 930)) modal_.linear_feed = modal_.rotary_feed = 0;
        modal_.inverse_time = code == 930;
        break;
      case Group::offset:
        modal_.offset = static_cast<std::size_t>(code / 10 - 54);
        break;
      default:
        break;
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

void GcodeInterpreter::set_tool_length(const GcodeLine& line, int code) {
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
  const int h = whole_number(line.value('H'));
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

void GcodeInterpreter::set_feed(const GcodeLine& line) {
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

void GcodeInterpreter::set_spindle(const GcodeLine& line) {
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
    word.mode =
        found->second == 3 ? SpindleWord::Mode::clockwise : SpindleWord::Mode::counter_clockwise;
    word.speed = modal_.spindle_speed;
  }
  ready_.emplace_back(word);
}

}  // namespace vcnc
