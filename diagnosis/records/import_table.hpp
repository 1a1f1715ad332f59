// A table of a real machine and its map (configs/import_map.hpp) become a record.
//
// Values go to SI and on a uniform grid; samples that are missing stay missing (NaN). Two positions
// of one axis become position and twist = load - motor; position is the one that the declared loop
// is closed with (axes.X.feedback), and the motor's where there is no command. Whatever is odd
// about the table is told in the record's warnings or refused (time_base.hpp, record_check.hpp).
#pragma once

#include <string>

#include "configs/import_map.hpp"
#include "diagnosis/records/measured_table.hpp"
#include "diagnosis/records/record.hpp"

namespace vcnc {

/// `map_name` is for messages; `declared` may be null. Throws MeasurementError, ConfigError.
Record import_table(const MeasuredTable& table, const ImportMap& map, const std::string& map_name,
                    const Machine* declared);

/// From the files; the record holds the machine that the map names. It is checked against the one
/// of the file `model` where there is one.
Record import_files(const std::string& table, const std::string& map,
                    const std::string& model = "");

/// One line per signal and stretch: what was read.
std::string describe(const Record& record);

}  // namespace vcnc
