// The columns of numbers in an HDF5 file of any origin.
//
//   a data set of one dimension           a column, named by its path: "drive/x/position"
//   ... whose type is compound            a column per number in it: "log.position"
//   a data set of two dimensions          a column per second index: "rows[0]", "rows[1]", ...;
//                                         with an attribute `names`, `channels` or `columns`
//                                         (texts, one per column): "rows.q_act.X"
// Everything else is left out. Values as they are stored, as double.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vcnc {

struct Hdf5Column {
  std::string name;
  std::vector<double> value;
};

/// By its first bytes.
bool looks_like_hdf5(const std::filesystem::path& path);

/// In order of the paths. A file without a seal (analysis/seal.hpp) is read in a child process
/// first. Throws RecordingError.
std::vector<Hdf5Column> read_hdf5_columns(const std::filesystem::path& path);

}  // namespace vcnc
