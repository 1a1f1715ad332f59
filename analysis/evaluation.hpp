// The live evaluation of a run: rows in, running figures at any time, a Summary at the end.
//
// Used by the live session, by the evaluation of a recording and by the report, so that all of them
// give the same numbers bit for bit.
//
// Verdict. FAIL: |e_n| exceeds the tolerance on consecutive samples, at least kFailSamples of them
// over at least kFailArc of the path (known at once: the measurement may end early). PASS: the
// whole path is covered and |e_n| never exceeds the tolerance. Else INCOMPLETE.
//
// Laps. On a closed scan line the figures are those of whole laps: the first kRunIn of travel and
// what follows the last whole lap (run-out, leaving the piece) do not count, so that starting and
// stopping are not taken for errors of the path. Where no lap is completed everything on the path
// counts.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "analysis/coverage.hpp"
#include "analysis/dynamic_error.hpp"
#include "analysis/lap_tracker.hpp"
#include "analysis/path_statistics.hpp"
#include "analysis/summary.hpp"

namespace vcnc {

inline constexpr int kFailSamples = 3;
inline constexpr double kFailArc = 0.3e-3;  ///< [m]
inline constexpr double kRunIn = 5e-3;      ///< [m]

/// One row with its place on the scan path.
struct EvaluatedRow {
  ErrorSample error;
  LapTracker::Place place;
  int lap = 0;  ///< on a closed line: 0 during the run-in, then 1, 2, ...
  /// On the path, and the probe's value can be believed: counts in the statistics.
  bool counts() const { return place.on_path && error.contact == Contact::ok; }
};

class Evaluation {
 public:
  /// Parses machine and piece of the run. Throws ConfigError or std::invalid_argument.
  explicit Evaluation(const RunBegin& begin);

  EvaluatedRow row(const TelemetryRow& row);
  void alarm(const Alarm& alarm);
  Summary finish(const RunEnd& end) const;

  /// The tolerance is exceeded, as far as one can say by now.
  bool failed() const { return lap_.failure || figures().failure; }
  /// e_n of everything on the path so far, run-in and run-out included.
  const Statistics& e_n() const { return live_e_n_; }
  const Coverage& coverage() const { return coverage_; }
  const ScanLine* line() const { return tracker_ ? tracker_->line() : nullptr; }
  const Machine& machine() const { return machine_; }
  const Piece* piece() const { return piece_.get(); }

 private:
  void on_path(const EvaluatedRow& row);
  void start_line();
  void count_laps(double step);
  /// What counts: whole laps, else everything.
  const PathStatistics& figures() const { return whole_laps_ > 0 ? laps_ : rest_; }
  void watch_tolerance(const EvaluatedRow& row, double step);
  void collect_circle(const EvaluatedRow& row);
  double median_interference() const;
  void judge(Summary& summary, const std::optional<ToleranceFailure>& failure) const;
  void warn(Summary& summary) const;

  RunBegin begin_;
  Machine machine_;
  std::unique_ptr<Piece> piece_;
  DynamicError dynamic_error_;
  std::optional<LapTracker> tracker_;
  Coverage coverage_;

  std::int64_t rows_ = 0;
  Tick last_tick_ = 0;
  std::uint64_t missing_ = 0, disordered_ = 0, damaged_ = 0;
  std::int64_t on_path_rows_ = 0, off_line_rows_ = 0;
  double last_station_ = 0;
  Contact last_contact_ = Contact::ok;
  bool last_on_path_ = false;

  PathStatistics laps_;  ///< of whole laps
  PathStatistics lap_;   ///< of the lap being run
  PathStatistics rest_;  ///< of what belongs to no whole lap
  int whole_laps_ = 0;
  int lap_number_ = 0;
  double lap_travel_ = 0;  ///< since the run-in or the lap began [m]
  Statistics live_e_n_;
  std::vector<std::string> crossing_names_;
  PerAxis<Statistics> following_;  ///< every row while the program runs

  static constexpr std::size_t kInterferenceBins = 4096;  ///< of 1 um, for the median
  std::vector<std::uint32_t> interference_;

  int over_samples_ = 0;
  double over_arc_ = 0;
  ToleranceFailure over_worst_;  ///< of these samples

  Vec3 circle_x_ = Vec3::UnitX(), circle_y_ = Vec3::UnitY();
  double last_phi_ = 0;

  std::vector<Alarm> alarms_;
};

}  // namespace vcnc
