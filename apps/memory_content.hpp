// What a machine's memory holds.
#pragma once

#include <optional>
#include <string>

#include "apps/memory_folder.hpp"
#include "controller/gcode/nc_data.hpp"
#include "controller/nc_record.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {

struct MemoryContent {
  std::optional<NcRecord> nc;  ///< nothing: no program has run
  NcData data;                 ///< what programs have changed at the control
  bool spindle_locked = false;
  ProtectionLatch overtravel;
};

/// Throws MemoryError naming the files.
MemoryContent read_content(const MemoryFolder& folder);

/// Some lines for people.
std::string to_text(const MemoryContent& content);

}  // namespace vcnc
