// Every G and M code with its modal group. Codes of one group exclude each other in a block.
#pragma once

#include <cstdint>
#include <string>

namespace vcnc {

enum class GGroup : std::uint8_t {
  unknown,
  once,          ///< acts in its block only: G4 G10 G28 G30 G52 G53 G65 G92 ...
  motion,        ///< G0 G1 G2 G3 G31 G33 G33.1 G38.n G73 G74 G76 G80 .. G89
  plane,         ///< G17 G18 G19
  distance,      ///< G90 G91
  arc_distance,  ///< G90.1 G91.1
  feed,          ///< G93 G94 G95
  units,         ///< G20 G21
  cutter,        ///< G40 G41 G42 G41.1 G42.1
  length,        ///< G43 G43.1 G43.2 G43.4 G43.5 G49
  retract,       ///< G98 G99
  offset,        ///< G54 .. G59.3 G54.1
  path,          ///< G61 G61.1 G64
  spindle,       ///< G96 G97
  rotation,      ///< G68 G68.2 G69
  macro,         ///< G66 G67
  diameter,      ///< G8
  polar,         ///< G15 G16
  scaling,       ///< G50 G51
  mirror,        ///< G50.1 G51.1
};
inline constexpr int kGGroups = 20;

enum class MGroup : std::uint8_t {
  unknown,
  stop,      ///< M0 M1 M2 M30 M60 M98 M99
  tool,      ///< M6 M61
  spindle,   ///< M3 M4 M5 M19
  mist,      ///< M7
  flood,     ///< M8 M9
  override,  ///< M48 M49 M50 .. M53
  output,    ///< M62 .. M68
  modes,     ///< M70 .. M73
};
inline constexpr int kMGroups = 9;

/// CIP of Siemens, under a number that no program can write.
inline constexpr int kCircleThroughPoint = 35;
/// CT of Siemens, the same way.
inline constexpr int kTangentialCircle = 36;

/// G codes are counted in tenths: G43.4 is 434.
GGroup g_group(int tenths);
MGroup m_group(int number);

std::string code_name(int tenths);  ///< "G43.4"

/// What a message about an unknown code lists.
extern const char* const kKnownG;
extern const char* const kKnownM;

}  // namespace vcnc
