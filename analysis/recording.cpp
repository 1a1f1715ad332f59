#include "analysis/recording.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <hdf5.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include "analysis/whole_file.hpp"

namespace vcnc {
namespace {

constexpr hsize_t kBlockRows = 1000;
constexpr hsize_t kSlack = 128 * 1024;  ///< for what HDF5 keeps beside the data [bytes]
constexpr const char* kFormat = "vcnc-recording";
constexpr std::int64_t kFormatVersion = 1;

/// Keeps HDF5 from printing its error stack; failures are reported as exceptions instead.
class Quiet {
 public:
  Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    errno = 0;
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// Owner of one HDF5 identifier of any kind.
class Handle {
 public:
  Handle() = default;
  explicit Handle(hid_t id) : id_(id) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Handle() {
    if (id_ < 0) return;
    const Quiet quiet;  // closing after a failed write fails again
    H5Idec_ref(id_);
  }
  operator hid_t() const { return id_; }  // NOLINT: goes straight into the C API
  bool ok() const { return id_ >= 0; }
  hid_t release() { return std::exchange(id_, -1); }

 private:
  hid_t id_ = -1;
};

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  const std::string why = errno != 0 ? std::string(": ") + std::strerror(errno) : "";
  throw RecordingError(fmt::format("{}: {}{}", path.string(), what, why));
}

std::filesystem::path partial(const std::filesystem::path& path) {
  return path.string() + ".partial";
}

Handle string_type() {
  Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

/// An alarm as it lies in the table.
struct AlarmRow {
  std::int64_t tick;
  std::int64_t code;
  const char* source;
  const char* text;
};

Handle alarm_type() {
  const Handle text = string_type();
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(AlarmRow)));
  H5Tinsert(type, "tick", HOFFSET(AlarmRow, tick), H5T_NATIVE_INT64);
  H5Tinsert(type, "code", HOFFSET(AlarmRow, code), H5T_NATIVE_INT64);
  H5Tinsert(type, "source", HOFFSET(AlarmRow, source), text);
  H5Tinsert(type, "text", HOFFSET(AlarmRow, text), text);
  return type;
}

// ------------------------------------------------------------------ attributes
bool write_attribute(hid_t object, const char* name, hid_t type, hid_t space, const void* value) {
  const Handle a(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT));
  return a.ok() && H5Awrite(a, type, value) >= 0;
}
bool write(hid_t object, const char* name, const std::string& value) {
  const char* text = value.c_str();
  return write_attribute(object, name, string_type(), Handle(H5Screate(H5S_SCALAR)), &text);
}
bool write(hid_t object, const char* name, std::int64_t value) {
  return write_attribute(object, name, H5T_NATIVE_INT64, Handle(H5Screate(H5S_SCALAR)), &value);
}
bool write(hid_t object, const char* name, std::uint64_t value) {
  return write_attribute(object, name, H5T_NATIVE_UINT64, Handle(H5Screate(H5S_SCALAR)), &value);
}
bool write(hid_t object, const char* name, double value) {
  return write_attribute(object, name, H5T_NATIVE_DOUBLE, Handle(H5Screate(H5S_SCALAR)), &value);
}
bool write(hid_t object, const char* name, const std::vector<std::string>& values) {
  std::vector<const char*> texts;
  for (const std::string& v : values) texts.push_back(v.c_str());
  const hsize_t n = texts.size();
  return write_attribute(object, name, string_type(), Handle(H5Screate_simple(1, &n, nullptr)),
                         texts.data());
}

bool read_attribute(hid_t object, const char* name, hid_t type, void* value) {
  if (H5Aexists(object, name) <= 0) return false;
  const Handle a(H5Aopen(object, name, H5P_DEFAULT));
  return a.ok() && H5Aread(a, type, value) >= 0;
}
bool read(hid_t object, const char* name, std::string& value) {
  char* text = nullptr;
  if (!read_attribute(object, name, string_type(), &text) || text == nullptr) return false;
  value = text;
  H5free_memory(text);
  return true;
}
bool read(hid_t object, const char* name, std::int64_t& value) {
  return read_attribute(object, name, H5T_NATIVE_INT64, &value);
}
bool read(hid_t object, const char* name, std::uint64_t& value) {
  return read_attribute(object, name, H5T_NATIVE_UINT64, &value);
}
bool read(hid_t object, const char* name, double& value) {
  return read_attribute(object, name, H5T_NATIVE_DOUBLE, &value);
}

