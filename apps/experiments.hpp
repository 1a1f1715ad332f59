// Experiments: short motions that make an effect visible, as programs for the whole machine.
//
// An experiment is a machine, a piece and a G-code program made for each other: the machine starts
// in front of the piece, so that a run takes seconds and simulates in tenths of them. It is run in
// this process; every row and error sample is kept. Passes name the program lines worth looking at;
// from them come curves of a signal over the abscissa that belongs to the motion.
//
//   circle        in a ring of 25 mm path radius, once counter-clockwise, once clockwise; over the
//                 angle. Plane XY; for Z the plane ZX with Z as the first axis
//   circle_feeds  the same counter-clockwise at three feeds
//   line          there and back along a flat wall; over the position of the axis. The wall stands
//                 at 45 deg to the axis, which then moves together with a second one, so that the
//                 probe sees the error along the axis, or it is a guide wall along the axis, that
//                 shows the error across it; or the axis moves alone in the air
//   reversals     there and back against a wall square to the axis; over time. Free: longer
//                 strokes in the air that reach the largest acceleration
//   standstill    the ball rests on a wall square to the axis; over time
//   spin          the rotary axis turns there and back under RTCP, the ball is held on a flat wall
//                 of the piece; over its angle
//   s_piece       one lap of S-EQ1; over the station
//   corner        a square of 20 mm in the air, G64 P0.02; over the way from its first corner
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/dynamic_error.hpp"
#include "analysis/features.hpp"
#include "apps/nc_run.hpp"
#include "bus/telemetry.hpp"
#include "model/effects/effect.hpp"
#include "model/machine.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

/// What is drawn over the abscissa.
enum class Quantity {
  machine_error,  ///< e_n - e_plan: what the machine does besides what was planned [m]
  total_error,    ///< e_n [m]
  following,      ///< q_act - q_cmd of the axis [m or rad]
  force,          ///< of the axis [N or N m]
  free_reading,   ///< length of the deflection of the free probe at rest [m]
  contour         ///< distance of the actual position from the programmed square, + outside [m]
};

enum class Abscissa { angle, position, time, station };

struct ExperimentOptions {
  enum class Wall { inclined, guide, none };
  Wall wall = Wall::inclined;  ///< line; reversals: none means free, longer strokes in the air
  double feed_mm_min = 0;      ///< 0: the usual one; deg/min for spin
  double travel_mm = 0;        ///< line: of the axis; reversals: stroke; 0: the usual one
  double seconds = 0;          ///< standstill; rests of line, reversals; 0: the usual time
  Vec3 normal = Vec3::Zero();  ///< spin: of the wall, workpiece frame; zero: the usual one
};

/// Lines of the program that are evaluated together.
struct Pass {
  std::string label;
  int first_line = 0, last_line = 0;
  double feed = 0;    ///< [m/s or rad/s]
  int direction = 1;  ///< +1: counter-clockwise, forward
};

struct Experiment {
  Showing showing = Showing::circle;
  std::size_t axis = kX;  ///< whose position, following error and force are looked at
  Machine machine;
  std::optional<PieceParams> piece;
  std::string program;  ///< G-code
  std::vector<Pass> passes;
  Abscissa abscissa = Abscissa::angle;
  /// Factor from the error along the wall's normal to the error that is meant.
  double lever = 1;
  double station_tolerance = 1e-3;  ///< s_piece: stations further off are not on the path [m]
  Eigen::Index u = 0, v = 1;        ///< circle: the plane's axes
};

/// The machine of configs/machines/trunnion.toml without a piece.
Machine ideal_machine();

/// `machine` as declared: without any effect. Throws std::invalid_argument where the motion is not
/// for this axis: line and reversals need a linear one, spin a rotary one.
Experiment experiment(Showing showing, std::size_t axis, const Machine& machine,
                      const ExperimentOptions& options = {});

struct Observation {
  NcRunResult nc;
  std::vector<Alarm> alarms;
  std::vector<TelemetryRow> rows;
  std::vector<ErrorSample> errors;  ///< one per row

  bool clean() const { return nc.end.complete && alarms.empty(); }
};

/// Runs the experiment. May be called from several threads at once.
Observation observe(const Experiment& experiment, std::uint64_t seed = 1);

/// One curve per pass, SI.
std::vector<Curve> curves(const Experiment& experiment, const Observation& observation,
                          Quantity quantity);

/// What is usually looked at in this experiment.
Quantity usual_quantity(Showing showing);

}  // namespace vcnc
