#include "controller/gcode/block_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/gcode/cursor.hpp"
#include "controller/gcode/interpreter_run.hpp"
#include "controller/gcode/program_text.hpp"

namespace vcnc {

int line_of_block(const std::string& path, long number) {
  ProgramText text(path);
  int found = 0;
  for (std::string_view line; text.next(line);) {
    Cursor at(line);
    at.skip_blanks();
    if (at.peek() == '/') at.advance();
    at.skip_blanks();
    if (upper(at.peek()) != 'N' || !is_digit(at.peek(1))) continue;
    at.advance();
    if (std::lround(at.number()) != number) continue;
    if (found > 0)
      throw ProgramError(fmt::format("{}: N{} stands in lines {} and {}; give the line", path,
                                     number, found, text.last().line));
    found = text.last().line;
  }
  if (found == 0) throw ProgramError(fmt::format("{}: there is no block N{}", path, number));
  return found;
}

std::string text_of(const BlockStart& start) {
  std::string text;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    text +=
        fmt::format("{} {:.4f} {}", kAxisNames[i],
                    start.position[static_cast<Eigen::Index>(i)] / (is_rotary(i) ? kDegree : 1e-3),
                    i + 1 < kAxisCount && is_rotary(i) == is_rotary(i + 1) ? ""
                    : is_rotary(i)                                         ? "deg, "
                                                                           : "mm, ");
  text += start.work_offset < 6   ? fmt::format("G{}", 54 + start.work_offset)
          : start.work_offset < 9 ? fmt::format("G59.{}", start.work_offset - 5)
                                  : fmt::format("G54.1 P{}", start.work_offset - 8);
  text += fmt::format(", T{} H{}", start.tool, start.length);
  if (start.feed > 0) text += fmt::format(", F{:g}", start.feed * 60e3);
  if (start.spindle.speed > 0)
    text += fmt::format(", S{:g}", start.spindle.speed / unit::rpm.to_si);
  return text;
}

// -------------------------------------------------------------------------- inside of a program

bool ProgramRun::about_to_read(int line) const {
  return unit_ == 0 && unit().text.here().line == line;
}

/// Once through the whole program, without motion.
long ProgramRun::passes_of(int line) {
  long passes = 0;
  while (!ended_) {
    passes += about_to_read(line);
    read_guarded();
    ready_.clear();
  }
  return passes;
}

BlockStart ProgramRun::run_to(int line) {
  while (!ended_ && !about_to_read(line)) {
    read_guarded();
    ready_.clear();
  }
  const auto refuse = [&](const std::string& why) {
    throw ProgramError(fmt::format("{}:{}: the program cannot begin here: {}",
                                   units_.front()->text.path(), line, why));
  };
  if (ended_) refuse("this line is never read");
  if (compensation_.active()) refuse("cutter compensation is on; begin where it is switched on");
  if (modal_.motion >= 730 && modal_.motion != 800)
    refuse(fmt::format("the cycle {} is active; begin where it is called, or behind G80",
                       code_name(modal_.motion)));
  if (guessed_ != 0)
    refuse(
        fmt::format("line {} probes, and what it has found is not known; begin at or before it, "
                    "or with the --memory of the run that probed",
                    guessed_));
  if (modal_macro_ != 0) refuse("the macro of G66 is active; begin where it is called");
  BlockStart start;
  start.line = line;
  start.probings = probings_;
  start.position = map_.to_axes(position_);
  start.spindle.line = line;
  start.spindle.mode = modal_.spindle == 3    ? SpindleWord::Mode::clockwise
                       : modal_.spindle == 4  ? SpindleWord::Mode::counter_clockwise
                       : modal_.spindle == 19 ? SpindleWord::Mode::orient
                                              : SpindleWord::Mode::off;
  if (modal_.spindle == 3 || modal_.spindle == 4) {
    start.spindle.speed = spindle_speed_at(position_[kX]);
    start.spindle.surface = modal_.surface;
  }
  start.tool = tool_in_spindle_;
  start.length = h_;
  start.work_offset = work_.active;
  start.feed = modal_.feed == 940 ? modal_.linear_feed : 0;
  return start;
}

}  // namespace vcnc
