// Writes test programs as G-code text.
//
//   s_piece   one closed lap of a scanning probe around a ruled rim, five axes, RTCP
//   cone      the same around a cone: the tool axis along the surface ruling
//   circle    G2/G3 laps inside a ring gauge, or free in any plane; linear axes only
//   step      one axis in equal steps forward and back, with a dwell: lost motion, stand-still
//
// Scan laps follow Piece::scan_path. The lap begins an eighth of its length behind the first
// station, on a face and away from its ends, and is preceded and followed by a run-in and run-out
// of `run_in_mm` over the same stations, so the lap itself is run at full feed. Between several
// laps the ball leaves the surface and Z is lifted: each begins at rest where the first one did, so
// that all take the same time to the cycle and can be compared as repetitions. Stations are
// thinned: of the straight line between two points no station is off by more than the chord
// tolerance. Coordinates have 5 decimals [mm] and 6 decimals [deg]: rounding stays below 0.01 um.
#pragma once

#include <optional>
#include <string>

#include "model/geometry/piece.hpp"
#include "model/machine.hpp"

namespace vcnc {

struct ProgramOptions {
  enum class Direction { clockwise, counter_clockwise };  ///< seen from above (+z)

  double feed_mm_min = 2000;  ///< of the lap; deg/min where `step` moves a rotary axis
  double approach_feed_mm_min = 300;
  double tolerance_um = 0.5;        ///< G64 P
  double chord_tolerance_um = 0.1;  ///< of the point list
  std::optional<double> height_mm;  ///< of the ball centre in the workpiece; default: mid-height
  std::optional<double> predeflection_mm;  ///< default: setup.predeflection of the machine
  double run_in_mm = 10;                   ///< before and after the lap
  double approach_mm = 5;                  ///< distance from the surface where the approach begins
  double clearance_mm = 60;                ///< above the scan height: travel over the piece
  double settle_s = 0.5;                   ///< dwell between approach and lap
  int laps = 1;
  Direction direction = Direction::counter_clockwise;

  // circle without a piece
  std::optional<double> radius_mm;  ///< of the controlled point's circle; default: from the ring
  int plane = 17;                   ///< 17, 18 or 19

  // step
  std::size_t axis = kX;
  double step_size = 10;  ///< [mm] or [deg]; negative: first towards minus
  int steps = 10;
  double dwell_s = 1;
};

/// Programs for the machine's G54 offset and H1. Throws
/// std::invalid_argument naming the option that is wrong.
std::string s_piece_program(const Machine& machine, const Piece& piece,
                            const ProgramOptions& options);
std::string cone_program(const Machine& machine, const Piece& piece, const ProgramOptions& options);
/// `piece` may be null: then a free circle about the machine's start position; radius_mm is needed.
std::string circle_program(const Machine& machine, const Piece* piece,
                           const ProgramOptions& options);
/// With the probe in the spindle at most at the feed it allows.
std::string step_program(const Machine& machine, const ProgramOptions& options);

}  // namespace vcnc
