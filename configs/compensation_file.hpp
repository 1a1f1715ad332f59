// Files of compensation points: lines of three numbers, nominal, forward, reverse, in mm or deg,
// separated by blanks, tabs, commas or semicolons; empty lines and what follows # are passed over.
// It is the format of LinuxCNC's COMP_FILE: type 0 (actual) holds positions as they were measured,
// type 1 (trim) nominal less measured positions.
#pragma once

#include <string>
#include <string_view>

#include "model/compensation.hpp"

namespace vcnc {

/// Fills points and errors of `table` from the text of its file; `name` stands for it in messages.
/// Throws ConfigError naming the line.
void parse_compensation_points(std::string_view text, const std::string& name,
                               CompensationTable& table);

}  // namespace vcnc
