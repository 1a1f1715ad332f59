// A measured run, from wherever it came: signals on one uniform time base.
//
// A record holds what a machine told, in SI units, and nothing that was guessed: a sample that is
// missing is NaN and stays so. Where it came from vcnc's own recording, record_from_recording.hpp
// fills it; a table of a real machine comes through import_table.hpp and its map.
//
// Axes are numbered 0..4 for X Y Z A C. A single axis of any other machine (a ball screw, a robot's
// joint) takes the place of one of them, by its map.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "model/axes.hpp"
#include "model/machine.hpp"
#include "model/math.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

/// What a signal says.
enum class SignalKind {
  command,        ///< position the axis was told to have [m or rad]
  position,       ///< position by the measuring system the loop is closed with [m or rad]
  twist,          ///< load side minus motor side [m or rad]
  velocity,       ///< of the motor side [m/s or rad/s]
  force,          ///< force of the drive on the load side [N or N m]
  applied_force,  ///< known force on the load beside that of its drive [N or N m]
  added_force,    ///< known part of the drive's force that its loops did not ask for [N or N m]
  deflection,     ///< of the probe, one component in the probe's frame [m]
  bar,            ///< length of a ball bar less its nominal one [m]
  tool_position,  ///< of the tool centre, one component in the frame of the table [m]
  cosine,         ///< raw signal of one probe channel or encoder [V, or share of the converter]
  sine,           ///< as cosine
  temperature,    ///< [K]
  clock           ///< time stamps of the device that measured, where it has a clock of its own [s]
};

/// Whether it says where the tool is against the piece.
constexpr bool is_reading(SignalKind q) {
  return q == SignalKind::deflection || q == SignalKind::bar || q == SignalKind::tool_position;
}

constexpr bool is_compared(SignalKind q) {
  return q == SignalKind::position || q == SignalKind::twist || q == SignalKind::velocity ||
         q == SignalKind::force || is_reading(q);
}

/// What is on the table in place of a piece that a probe touches: one ball of a bar whose other one
/// is in the spindle, or a sensor that sees where the tool centre is (grid encoder, R-test).
struct OnTable {
  Vec3 zero =
      Vec3::Zero();       ///< X, Y, Z with the tool centre at the ball, or at the sensor's zero [m]
  double bar_length = 0;  ///< nominal distance of the balls [m]; 0: a sensor

  bool is_bar() const { return bar_length > 0; }
  bool operator==(const OnTable&) const = default;
};

/// One signal of a record.
struct MeasuredSignal {
  SignalKind kind = SignalKind::position;
  std::size_t axis = 0;       ///< of the machine; of probe and tool: 0, 1, 2 for x, y, z
  std::string source;         ///< its name where it came from, for messages
  std::vector<double> value;  ///< SI; NaN: missing
  double resolution = 0;      ///< step in which its values come, 0: none was found
  bool relative = false;      ///< counted from somewhere: its mean tells nothing
};

/// A part of a record whose samples belong together.
struct Stretch {
  std::size_t begin = 0, end = 0;  ///< samples [begin, end)
  int condition = 0;               ///< equal for repetitions of the same motion
  int repetition = 0;              ///< 0, 1, ... among those of one condition
  std::string label;               ///< "circle F2000 ccw"
};

struct Record {
  std::string source;    ///< the file
  double period = 1e-3;  ///< between samples [s]
  double begin = 0;      ///< time of the first sample [s]
  std::vector<MeasuredSignal> signals;
  std::vector<Stretch> stretches;     ///< in order of time, not overlapping
  std::vector<std::string> warnings;  ///< one sentence each

  std::string machine_toml;         ///< declared machine told by the run itself; empty: none
  std::string piece_toml;           ///< piece in the machine; empty: none
  std::optional<OnTable> on_table;  ///< what was read; none: a probe on the piece
  std::array<std::string, kAxisCount> axis_names;  ///< what the user calls them; empty: as we do

  std::size_t samples() const { return signals.empty() ? 0 : signals.front().value.size(); }
  /// By the clock of the table [s], to tell it. The time of a model begins with the record.
  double time_of(std::size_t sample) const { return begin + static_cast<double>(sample) * period; }
  /// Null where there is none.
  const MeasuredSignal* find(SignalKind kind, std::size_t axis) const {
    for (const MeasuredSignal& s : signals)
      if (s.kind == kind && s.axis == axis) return &s;
    return nullptr;
  }
};

/// Whether an axis is told to move, or moves where nothing is told.
bool moves(const Record& record, std::size_t axis);

inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

}  // namespace vcnc