// ------------------------------------------------------------------ tables that grow
Handle create_growing(hid_t file, const char* name, hid_t type, int rank, hsize_t width,
                      hsize_t chunk_rows) {
  const std::array<hsize_t, 2> size{0, width}, limit{H5S_UNLIMITED, width},
      chunk{chunk_rows, width};
  const Handle space(H5Screate_simple(rank, size.data(), limit.data()));
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_chunk(layout, rank, chunk.data());
  return Handle(H5Dcreate2(file, name, type, space, H5P_DEFAULT, layout, H5P_DEFAULT));
}

bool append(hid_t table, hid_t type, int rank, hsize_t width, hsize_t at, hsize_t rows,
            const void* data) {
  const std::array<hsize_t, 2> size{at + rows, width}, start{at, 0}, count{rows, width};
  if (H5Dset_extent(table, size.data()) < 0) return false;
  const Handle space(H5Dget_space(table));
  const Handle memory(H5Screate_simple(rank, count.data(), nullptr));
  return H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) >=
             0 &&
         H5Dwrite(table, type, memory, space, H5P_DEFAULT, data) >= 0;
}

hsize_t row_count(hid_t table, hsize_t* width) {
  std::array<hsize_t, 2> size{0, 0};
  const Handle space(H5Dget_space(table));
  if (H5Sget_simple_extent_ndims(space) > 2) return 0;
  H5Sget_simple_extent_dims(space, size.data(), nullptr);
  if (width != nullptr) *width = size[1];
  return size[0];
}

}  // namespace

// ------------------------------------------------------------------ writing
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
  const int error = posix_fallocate(descriptor, static_cast<off_t>(size),
                                    static_cast<off_t>(bytes));
  if (error != ENOSPC && error != EFBIG && error != EDQUOT && error != EIO) return;
  failed = true;
  errno = error;
  fail(path, "the recording cannot be written");
}

RecordingWriter::RecordingWriter(const std::filesystem::path& path, const RunBegin& begin)
    : file_(std::make_unique<File>()) {
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
  const bool written =
      f.rows.ok() && f.alarms.ok() && write(f.rows, "channels", channels) &&
      write(f.rows, "names", names) && write(f.rows, "units", units) &&
      write(f.file, "format", std::string(kFormat)) &&
      write(f.file, "format_version", kFormatVersion) && write(f.file, "cycle_s", kCycle) &&
      write(f.file, "run_id", begin.run_id) && write(f.file, "program_name", begin.program_name) &&
      write(f.file, "machine_toml", begin.declared_toml) &&
      write(f.file, "piece_toml", begin.piece_toml) && write(f.file, "seed", begin.seed) &&
      H5Fflush(f.file, H5F_SCOPE_GLOBAL) >= 0;
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
  if (!written) fail(f.path, "the recording cannot be completed");
  std::error_code error;
  std::filesystem::rename(partial(f.path), f.path, error);
  const std::filesystem::path path = f.path;
  file_.reset();
  if (error) throw RecordingError(path.string() + ": cannot be renamed: " + error.message());
}

// ------------------------------------------------------------------ reading
struct RecordingReader::File {
  Handle file, rows;
};

namespace {

std::filesystem::path find_recording(std::filesystem::path path) {
  std::error_code ignored;
  const std::filesystem::path given = path;
  if (std::filesystem::is_directory(path, ignored)) path /= kRecordingName;
  if (std::filesystem::exists(path, ignored)) return path;
  if (std::filesystem::exists(partial(path), ignored)) return partial(path);
  if (path != given)
    throw RecordingError(
        fmt::format("{}: the folder holds no {}", given.string(), kRecordingName));
  throw RecordingError(given.string() + ": no such file or folder");
}

std::vector<Alarm> read_alarms(hid_t file) {
  const Handle table(H5Dopen2(file, "alarms", H5P_DEFAULT));
  if (!table.ok()) return {};
  std::vector<AlarmRow> rows(row_count(table, nullptr));
  if (rows.empty()) return {};
  const Handle type = alarm_type(), space(H5Dget_space(table));
  if (H5Dread(table, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()) < 0) return {};
  std::vector<Alarm> alarms;
  for (const AlarmRow& r : rows)
    alarms.push_back({r.tick, static_cast<int>(r.code), r.source ? r.source : "",
                      r.text ? r.text : ""});
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, rows.data());
  return alarms;
}

