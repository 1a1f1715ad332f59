// Everything a run says in numbers: what summary.json, the report and the terminal show.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/circular.hpp"
#include "analysis/coverage.hpp"
#include "analysis/statistics.hpp"
#include "bus/telemetry.hpp"
#include "model/axes.hpp"

namespace vcnc {

enum class Verdict { pass, fail, incomplete };
std::string_view to_string(Verdict verdict);

/// Statistics of the errors over a part of the scan path [m].
struct ErrorGroup {
  std::string name;
  Statistics e_n, e_plan, e_servo, e_rest;
  bool operator==(const ErrorGroup&) const = default;
};

struct CircularSummary {
  int direction = 1;  ///< +1 counter-clockwise, -1 clockwise about the ring's axis
  CircularResult result;
};

struct CrossingMark {
  double s = 0;      ///< [m]
  std::string name;  ///< "crossing 1, side +"
};

struct Summary {
  // The run
  std::string run_id, program_name, machine_name, piece_name;
  std::uint64_t seed = 0;
  RunEnd end;
  std::int64_t rows = 0;
  std::uint64_t missing_rows = 0;  ///< ticks that never arrived
  std::vector<Alarm> alarms;
  std::vector<std::string> warnings;

  // Axes [m or rad]
  PerAxis<Statistics> following;          ///< q_act - q_cmd, every row while the program runs
  PerAxis<Statistics> following_on_path;  ///< the same on the scan path
  PerAxis<Statistics> share;              ///< of the axis in the error along n, on the path [m]
  Statistics lag, cross;                  ///< tracking error on the path [m]

  // The dynamic error on the scan path; groups[0] is the whole path
  int whole_laps = 0;  ///< that the figures are taken from; 0: from everything on the path
  std::vector<ErrorGroup> groups;
  std::vector<CircularSummary> circles;
  double tolerance = 0, predeflection = 0;  ///< [m]
  std::optional<double> interference;       ///< that the program really has, median [m]
  double line_length = 0, line_z = 0;       ///< 0: no scan line was followed [m]
  bool line_closed = false;
  double last_station = 0;  ///< largest station or travel on the path [m]
  std::vector<CrossingMark> crossings;
  std::vector<Coverage::Bin> bins;
  double bin_length = 0;
  double coverage_percent = 0;
  Verdict verdict = Verdict::incomplete;
  std::string verdict_reason;

  std::uint64_t gaps() const { return missing_rows + end.gaps; }
  double simulated_seconds() const { return seconds(end.cycles > 0 ? end.cycles : rows); }
  /// Simulated over host time; 0 when the host time is not known.
  double real_time_factor() const {
    return end.wall_seconds > 0 ? simulated_seconds() / end.wall_seconds : 0;
  }
  std::int64_t count(Coverage::Bin kind) const;
};

/// The content of summary.json.
std::string to_json(const Summary& summary);

/// A compact block for the terminal.
std::string to_text(const Summary& summary);

}  // namespace vcnc
