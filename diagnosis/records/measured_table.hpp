// Tables of measured numbers as they come from real machines: text with one line per sample, or
// HDF5.
//
// Text: values between commas, semicolons, tabs or spaces, quoted or not; lines that begin with #
// or % are remarks; a first line "sep=;", as spreadsheets write it, tells the separator; the first
// other line may hold headings (or the last remark before it, as numpy writes them), the second may
// hold units, which are kept beside the names. Numbers have a decimal point, or a comma where that
// is said. An empty value, nan, NA, N/A or null is missing. A value that is no number makes its
// column unusable, not the table: there may be columns of text beside the measured ones. HDF5: see
// analysis/hdf5_columns.hpp.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "configs/import_map.hpp"
#include "model/input_error.hpp"

namespace vcnc {

/// A table or what it holds cannot be used: one sentence with file and line or column.
class MeasurementError : public InputError {
 public:
  using InputError::InputError;
};

struct MeasuredColumn {
  std::string name;           ///< heading; its number where there is none
  std::string unit = {};      ///< as a row of units below the headings has it; empty: none told
  std::vector<double> value;  ///< NaN: missing
  std::size_t bad_line = 0;   ///< first line with something that is no number; 0: none
  std::string bad_text = {};
};

struct MeasuredTable {
  std::string source;                   ///< file
  std::vector<MeasuredColumn> columns;  ///< of one length in a text table
  std::vector<std::size_t> line;        ///< of each row; empty: rows have none

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().value.size(); }
  /// "run.csv:17" of a row.
  std::string place(std::size_t row) const;
};

struct TextFormat {
  ImportMap::Separator separator = ImportMap::Separator::any;
  ImportMap::Decimal decimal = ImportMap::Decimal::point;
  std::vector<std::string> missing = {};  ///< further values that mean there is none
};

MeasuredTable parse_text_table(std::string_view text, const std::string& name,
                               const TextFormat& format = {});

/// A file of either kind. Throws MeasurementError.
MeasuredTable read_measured_table(const std::string& path, const TextFormat& format = {});

}  // namespace vcnc
