// A measured run, however it lies on the disk.
#pragma once

#include <optional>
#include <string>

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// The folder of a run, its recording, a record of `vcnc import`, or, with a map, a table. Throws
/// InputError naming the file and what is wrong with it.
Record load_record(const std::string& path, const std::string& map = "");

/// The machine file, or, without one, what the record says it was measured on.
Machine declared_machine(const std::string& model, const Record& record);

/// The piece of a machine: the record's own, else the file that the machine names.
std::optional<PieceParams> piece_of(const Machine& machine, const Record& record);

}  // namespace vcnc
