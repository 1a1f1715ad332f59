#include "analysis/session.hpp"

#include <algorithm>
#include <stdexcept>

#include "analysis/report.hpp"
#include "analysis/whole_file.hpp"

namespace vcnc {

AnalysisSession::AnalysisSession(SessionOptions options) : options_(std::move(options)) {
  std::error_code error;
  std::filesystem::create_directories(options_.folder, error);
  if (error)
    throw std::runtime_error(options_.folder.string() +
                             ": the folder cannot be created: " + error.message());
}

AnalysisSession::~AnalysisSession() = default;

void AnalysisSession::begin(const RunBegin& begin) {
  // A folder never mixes two runs.
  for (const char* name :
       {kRecordingName, "summary.json", "summary.txt", "report.html", "rows.csv"})
    std::filesystem::remove(options_.folder / name);
  summary_.reset();
  evaluation_ = std::make_unique<Evaluation>(begin);
  recording_ = std::make_unique<RecordingWriter>(options_.folder / kRecordingName, begin);
  const std::lock_guard lock(mutex_);
  view_ = {};
}

void AnalysisSession::row(const TelemetryRow& row) {
  if (!recording_) throw std::logic_error("a row before the run began or after it ended");
  recording_->row(row);
  const EvaluatedRow now = evaluation_->row(row);
  constexpr Tick kCoverageEvery = 100;  // it walks over all bins
  const bool refresh = now.error.tick % kCoverageEvery == 0;
  const double percent = refresh ? evaluation_->coverage().percent() : 0;
  const std::lock_guard lock(mutex_);
  if (refresh) view_.coverage_percent = percent;
  view_.t = seconds(now.error.tick);
  view_.line = static_cast<int>(row.line);
  view_.on_path = now.place.on_path;
  view_.e_n = now.counts() ? now.error.e_n : 0;
  view_.e_n_max = evaluation_->e_n().max;
  view_.e_n_min = evaluation_->e_n().min;
  view_.failed = evaluation_->failed();
}

void AnalysisSession::alarm(const Alarm& alarm) {
  if (!recording_) throw std::logic_error("an alarm before the run began or after it ended");
  recording_->alarm(alarm);
  evaluation_->alarm(alarm);
  const std::lock_guard lock(mutex_);
  ++view_.alarms;
}

void AnalysisSession::end(const RunEnd& end) {
  if (!recording_) throw std::logic_error("an end of a run that never began");
  recording_->finish(end);
  recording_.reset();
  summary_ = evaluation_->finish(end);
  write_results(RecordingReader(options_.folder), *summary_, options_);
}

LiveView AnalysisSession::snapshot() const {
  const std::lock_guard lock(mutex_);
  return view_;
}

Summary analyze(const RecordingReader& recording) {
  Evaluation evaluation(recording.begin());
  recording.for_each([&](const TelemetryRow& row) { evaluation.row(row); });
  for (const Alarm& alarm : recording.alarms()) evaluation.alarm(alarm);
  Summary summary = evaluation.finish(recording.end());
  for (const std::string& part : recording.missing())
    summary.warnings.push_back("missing in the recording: " + part);
  return summary;
}

void write_results(const RecordingReader& recording, const Summary& summary,
                   const SessionOptions& options) {
  std::filesystem::create_directories(options.folder);
  write_whole_file(options.folder / "summary.json", to_json(summary));
  write_whole_file(options.folder / "summary.txt", to_text(summary));
  if (options.report) write_report(recording, summary, options.folder / "report.html");
  if (options.csv) write_csv(recording, options.folder / "rows.csv");
}

}  // namespace vcnc
