// Recordings of runs: one HDF5 file, readable by h5py, pandas and MATLAB as it is.
//
//   /rows      double[n, kRowWidth], one row per cycle; attributes `channels` ("q_cmd.X [m]"),
//              `names`, `units` (arrays of strings)
//   /alarms    table {tick, code, source, text}
//   / attributes of the run: format, format_version, cycle_s, run_id, program_name, machine_toml,
//              piece_toml, seed; and, once the run has ended: complete, reason, cycles,
//              trace_hash, wall_seconds, bus_load_worst, gaps
//
// While it grows, the file is called NAME.partial; it gets its name when it is complete. Rows are
// collected and written 1000 at a time, each block followed by a flush, so that the file can be
// read after the writing process was killed, up to the last block. Memory use does not grow with
// the run.
//
// A file that was closed properly carries a seal behind its last HDF5 byte (analysis/seal.hpp),
// which HDF5 and its tools do not look at: a sealed file whose bytes have changed is refused,
// because neither its numbers nor the HDF5 library's behaviour on it can be relied on. A file
// without a seal (interrupted, cut off, or rewritten by another tool) is first read once in a child
// process: HDF5 may crash on damaged files, and then only the child does.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "bus/telemetry.hpp"

namespace vcnc {

/// One sentence naming the file and what is wrong with it.
class RecordingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class RecordingWriter {
 public:
  /// Creates `path`.partial; an older one is replaced. Throws RecordingError.
  RecordingWriter(const std::filesystem::path& path, const RunBegin& begin);
  ~RecordingWriter();  ///< without finish() the file stays partial, with all rows it was given

  void row(const TelemetryRow& row);
  void alarm(const Alarm& alarm);
  /// Writes what is left, closes the file and gives it its name.
  void finish(const RunEnd& end);

 private:
  void create(const std::filesystem::path& path, const RunBegin& begin);
  struct File;
  void write_block();

  std::unique_ptr<File> file_;
  std::vector<TelemetryRow> block_;
};

class RecordingReader {
 public:
  /// Opens a complete or an interrupted recording: a file, or a run's folder that holds
  /// recording.h5 (or its partial file). Throws RecordingError.
  explicit RecordingReader(const std::filesystem::path& path);
  ~RecordingReader();

  const RunBegin& begin() const { return begin_; }
  const RunEnd& end() const { return end_; }  ///< the defaults ("interrupted") if it never ended
  const std::vector<Alarm>& alarms() const { return alarms_; }
  std::uint64_t rows() const { return rows_; }
  const std::vector<std::string>& missing() const { return missing_; }  ///< parts not there
  const std::filesystem::path& path() const { return path_; }

  /// Calls f for every row in order; reads block by block.
  void for_each(const std::function<void(const TelemetryRow&)>& f) const;

 private:
  struct File;
  void open();
  void try_in_child();
  void drop_unwritten();
  std::optional<std::vector<TelemetryRow>> read_block(std::uint64_t at, std::uint64_t rows) const;

  std::filesystem::path path_;
  std::unique_ptr<File> file_;
  RunBegin begin_;
  RunEnd end_;
  std::vector<Alarm> alarms_;
  std::uint64_t rows_ = 0;
  std::vector<std::string> missing_;
};

/// The file name of the recording in a run's folder.
inline constexpr const char* kRecordingName = "recording.h5";

/// All rows as text with one heading line, `path` complete or not there.
void write_csv(const RecordingReader& recording, const std::filesystem::path& path);

}  // namespace vcnc
