#include <bit>
#include <charconv>
#include <optional>

#include "analysis/hdf5_file.hpp"
#include "analysis/recording.hpp"
#include "analysis/seal.hpp"
#include "analysis/tried_read.hpp"
#include "analysis/whole_file.hpp"

namespace vcnc {

using namespace hdf5;  // NOLINT: this file is written in its terms

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
    throw RecordingError(fmt::format("{}: the folder holds no {}", given.string(), kRecordingName));
  throw RecordingError(given.string() + ": no such file or folder");
}

constexpr const char* kDamaged = "the recording is damaged and cannot be opened";

/// The most rows that a file of this size can hold, should somebody have compressed it. What a
/// damaged file claims beyond that would be made up by HDF5, and without end.
hsize_t most_rows(const std::filesystem::path& path, std::size_t bytes_per_row) {
  constexpr hsize_t kBestCompression = 1032;  // of deflate
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size * kBestCompression / bytes_per_row;
}

std::vector<Alarm> read_alarms(hid_t file, const std::filesystem::path& path) {
  const Handle table(H5Dopen2(file, "alarms", H5P_DEFAULT));
  if (!table.ok()) return {};
  const hsize_t count = size_of(table, 1)[0];
  if (count == 0) return {};
  if (count > most_rows(path, sizeof(AlarmRow))) {
    errno = 0;
    fail(path, kDamaged);
  }
  std::vector<AlarmRow> rows(count);
  const Handle type = alarm_type(), space(H5Dget_space(table));
  if (H5Dread(table, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()) < 0) return {};
  std::vector<Alarm> alarms;
  for (const AlarmRow& r : rows)
    alarms.push_back(
        {r.tick, static_cast<int>(r.code), r.source ? r.source : "", r.text ? r.text : ""});
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
  const Seal seal = seal_of(path_);
  if (seal == Seal::broken) {
    errno = 0;
    fail(path_, "the recording was changed after it was closed, or is damaged");
  }
  if (seal == Seal::none) {
    try_in_child();
    if (path_.extension() != ".partial") missing_.emplace_back("seal");
  }
  open();
}

/// Reads everything once in a child process; throws what that finds, or that it died of it.
void RecordingReader::try_in_child() {
  vcnc::try_in_child(path_, kDamaged, [this] {
    open();
    try {
      for_each([](const TelemetryRow&) {});
    } catch (const RecordingError&) {  // rows that cannot be read: whoever asks for them
    }
  });
}

void RecordingReader::open() {
  const Quiet quiet;
  File& f = *file_;
  f.file = Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  if (!f.file.ok())
    fail(path_, H5Fis_hdf5(path_.c_str()) > 0 ? kDamaged : "is not an HDF5 file or cannot be read");
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
  f.rows = Handle(H5Dopen2(f.file, "rows", H5P_DEFAULT));
  if (!f.rows.ok()) fail(path_, "holds no rows");
  const auto [rows, width] = size_of(f.rows, 2);
  if (width != kRowWidth)
    throw RecordingError(fmt::format("{}: rows have {} channels; this program reads {}",
                                     path_.string(), width, kRowWidth));
  errno = 0;
  if (rows > most_rows(path_, sizeof(TelemetryRow))) fail(path_, kDamaged);
  rows_ = rows;
  alarms_ = read_alarms(f.file, path_);
  if (const auto end = read_end(f.file)) {
    end_ = *end;
  } else {
    need(false, "end of the run");
    drop_unwritten();
    end_.cycles = static_cast<std::int64_t>(rows_);
  }
}

RecordingReader::~RecordingReader() = default;

/// A writer that was killed may have announced a block and not written it, or not all of it: then
/// it cannot be read, or its rows are zeros, whose ticks do not go on. The row before the first of
/// these may be torn.
void RecordingReader::drop_unwritten() {
  for (bool whole = false; rows_ > 0 && !whole;) {
    const std::uint64_t at = (rows_ - 1) / kBlockRows * kBlockRows;
    const auto block = read_block(at, rows_ - at);
    const auto before = at > 0 ? read_block(at - 1, 1) : std::nullopt;
    double last = before ? before->front().tick : -1;
    std::uint64_t written = 0;
    while (block && written < block->size() && (*block)[written].tick > last)
      last = (*block)[written++].tick;
    whole = block && written == block->size();
    if (!whole) rows_ = at + (written > 0 ? written - 1 : 0);
    if (written > 1) whole = true;
  }
}

/// Nothing where the file does not hold them.
std::optional<std::vector<TelemetryRow>> RecordingReader::read_block(std::uint64_t at,
                                                                     std::uint64_t rows) const {
  const Quiet quiet;
  std::vector<TelemetryRow> block(rows);
  const std::array<hsize_t, 2> start{at, 0}, count{rows, kRowWidth};
  const Handle space(H5Dget_space(file_->rows)), memory(H5Screate_simple(2, count.data(), nullptr));
  H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  if (H5Dread(file_->rows, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, block.data()) < 0)
    return std::nullopt;
  return block;
}

void RecordingReader::for_each(const std::function<void(const TelemetryRow&)>& f) const {
  for (std::uint64_t at = 0; at < rows_; at += kBlockRows) {
    const auto block = read_block(at, std::min<std::uint64_t>(kBlockRows, rows_ - at));
    if (!block) fail(path_, "rows cannot be read");
    for (const TelemetryRow& row : *block) f(row);
  }
}

void write_csv(const RecordingReader& recording, const std::filesystem::path& path) {
  WholeFile file(path);
  std::string line;
  for (const Channel& c : kChannels)
    line += fmt::format("{}{} [{}]", line.empty() ? "" : ",", c.name, c.unit);
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
