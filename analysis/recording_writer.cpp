#include <fcntl.h>
#include <unistd.h>

#include "analysis/hdf5_file.hpp"
#include "analysis/recording.hpp"
#include "analysis/seal.hpp"

namespace vcnc {

using namespace hdf5;  // NOLINT: this file is written in its terms

struct RecordingWriter::File {
  std::filesystem::path path;
  Handle file, rows, alarms;
  hsize_t row_count = 0, alarm_count = 0;
  bool failed = false;
  int descriptor = -1;

  ~File() {
    if (descriptor >= 0) close(descriptor);
  }
  void reserve(hsize_t bytes);
};

// HDF5 cannot take a half-done write back: on a full disk the file would be lost. So the space for
// the next step is taken from the disk before HDF5 is asked to use it.
void RecordingWriter::File::reserve(hsize_t bytes) {
  hsize_t size = 0;
  if (H5Fget_filesize(file, &size) < 0) return;
  const int error =
      posix_fallocate(descriptor, static_cast<off_t>(size), static_cast<off_t>(bytes));
  if (error != ENOSPC && error != EFBIG && error != EDQUOT && error != EIO) return;
  failed = true;
  errno = error;
  fail(path, "the recording cannot be written");
}

RecordingWriter::RecordingWriter(const std::filesystem::path& path, const RunBegin& begin)
    : file_(std::make_unique<File>()) {
  try {
    create(path, begin);
  } catch (const RecordingError&) {
    std::error_code ignored;
    std::filesystem::remove(partial(path), ignored);  // it would not open
    throw;
  }
}

void RecordingWriter::create(const std::filesystem::path& path, const RunBegin& begin) {
  static_assert(sizeof(TelemetryRow) == kRowWidth * sizeof(double));
  const Quiet quiet;
  File& f = *file_;
  f.path = path;
  block_.reserve(kBlockRows);
  f.file = Handle(H5Fcreate(partial(path).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  if (!f.file.ok()) fail(path, "the recording cannot be created");
  f.descriptor = open(partial(path).c_str(), O_WRONLY | O_CLOEXEC);
  f.reserve(kSlack + begin.declared_toml.size() + begin.piece_toml.size());
  f.rows = create_growing(f.file, "rows", H5T_NATIVE_DOUBLE, 2, kRowWidth, kBlockRows);
  f.alarms = create_growing(f.file, "alarms", alarm_type(), 1, 0, 64);

  std::vector<std::string> channels, names, units;
  for (const Channel& c : kChannels) {
    names.emplace_back(c.name);
    units.emplace_back(c.unit);
    channels.push_back(fmt::format("{} [{}]", c.name, c.unit));
  }
  const bool written = f.rows.ok() && f.alarms.ok() && write(f.rows, "channels", channels) &&
                       write(f.rows, "names", names) && write(f.rows, "units", units) &&
                       write(f.file, "format", std::string(kFormat)) &&
                       write(f.file, "format_version", kFormatVersion) &&
                       write(f.file, "cycle_s", kCycle) && write(f.file, "run_id", begin.run_id) &&
                       write(f.file, "program_name", begin.program_name) &&
                       write(f.file, "machine_toml", begin.declared_toml) &&
                       write(f.file, "piece_toml", begin.piece_toml) &&
                       write(f.file, "seed", begin.seed) && H5Fflush(f.file, H5F_SCOPE_GLOBAL) >= 0;
  if (!written) fail(path, "the recording cannot be written");
}

RecordingWriter::~RecordingWriter() {
  if (!file_ || file_->failed) return;
  try {
    write_block();
  } catch (const RecordingError&) {
    // The file stays readable up to the block before; a destructor has no one to tell.
  }
}

void RecordingWriter::row(const TelemetryRow& row) {
  block_.push_back(row);
  if (block_.size() == kBlockRows) write_block();
}

void RecordingWriter::write_block() {
  if (block_.empty()) return;
  const Quiet quiet;
  File& f = *file_;
  const hsize_t rows = block_.size();
  f.reserve(kBlockRows * sizeof(TelemetryRow) + kSlack);
  if (!append(f.rows, H5T_NATIVE_DOUBLE, 2, kRowWidth, f.row_count, rows, block_.data()) ||
      H5Fflush(f.file, H5F_SCOPE_GLOBAL) < 0) {
    f.failed = true;
    fail(f.path, "the recording cannot be written");
  }
  f.row_count += rows;
  block_.clear();
}

void RecordingWriter::alarm(const Alarm& alarm) {
  write_block();
  const Quiet quiet;
  File& f = *file_;
  f.reserve(alarm.text.size() + kSlack);
  const AlarmRow row{alarm.tick, alarm.code, alarm.source.c_str(), alarm.text.c_str()};
  if (!append(f.alarms, alarm_type(), 1, 0, f.alarm_count, 1, &row) ||
      H5Fflush(f.file, H5F_SCOPE_GLOBAL) < 0) {
    f.failed = true;
    fail(f.path, "the recording cannot be written");
  }
  ++f.alarm_count;
}

void RecordingWriter::finish(const RunEnd& end) {
  write_block();
  const Quiet quiet;
  File& f = *file_;
  f.reserve(kSlack);
  bool written = write(f.file, "complete", std::int64_t{end.complete}) &&
                 write(f.file, "reason", end.reason) && write(f.file, "cycles", end.cycles) &&
                 write(f.file, "trace_hash", end.trace_hash) &&
                 write(f.file, "wall_seconds", end.wall_seconds) &&
                 write(f.file, "bus_load_worst", end.bus_load_worst) &&
                 write(f.file, "gaps", end.gaps) && H5Fflush(f.file, H5F_SCOPE_GLOBAL) >= 0;
  f.rows = Handle();
  f.alarms = Handle();
  written = H5Fclose(f.file.release()) >= 0 && written;
  written = written && put_seal(partial(f.path));
  if (!written) fail(f.path, "the recording cannot be completed");
  std::error_code error;
  std::filesystem::rename(partial(f.path), f.path, error);
  const std::filesystem::path path = f.path;
  file_.reset();
  if (error) throw RecordingError(path.string() + ": cannot be renamed: " + error.message());
}

}  // namespace vcnc
