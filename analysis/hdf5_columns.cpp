#include "analysis/hdf5_columns.hpp"

#include <algorithm>
#include <fstream>

#include "analysis/hdf5_file.hpp"
#include "analysis/seal.hpp"
#include "analysis/tried_read.hpp"

namespace vcnc {

using namespace hdf5;  // NOLINT: this file is written in its terms

namespace {

constexpr hsize_t kMostValues = 500'000'000, kMostColumns = 10'000;

/// A damaged file may claim to hold any number of them.
hsize_t most_values(const std::filesystem::path& path) {
  constexpr hsize_t kBestCompression = 1032;  // of deflate
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : std::min<hsize_t>(kMostValues, size * kBestCompression);
}

bool is_number(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return kind == H5T_FLOAT || kind == H5T_INTEGER;
}

/// Texts of an attribute with one per column; empty where there is none of that kind.
std::vector<std::string> names_of(hid_t table, hsize_t columns) {
  for (const char* attribute : {"names", "channels", "columns"}) {
    if (H5Aexists(table, attribute) <= 0) continue;
    const Handle a(H5Aopen(table, attribute, H5P_DEFAULT));
    const Handle space(H5Aget_space(a)), type(H5Aget_type(a));
    if (!a.ok() || H5Tget_class(type) != H5T_STRING ||
        H5Sget_simple_extent_npoints(space) != static_cast<hssize_t>(columns))
      continue;
    std::vector<std::string> names;
    if (H5Tis_variable_str(type) > 0) {
      std::vector<char*> texts(columns, nullptr);
      Handle memory(H5Tcopy(type));
      if (H5Aread(a, memory, texts.data()) < 0) continue;
      for (const char* text : texts) names.emplace_back(text ? text : "");
      H5Dvlen_reclaim(memory, space, H5P_DEFAULT, texts.data());
    } else {
      const std::size_t width = H5Tget_size(type);
      if (width == 0 || width > 4096) continue;
      std::vector<char> bytes(width * columns);
      if (H5Aread(a, type, bytes.data()) < 0) continue;
      for (hsize_t i = 0; i < columns; ++i) {
        const char* text = bytes.data() + i * width;
        names.emplace_back(text, strnlen(text, width));
      }
    }
    return names;
  }
  return {};
}

class ColumnReader {
 public:
  explicit ColumnReader(const std::filesystem::path& path)
      : path_(path), most_values_(most_values(path)) {}

  std::vector<Hdf5Column> read() {
    const Quiet quiet;
    const Handle file(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
    if (!file.ok()) fail("is damaged and cannot be opened");
    const auto visit = [](hid_t root, const char* name, const H5O_info_t* info, void* self) {
      auto& reader = *static_cast<ColumnReader*>(self);
      try {  // no exception may pass the C library
        if (info->type == H5O_TYPE_DATASET) reader.data_set(root, name);
      } catch (const std::exception&) {
        reader.unreadable_ = true;
      }
      return 0;
    };
    if (H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, visit, this) < 0) fail("cannot be read");
    if (too_large_) fail("holds more numbers than this program reads");
    if (unreadable_) fail("holds values that cannot be read");
    return std::move(columns_);
  }

 private:
  [[noreturn]] void fail(const char* what) const {
    throw RecordingError(path_.string() + ": " + what);
  }

  bool room_for(hsize_t rows, hsize_t columns) {
    if (columns > kMostColumns || columns_.size() + columns > kMostColumns ||
        columns > (most_values_ - values_) / rows) {
      too_large_ = true;
      return false;
    }
    values_ += rows * columns;
    return true;
  }

  void data_set(hid_t root, const char* name) {
    if (too_large_) return;
    const Handle set(H5Dopen2(root, name, H5P_DEFAULT));
    if (!set.ok()) return;
    const Handle type(H5Dget_type(set)), space(H5Dget_space(set));
    std::array<hsize_t, 2> size{0, 1};
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank < 1 || rank > 2 || H5Sget_simple_extent_dims(space, size.data(), nullptr) < 0 ||
        size[0] == 0 || size[1] == 0)
      return;
    if (is_number(type))
      numbers(set, name, rank, size[0], size[1]);
    else if (rank == 1 && H5Tget_class(type) == H5T_COMPOUND)
      members(set, type, name, size[0]);
  }

  void numbers(hid_t set, const std::string& name, int rank, hsize_t rows, hsize_t width) {
    if (!room_for(rows, width)) return;
    std::vector<double> all(rows * width);
    if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) < 0) {
      unreadable_ = true;
      return;
    }
    if (rank == 1) {
      columns_.push_back({name, std::move(all)});
      return;
    }
    const std::vector<std::string> names = names_of(set, width);
    for (hsize_t j = 0; j < width; ++j) {
      Hdf5Column& column = columns_.emplace_back();
      column.name =
          names.empty() ? fmt::format("{}[{}]", name, j) : fmt::format("{}.{}", name, names[j]);
      column.value.resize(rows);
      for (hsize_t i = 0; i < rows; ++i) column.value[i] = all[i * width + j];
    }
  }

  void members(hid_t set, hid_t type, const std::string& name, hsize_t rows) {
    const int count = H5Tget_nmembers(type);
    for (int m = 0; m < count; ++m) {
      const auto index = static_cast<unsigned>(m);
      const Handle member(H5Tget_member_type(type, index));
      if (!is_number(member) || !room_for(rows, 1)) continue;
      char* text = H5Tget_member_name(type, index);
      if (text == nullptr) continue;
      Handle one(H5Tcreate(H5T_COMPOUND, sizeof(double)));
      H5Tinsert(one, text, 0, H5T_NATIVE_DOUBLE);
      Hdf5Column& column = columns_.emplace_back();
      column.name = fmt::format("{}.{}", name, text);
      H5free_memory(text);
      column.value.resize(rows);
      if (H5Dread(set, one, H5S_ALL, H5S_ALL, H5P_DEFAULT, column.value.data()) < 0)
        unreadable_ = true;
    }
  }

  std::filesystem::path path_;
  std::vector<Hdf5Column> columns_;
  hsize_t most_values_, values_ = 0;
  bool too_large_ = false, unreadable_ = false;
};

}  // namespace

bool looks_like_hdf5(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;  // a pipe would be waited for
  constexpr std::array<char, 8> kSignature{'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
  std::ifstream in(path, std::ios::binary);
  std::array<char, 8> begin{};
  // A user block of 512, 1024, ... bytes may come first (MATLAB writes one).
  for (std::streamoff at = 0; at <= 1 << 20; at = at == 0 ? 512 : 2 * at) {
    in.seekg(at);
    if (!in.read(begin.data(), begin.size())) return false;
    if (begin == kSignature) return true;
  }
  return false;
}

std::vector<Hdf5Column> read_hdf5_columns(const std::filesystem::path& path) {
  const Seal seal = seal_of(path);
  if (seal == Seal::broken)
    throw RecordingError(path.string() + ": was changed after it was closed, or is damaged");
  if (seal == Seal::none)
    try_in_child(path, "is damaged and cannot be opened", [&] { ColumnReader(path).read(); });
  return ColumnReader(path).read();
}

}  // namespace vcnc
