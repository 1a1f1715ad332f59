// The path of a program as JSON, written while it is read.
//
//   {"program": .., "unit": "mm, deg, mm/min, s", "segments": [
//     {"type": "rapid" | "line" | "arc" | "probe", "line": .., "end": {"X": .., .., "C": ..},
//      "tip": {"X": .., "Y": .., "Z": ..},                  with RTCP: in the workpiece frame
//      "centre": {"X": .., "Y": .., "Z": ..}, "plane": 17, "turns": ..,            arcs
//      "feed": .., "feed_mode": "per_minute" | "rotary_per_minute" | "inverse_time" | "per_turn"},
//     {"type": "dwell", "line": .., "seconds": ..},
//     {"type": "spindle", "line": .., "mode": "off" | "cw" | "ccw" | "orient", "rpm": ..,
//      "surface_m_min": .., "max_rpm": ..},                G96: rpm is that of this place
//     {"type": "stop", "line": .., "optional": ..}],
//    "refused": "FILE:LINE:COLUMN: reason" or null}
//
// `end` are the positions of the axes in the machine frame, before any blending. Turns are positive
// counter-clockwise seen from the positive normal of the plane. Under RTCP centre is in the
// workpiece frame like tip (under a tilted plane both are in that plane); otherwise in the machine
// frame. inverse_time: 1/min for the whole segment; per_turn: mm per turn of the spindle.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

#include "controller/gcode_blocks.hpp"

namespace vcnc {

class PathWriter {
 public:
  PathWriter(std::FILE* file, std::string_view program, const Machine& machine);
  void add(const Block& block);
  void end(std::string_view refused);

 private:
  void add(const Move& move);
  void text(std::string_view s) { buffer_.append(s); }
  void number(double value);
  void point(std::string_view key, const double* values, std::size_t count);
  void begin(std::string_view type, int line);
  void flush();

  std::FILE* file_;
  const KinematicsParams kinematics_;
  MotionFrame frame_;
  FrameMap map_;
  std::string buffer_;
  bool first_ = true;
};

}  // namespace vcnc
