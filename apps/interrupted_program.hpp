// Whether a program may start or go on with what the NC unit has kept.
#pragma once

#include <optional>
#include <string>

#include "bus/node_memory.hpp"
#include "controller/gcode/nc_data.hpp"
#include "controller/nc_record.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// A record of nothing but which program this is, on which machine: the path, and the hashes of
/// what the program file, with where it begins and what it skips, and the machine with its piece
/// say. Throws InputError.
NcRecord identity_of(const Machine& machine, const std::string& piece_toml,
                     const std::string& program, const PlayerOptions& options = {});

/// What the memory holds of offsets, parameters and tools; nothing was ever saved: nothing. Throws
/// MemoryError.
KeptNcData load_nc_data(NodeMemory& memory);

/// Throws InputError: nothing to resume, or another program or machine than was interrupted.
void check_resume(const std::optional<NcRecord>& kept, const NcRecord& now,
                  const std::string& memory);
/// Throws InputError while an interrupted program waits for its resumption.
void check_fresh(const std::optional<NcRecord>& kept, const std::string& memory);

}  // namespace vcnc
