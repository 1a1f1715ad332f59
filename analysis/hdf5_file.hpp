// A thin owner layer over the C API of HDF5, and what writer and reader of recordings share.
// Private to the recording.
#pragma once

#include <fmt/format.h>
#include <hdf5.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "analysis/recording.hpp"

namespace vcnc::hdf5 {

inline constexpr hsize_t kBlockRows = 1000;
inline constexpr hsize_t kSlack = 128 * 1024;  ///< for what HDF5 keeps beside the data [bytes]
inline constexpr const char* kFormat = "vcnc-recording";
inline constexpr std::int64_t kFormatVersion = 1;

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
    const int why = errno;  // of what failed before; someone may still want to report it
    {
      const Quiet quiet;  // closing after a failed write fails again
      H5Idec_ref(id_);
    }
    errno = why;
  }
  operator hid_t() const { return id_; }  // NOLINT: goes straight into the C API
  bool ok() const { return id_ >= 0; }
  hid_t release() { return std::exchange(id_, -1); }

 private:
  hid_t id_ = -1;
};

[[noreturn]] inline void fail(const std::filesystem::path& path, const char* what) {
  const std::string why = errno != 0 ? std::string(": ") + std::strerror(errno) : "";
  throw RecordingError(fmt::format("{}: {}{}", path.string(), what, why));
}

inline std::filesystem::path partial(const std::filesystem::path& path) {
  return path.string() + ".partial";
}

inline Handle string_type() {
  Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

// ------------------------------------------------------------------ attributes
inline bool write_attribute(hid_t object, const char* name, hid_t type, hid_t space,
                            const void* value) {
  const Handle a(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT));
  return a.ok() && H5Awrite(a, type, value) >= 0;
}
inline bool write(hid_t object, const char* name, const std::string& value) {
  const char* text = value.c_str();
  return write_attribute(object, name, string_type(), Handle(H5Screate(H5S_SCALAR)), &text);
}
inline bool write(hid_t object, const char* name, std::int64_t value) {
  return write_attribute(object, name, H5T_NATIVE_INT64, Handle(H5Screate(H5S_SCALAR)), &value);
}
inline bool write(hid_t object, const char* name, std::uint64_t value) {
  return write_attribute(object, name, H5T_NATIVE_UINT64, Handle(H5Screate(H5S_SCALAR)), &value);
}
inline bool write(hid_t object, const char* name, double value) {
  return write_attribute(object, name, H5T_NATIVE_DOUBLE, Handle(H5Screate(H5S_SCALAR)), &value);
}
inline bool write(hid_t object, const char* name, const std::vector<std::string>& values) {
  std::vector<const char*> texts;
  for (const std::string& v : values) texts.push_back(v.c_str());
  const hsize_t n = texts.size();
  return write_attribute(object, name, string_type(), Handle(H5Screate_simple(1, &n, nullptr)),
                         texts.data());
}

/// Reads an attribute of one element; one of more would not fit into `value`.
inline bool read_attribute(hid_t object, const char* name, hid_t type, void* value) {
  if (H5Aexists(object, name) <= 0) return false;
  const Handle a(H5Aopen(object, name, H5P_DEFAULT));
  if (!a.ok()) return false;
  const Handle space(H5Aget_space(a));
  return space.ok() && H5Sget_simple_extent_npoints(space) == 1 && H5Aread(a, type, value) >= 0;
}
inline bool read(hid_t object, const char* name, std::string& value) {
  char* text = nullptr;
  if (!read_attribute(object, name, string_type(), &text) || text == nullptr) return false;
  value = text;
  H5free_memory(text);
  return true;
}
inline bool read(hid_t object, const char* name, std::int64_t& value) {
  return read_attribute(object, name, H5T_NATIVE_INT64, &value);
}
inline bool read(hid_t object, const char* name, std::uint64_t& value) {
  return read_attribute(object, name, H5T_NATIVE_UINT64, &value);
}
inline bool read(hid_t object, const char* name, double& value) {
  return read_attribute(object, name, H5T_NATIVE_DOUBLE, &value);
}

// ------------------------------------------------------------------ tables that grow
inline Handle create_growing(hid_t file, const char* name, hid_t type, int rank, hsize_t width,
                             hsize_t chunk_rows) {
  const std::array<hsize_t, 2> size{0, width}, limit{H5S_UNLIMITED, width},
      chunk{chunk_rows, width};
  const Handle space(H5Screate_simple(rank, size.data(), limit.data()));
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_chunk(layout, rank, chunk.data());
  return Handle(H5Dcreate2(file, name, type, space, H5P_DEFAULT, layout, H5P_DEFAULT));
}

inline bool append(hid_t table, hid_t type, int rank, hsize_t width, hsize_t at, hsize_t rows,
                   const void* data) {
  const std::array<hsize_t, 2> size{at + rows, width}, start{at, 0}, count{rows, width};
  if (H5Dset_extent(table, size.data()) < 0) return false;
  const Handle space(H5Dget_space(table));
  const Handle memory(H5Screate_simple(rank, count.data(), nullptr));
  return H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) >=
             0 &&
         H5Dwrite(table, type, memory, space, H5P_DEFAULT, data) >= 0;
}

/// Rows and columns of a table of this rank (1: no columns); nothing of any other.
inline std::array<hsize_t, 2> size_of(hid_t table, int rank) {
  std::array<hsize_t, 2> size{0, 0};
  const Handle space(H5Dget_space(table));
  if (!space.ok() || H5Sget_simple_extent_ndims(space) != rank ||
      H5Sget_simple_extent_dims(space, size.data(), nullptr) < 0)
    return {0, 0};
  return size;
}

// ------------------------------------------------------------------ alarms
/// An alarm as it lies in the table.
struct AlarmRow {
  std::int64_t tick = 0;
  std::int64_t code = 0;
  const char* source = nullptr;
  const char* text = nullptr;
};

inline Handle alarm_type() {
  const Handle text = string_type();
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(AlarmRow)));
  H5Tinsert(type, "tick", HOFFSET(AlarmRow, tick), H5T_NATIVE_INT64);
  H5Tinsert(type, "code", HOFFSET(AlarmRow, code), H5T_NATIVE_INT64);
  H5Tinsert(type, "source", HOFFSET(AlarmRow, source), text);
  H5Tinsert(type, "text", HOFFSET(AlarmRow, text), text);
  return type;
}

}  // namespace vcnc::hdf5
