// What programs change at the control and what survives its being switched off: offsets,
// references, parameters, tools.
//
// Only what differs from the machine file is held, so that a value nobody has changed follows the
// file. Numbers are those of the parameters (interpreter_parameters.cpp), axes as LinuxCNC counts
// them, offsets and references in m and rad:
//   #31 .. #5000      of NGC programs          #500 .. #999   of macros
//   #5161.., #5181..  G28, G30                 #5210..        G92, #5210: it is active
//   #5221 .. #5390    work offsets             #7001 .. #7960   G54.1 P1 .. P48, X Y Z A C each
// As bytes: 1 version (2), twice 4 count, count x (2 number, 8 value), 4 count, count x (4 tool,
// 5 x 8 offset, 8 diameter); then 4 count, count x (4 line, 1 touched, 8 at, 15 x 8 target, found,
// rest). Version 1 ends before the touches.
// Source: LinuxCNC user manual, "Parameters"; Fanuc series 30i, custom macro.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/gcode/probe_touch.hpp"
#include "controller/gcode/tool_table.hpp"

namespace vcnc {

struct NcData {
  static constexpr std::size_t kMostTools = 1000;
  static constexpr int kFirstFurther = 7001, kFurther = 48, kPerSystem = 20;
  static constexpr bool is_further_offset(int number) {
    return number >= kFirstFurther && number < kFirstFurther + kFurther * kPerSystem;
  }

  std::map<int, double> parameters;
  std::map<int, ToolEntry> tools;

  /// 1 for a plain number, mm or degrees in SI for an offset.
  static double unit_of(int number);
  friend bool operator==(const NcData&, const NcData&) = default;
};

/// The parameters that a program keeps; first and last number.
struct KeptParameters {
  int first = 31, last = 5000;
};
constexpr KeptParameters kept_parameters(bool macros) {
  return macros ? KeptParameters{500, 999} : KeptParameters{};
}

/// What a memory holds: the data as they were when the last program began, which is what it goes on
/// with after an interruption, and as they are; and what the program has probed.
struct KeptNcData {
  NcData begin, now;
  std::vector<ProbeTouch> touches{};
};
std::vector<std::uint8_t> encode_nc_data(const KeptNcData& data);
/// Nothing for bytes that are none.
std::optional<KeptNcData> decode_nc_data(std::span<const std::uint8_t> bytes);

/// For people: work offsets, tools, how many parameters.
std::string to_text(const NcData& data);
/// As LinuxCNC's parameter file: "5221\t12.5" lines, mm and degrees.
std::string to_var_file(const NcData& data);

}  // namespace vcnc
