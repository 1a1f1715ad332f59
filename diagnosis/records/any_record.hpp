// A measured run, however it lies on the disk.
#pragma once

#include <optional>
#include <string>

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// The folder of a run, its recording, a record of `vcnc import`, or, with a map, a table, which is
/// checked against the machine file `model`, else the one that its map names. Throws InputError
/// naming the file and what is wrong with it.
Record load_record(const std::string& path, const std::string& map = "",
                   const std::string& model = "");

/// The machine file, or, without one, what the record says it was measured on. Throws
/// MeasurementError where the record says neither, or that its machine carries its rotary axes
/// elsewhere than that of the file.
Machine declared_machine(const std::string& model, const Record& record);

/// Throws MeasurementError where both runs say on which machine they were made and these have other
/// kinematics.
void check_same_kinematics(const Record& run, const Record& other);

/// The piece of a machine: the record's own, else the file that the machine names.
std::optional<PieceParams> piece_of(const Machine& machine, const Record& record);

}  // namespace vcnc
