#include "diagnosis/records/record_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include "analysis/hdf5_columns.hpp"
#include "analysis/hdf5_file.hpp"
#include "analysis/seal.hpp"
#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/records/signal_name.hpp"

namespace vcnc {

using namespace hdf5;  // NOLINT: this file is written in its terms

namespace {

constexpr const char* kRecordFormat = "vcnc-record";
constexpr std::int64_t kRecordVersion = 2;
constexpr std::int64_t kMostSignals = 1000;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& reason) {
  throw MeasurementError(path.string() + ": " + reason);
}

std::string set_name(std::size_t i) { return fmt::format("signal_{}", i); }

bool write_signal(hid_t file, std::size_t i, const MeasuredSignal& s) {
  const hsize_t n = s.value.size();
  const Handle space(H5Screate_simple(1, &n, nullptr));
  const Handle set(H5Dcreate2(file, set_name(i).c_str(), H5T_NATIVE_DOUBLE, space, H5P_DEFAULT,
                              H5P_DEFAULT, H5P_DEFAULT));
  return set.ok() && write(set, "kind", std::string(to_string(s.kind))) &&
         write(set, "axis", static_cast<std::int64_t>(s.axis)) && write(set, "source", s.source) &&
         write(set, "resolution", s.resolution) &&
         write(set, "relative", static_cast<std::int64_t>(s.relative)) &&
         H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, s.value.data()) >= 0;
}

bool write_on_table(hid_t file, const std::optional<OnTable>& it) {
  return !it ||
         (write(file, "bar_length_m", it->bar_length) && write(file, "zero_x_m", it->zero.x()) &&
          write(file, "zero_y_m", it->zero.y()) && write(file, "zero_z_m", it->zero.z()));
}

std::optional<OnTable> read_on_table(hid_t file) {
  OnTable it;
  const bool there = read(file, "bar_length_m", it.bar_length) &&
                     read(file, "zero_x_m", it.zero.x()) && read(file, "zero_y_m", it.zero.y()) &&
                     read(file, "zero_z_m", it.zero.z());
  return there ? std::optional(it) : std::nullopt;
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string stretches_text(const Record& record) {
  std::string text;
  for (const Stretch& s : record.stretches)
    text += fmt::format("{} {} {} {} {}\n", s.begin, s.end, s.condition, s.repetition,
                        one_line(s.label));
  return text;
}

std::string axis_names_text(const Record& record) {
  std::string text;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (!record.axis_names[i].empty())
      text += fmt::format("{} {}\n", kAxisNames[i], one_line(record.axis_names[i]));
  return text;
}

void read_axis_names(const std::string& text, Record& record) {
  std::istringstream lines(text);
  std::string place, name;
  while (lines >> place && std::getline(lines >> std::ws, name))
    if (const std::size_t axis = axis_named(place); axis < kAxisCount)
      record.axis_names[axis] = name;
}

bool read_signal(hid_t file, std::size_t i, MeasuredSignal& s, std::uintmax_t file_size) {
  const Handle set(H5Dopen2(file, set_name(i).c_str(), H5P_DEFAULT));
  std::string kind;
  std::int64_t axis = 0;
  if (!set.ok() || !read(set, "kind", kind) || !read(set, "axis", axis) ||
      !read(set, "source", s.source) || !read(set, "resolution", s.resolution))
    return false;
  const std::optional<SignalKind> known = signal_kind(kind);
  const hsize_t samples = size_of(set, 1)[0];
  if (!known || axis < 0 || axis >= static_cast<std::int64_t>(kAxisCount) ||
      samples > file_size / sizeof(double))
    return false;
  std::int64_t relative = 0;  // older files do not have it
  s.relative = read(set, "relative", relative) && relative != 0;
  s.kind = *known;
  s.axis = static_cast<std::size_t>(axis);
  s.value.resize(samples);
  return H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, s.value.data()) >= 0;
}

bool read_stretches(const std::string& text, Record& record) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    Stretch& s = record.stretches.emplace_back();
    if (!(fields >> s.begin >> s.end >> s.condition >> s.repetition) || s.begin >= s.end ||
        s.end > record.samples())
      return false;
    std::getline(fields >> std::ws, s.label);
  }
  return true;
}

