// The columns of a table that the keys of its map name.
#pragma once

#include <string>
#include <string_view>

#include "configs/import_map.hpp"
#include "diagnosis/records/measured_table.hpp"

namespace vcnc {

class MapColumns {
 public:
  /// `map_name` is for messages. All are kept by reference.
  MapColumns(const MeasuredTable& table, const ImportMap& map, const std::string& map_name)
      : table_(table), map_(map), map_name_(map_name) {}

  const MeasuredTable& table() const { return table_; }
  const ImportMap& map() const { return map_; }

  /// By its number from 1 where that is not 0, else by its heading. Throws ConfigError where the
  /// table has it not, or twice, MeasurementError where it holds something that is no number.
  const MeasuredColumn& find(const std::string& name, int number, const KeyLines& lines,
                             const std::string& path, std::string_view key) const;

  /// Throws ConfigError naming a key of the map and its line.
  [[noreturn]] void refuse(const KeyLines& lines, const std::string& path, std::string_view key,
                           const std::string& reason) const;

 private:
  const MeasuredColumn& usable(const MeasuredColumn& column) const;
  std::string suggestion(const std::string& name) const;

  const MeasuredTable& table_;
  const ImportMap& map_;
  const std::string& map_name_;
};

}  // namespace vcnc
