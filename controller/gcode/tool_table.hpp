// Lengths and diameters of tools, and the file LinuxCNC keeps them in.
//
//   T1 P1 Z+120.5 D6.0 ; comment       one tool per line: number, pocket, offsets, diameter
//
// Lengths in the file are in one unit, that of the machine it was made for.
// Source: LinuxCNC user manual, "Tool table format".
#pragma once

#include <map>
#include <string>

#include "model/machine.hpp"

namespace vcnc {

struct ToolEntry {
  Vec3 offset = Vec3::Zero();  ///< [m]; z is the length
  double diameter = 0;         ///< [m]
};

class ToolTable {
 public:
  static constexpr int kLast = 99'999;

  ToolTable() = default;
  /// The tools of a machine file: H1, H2, ... of setup.tool_length_mm, otherwise the probe as H1.
  explicit ToolTable(const Machine& machine);

  /// Reads a LinuxCNC tool table. `length_unit` [m] of its numbers. Throws ProgramError.
  static ToolTable read(const std::string& path, double length_unit);

  /// Null where there is none.
  const ToolEntry* find(int number) const;
  ToolEntry& entry(int number) { return tools_[number]; }
  std::string known() const;  ///< "T0 to T3", for messages

 private:
  std::map<int, ToolEntry> tools_;
};

}  // namespace vcnc
