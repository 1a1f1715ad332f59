// Going on in the middle of a program: the interpreter runs through to a line without moving, so
// that every mode, offset, parameter and tool is as if the program had been played up to it.
#pragma once

#include <string>

#include "controller/gcode_blocks.hpp"

namespace vcnc {

/// What holds when a line is about to be read.
struct BlockStart {
  int line = 0;
  Coordinates position = Coordinates::Zero();  ///< of the axes
  SpindleWord spindle;                         ///< as it turns or stands there
  int tool = 0, length = 0;                    ///< T in the spindle, H
  std::size_t work_offset = 0;                 ///< 0: G54
  double feed = 0;                             ///< [m/s], 0: none
  std::size_t probings = 0;                    ///< probing moves before it
};

/// The line of a program file that begins with N`number`. Throws ProgramError where there is none,
/// or more than one.
int line_of_block(const std::string& path, long number);

/// For people: "X 10.0000 Y .. mm, C 0.0000 deg, G54, T1 H1, F600, S0".
std::string text_of(const BlockStart& start);

}  // namespace vcnc
