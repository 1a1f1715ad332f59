// Lengths and diameters of tools, and the file LinuxCNC keeps them in.
//
//   T1 P1 Z+120.5 D6.0 ; comment       one tool per line: number, pocket, offsets X Y Z A C,
//                                      diameter
//
// Lengths in the file are in one unit, that of the machine it was made for.
// Source: LinuxCNC user manual, "Tool table format".
#pragma once

#include <map>
#include <string>

#include "controller/gcode_blocks.hpp"

namespace vcnc {

struct ToolEntry {
  Coordinates offset = Coordinates::Zero();  ///< [m, rad]; z is the length
  double diameter = 0;                       ///< [m]
  friend bool operator==(const ToolEntry&, const ToolEntry&) = default;
};

class ToolTable {
 public:
  static constexpr int kLast = 99'999;

  ToolTable() = default;
  /// The tools of a machine file: H1, H2, ... of setup.tool_length_mm with the diameters of
  /// setup.tool_diameter_mm, otherwise the probe as H1 and its ball as D1.
  explicit ToolTable(const Machine& machine);

  /// Reads a LinuxCNC tool table. `length_unit` [m] of its numbers. Throws ProgramError.
  static ToolTable read(const std::string& path, double length_unit);

  /// Null where there is none.
  const ToolEntry* find(int number) const;
  ToolEntry& entry(int number) { return tools_[number]; }
  const std::map<int, ToolEntry>& all() const { return tools_; }
  /// As a file that read() takes.
  std::string to_text(double length_unit) const;
  std::string known() const;  ///< "T0 to T3", for messages

 private:
  std::map<int, ToolEntry> tools_;
};

}  // namespace vcnc