/// The whole file in memory: HDF5 does not survive a disk that is full when it closes a file.
std::string image_of(const Record& record, const std::filesystem::path& path) {
  constexpr std::size_t kGrowth = 1 << 20;
  const Quiet quiet;
  const Handle in_memory(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_fapl_core(in_memory, kGrowth, /*backing_store=*/false);
  const Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, in_memory));
  std::string warnings;
  for (const std::string& w : record.warnings) warnings += one_line(w) + "\n";
  bool made = file.ok() && write(file, "format", std::string(kRecordFormat)) &&
              write(file, "format_version", kRecordVersion) &&
              write(file, "signals", static_cast<std::int64_t>(record.signals.size())) &&
              write(file, "source", record.source) && write(file, "period_s", record.period) &&
              write(file, "begin_s", record.begin) &&
              write(file, "machine_toml", record.machine_toml) &&
              write(file, "piece_toml", record.piece_toml) &&
              write(file, "stretches", stretches_text(record)) &&
              write(file, "axis_names", axis_names_text(record)) &&
              write(file, "warnings", warnings) && write_on_table(file, record.on_table);
  for (std::size_t i = 0; made && i < record.signals.size(); ++i)
    made = write_signal(file, i, record.signals[i]);
  made = made && H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0;
  const ssize_t size = made ? H5Fget_file_image(file, nullptr, 0) : -1;
  std::string image(static_cast<std::size_t>(std::max<ssize_t>(size, 0)), '\0');
  if (size <= 0 || H5Fget_file_image(file, image.data(), image.size()) != size)
    refuse(path, "the record cannot be written");
  return image;
}

}  // namespace

void write_record(const Record& record, const std::filesystem::path& path) {
  const std::string image = image_of(record, path);
  const std::filesystem::path part = partial(path);
  std::ofstream out(part, std::ios::binary | std::ios::trunc);
  if (!out)
    refuse(path, path.has_parent_path() && !std::filesystem::is_directory(path.parent_path())
                     ? "there is no folder " + path.parent_path().string()
                     : "the record cannot be created");
  errno = 0;
  out.write(image.data(), static_cast<std::streamsize>(image.size()));
  out.close();
  const bool written = !out.fail() && put_seal(part);
  const int why = errno;
  std::error_code error;
  if (written) std::filesystem::rename(part, path, error);
  if (written && !error) return;
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  refuse(path, std::string("the record cannot be written") +
                   (why != 0 ? std::string(": ") + std::strerror(why) : ""));
}

Record read_record(const std::filesystem::path& path) {
  if (const Seal seal = seal_of(path); seal != Seal::intact)
    refuse(path, "the record is incomplete, damaged or was changed; import it again");
  const Quiet quiet;
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  std::string format, stretches, warnings, axis_names;
  std::int64_t version = 0, signals = 0;
  if (!file.ok() || !read(file, "format", format) || format != kRecordFormat)
    refuse(path, "is no record of vcnc import");
  if (!read(file, "format_version", version) || version != kRecordVersion)
    refuse(path,
           fmt::format("record format {}; this program reads format {}", version, kRecordVersion));
  Record record;
  bool sound = read(file, "signals", signals) && read(file, "source", record.source) &&
               read(file, "period_s", record.period) && read(file, "begin_s", record.begin) &&
               read(file, "machine_toml", record.machine_toml) &&
               read(file, "piece_toml", record.piece_toml) && read(file, "stretches", stretches) &&
               read(file, "warnings", warnings) && signals >= 0 && signals <= kMostSignals &&
               record.period > 0;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  for (std::int64_t i = 0; sound && i < signals; ++i) {
    sound = read_signal(file, static_cast<std::size_t>(i), record.signals.emplace_back(), size);
    sound = sound && record.signals.back().value.size() == record.samples();
  }
  record.on_table = read_on_table(file);
  if (read(file, "axis_names", axis_names)) read_axis_names(axis_names, record);  // newer files
  const auto has = [&](SignalKind kind) {
    return std::any_of(record.signals.begin(), record.signals.end(),
                       [&](const MeasuredSignal& s) { return s.kind == kind; });
  };
  const std::optional<OnTable>& it = record.on_table;
  if (!sound || has(SignalKind::bar) != (it && it->is_bar()) ||
      has(SignalKind::tool_position) != (it && !it->is_bar()) || !read_stretches(stretches, record))
    refuse(path, "the record is damaged");
  std::istringstream lines(warnings);
  for (std::string line; std::getline(lines, line);) record.warnings.push_back(line);
  return record;
}

namespace {

/// HDF5 is not asked about a damaged file.
bool says_format(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string format = kRecordFormat;
  for (std::size_t at = 0; (at = bytes.find(format, at)) != bytes.npos; at += format.size())
    if (bytes.compare(at, std::strlen(kFormat), kFormat) != 0) return true;
  return false;
}

}  // namespace

bool is_record_file(const std::filesystem::path& path) {
  if (!looks_like_hdf5(path)) return false;
  if (seal_of(path) != Seal::intact) return says_format(path);
  const Quiet quiet;
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  std::string format;
  return file.ok() && read(file, "format", format) && format == kRecordFormat;
}

}  // namespace vcnc
