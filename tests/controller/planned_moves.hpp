// A machine and moves to plan for.
#pragma once

#include <cmath>

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

/// Time-optimal, from rest to rest along one linear axis of it: v 0.5, a 5, j 50 (a/j = 0.1 s).
inline double shortest_time(double length) {
  if (length <= 2 * 50 * std::pow(0.1, 3)) return 4 * std::cbrt(length / (2 * 50));
  if (length <= 0.5 * (0.5 / 5 + 0.1)) return 0.1 + std::sqrt(0.01 + 4 * length / 5);
  return length / 0.5 + 0.5 / 5 + 0.1;
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
