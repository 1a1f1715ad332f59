// A run being analysed while it happens: records, evaluates live, writes the results at the end.
//
// Into its folder: recording.h5, summary.json, summary.txt, report.html and, on request, rows.csv.
// Results only appear complete.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "analysis/evaluation.hpp"
#include "analysis/recording.hpp"
#include "bus/telemetry.hpp"

namespace vcnc {

struct SessionOptions {
  std::filesystem::path folder;  ///< created if need be
  bool report = true;
  bool csv = false;
};

/// How things stand, for a progress line.
struct LiveView {
  double t = 0;  ///< [s]
  int line = 0;  ///< program line
  bool on_path = false;
  double e_n = 0;                   ///< now, on the path [m]
  double e_n_max = 0, e_n_min = 0;  ///< so far [m]
  double coverage_percent = 0;
  bool failed = false;  ///< the tolerance is exceeded: the run may end early
  std::size_t alarms = 0;
};

class AnalysisSession : public TelemetrySink {
 public:
  explicit AnalysisSession(SessionOptions options);
  ~AnalysisSession() override;  ///< a run without end() leaves its recording partial

  void begin(const RunBegin& begin) override;
  void row(const TelemetryRow& row) override;
  void alarm(const Alarm& alarm) override;
  void end(const RunEnd& end) override;

  LiveView snapshot() const;  ///< from any thread
  /// After end(); empty before.
  const std::optional<Summary>& summary() const { return summary_; }

 private:
  SessionOptions options_;
  std::unique_ptr<RecordingWriter> recording_;
  std::unique_ptr<Evaluation> evaluation_;
  std::optional<Summary> summary_;
  mutable std::mutex mutex_;
  LiveView view_;
};

/// Evaluates a recording again; the same Summary as the live session's, bit for bit.
Summary analyze(const RecordingReader& recording);

/// Writes summary.json, summary.txt, report.html and, on request, rows.csv for a recording.
void write_results(const RecordingReader& recording, const Summary& summary,
                   const SessionOptions& options);

}  // namespace vcnc