/// Nothing when the run never ended.
std::optional<RunEnd> read_end(hid_t file) {
  RunEnd end;
  std::int64_t complete = 0;
  if (!read(file, "complete", complete) || !read(file, "reason", end.reason) ||
      !read(file, "cycles", end.cycles) || !read(file, "trace_hash", end.trace_hash) ||
      !read(file, "wall_seconds", end.wall_seconds) ||
      !read(file, "bus_load_worst", end.bus_load_worst) || !read(file, "gaps", end.gaps))
    return std::nullopt;
  end.complete = complete != 0;
  return end;
}

}  // namespace

RecordingReader::RecordingReader(const std::filesystem::path& path)
    : path_(find_recording(path)), file_(std::make_unique<File>()) {
  const Quiet quiet;
  File& f = *file_;
  f.file = Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  if (!f.file.ok())
    fail(path_, H5Fis_hdf5(path_.c_str()) > 0 ? "the recording is damaged and cannot be opened"
                                              : "is not an HDF5 file or cannot be read");
  std::string format;
  std::int64_t version = 0;
  errno = 0;
  if (!read(f.file, "format", format) || format != kFormat)
    fail(path_, "is an HDF5 file, but not a vcnc recording");
  if (!read(f.file, "format_version", version) || version != kFormatVersion)
    throw RecordingError(fmt::format("{}: recording format {}; this program reads format {}",
                                     path_.string(), version, kFormatVersion));
  const auto need = [&](bool there, const char* what) {
    if (!there) missing_.emplace_back(what);
  };
  need(read(f.file, "run_id", begin_.run_id), "run id");
  need(read(f.file, "program_name", begin_.program_name), "program name");
  need(read(f.file, "machine_toml", begin_.declared_toml), "machine");
  need(read(f.file, "piece_toml", begin_.piece_toml), "piece");
  need(read(f.file, "seed", begin_.seed), "seed");
  hsize_t width = 0;
  f.rows = Handle(H5Dopen2(f.file, "rows", H5P_DEFAULT));
  if (!f.rows.ok()) fail(path_, "holds no rows");
  rows_ = row_count(f.rows, &width);
  if (width != kRowWidth)
    throw RecordingError(fmt::format("{}: rows have {} channels; this program reads {}",
                                     path_.string(), width, kRowWidth));
  alarms_ = read_alarms(f.file);
  if (const auto end = read_end(f.file)) {
    end_ = *end;
  } else {
    need(false, "end of the run");
    end_.cycles = static_cast<std::int64_t>(rows_);
  }
}

RecordingReader::~RecordingReader() = default;

void RecordingReader::for_each(const std::function<void(const TelemetryRow&)>& f) const {
  std::vector<TelemetryRow> block(kBlockRows);
  const Handle space(H5Dget_space(file_->rows));
  for (hsize_t at = 0; at < rows_; at += kBlockRows) {
    const std::array<hsize_t, 2> start{at, 0},
        count{std::min<hsize_t>(kBlockRows, rows_ - at), kRowWidth};
    {
      const Quiet quiet;
      const Handle memory(H5Screate_simple(2, count.data(), nullptr));
      H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
      if (H5Dread(file_->rows, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, block.data()) < 0)
        fail(path_, "rows cannot be read");
    }
    for (hsize_t i = 0; i < count[0]; ++i) f(block[i]);
  }
}

void write_csv(const RecordingReader& recording, const std::filesystem::path& path) {
  WholeFile file(path);
  std::string line;
  for (const Channel& c : kChannels) line += fmt::format("{}{} [{}]", line.empty() ? "" : ",", c.name, c.unit);
  file.stream() << line << '\n';
  recording.for_each([&](const TelemetryRow& row) {
    line.clear();
    for (const double v : std::bit_cast<std::array<double, kRowWidth>>(row)) {
      std::array<char, 32> text{};
      const auto end = std::to_chars(text.data(), text.data() + text.size(), v).ptr;
      if (!line.empty()) line += ',';
      line.append(text.data(), end);
    }
    file.stream() << line << '\n';
  });
  file.commit();
}

}  // namespace vcnc
