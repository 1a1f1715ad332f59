// A machine and moves to plan for.
#pragma once

#include "controller/gcode_blocks.hpp"
#include "model/machine.hpp"

namespace vcnc {

inline Machine test_machine() {
  Machine machine;
  machine.probe.in_spindle = false;  // it would limit rapids and turning axes
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    AxisLimits& limits = machine.axes[i].limits;
    limits = is_rotary(i) ? AxisLimits{-10, 10, 0, 3.5, 35, 350} : AxisLimits{-1, 1, 0, 0.5, 5, 50};
  }
  return machine;
}

inline Coordinates at(double x, double y, double z = 0, double a = 0, double c = 0) {
  Coordinates result;
  result << x, y, z, a, c;
  return result;
}

inline Move line(const Coordinates& start, const Coordinates& end, double feed) {
  Move move;
  move.start = start;
  move.end = end;
  move.feed_mode = Move::Feed::tip;
  move.feed = feed;
  move.tolerance = 10e-6;
  return move;
}

}  // namespace vcnc
