// The five interpolated axes, and arrays indexed by them.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace vcnc {

inline constexpr std::size_t kAxisCount = 5;
inline constexpr std::array<std::string_view, kAxisCount> kAxisNames{"X", "Y", "Z", "A", "C"};
enum Axis : std::size_t { kX = 0, kY = 1, kZ = 2, kA = 3, kC = 4 };

/// kAxisCount: none has that name.
constexpr std::size_t axis_named(std::string_view name) {
  std::size_t axis = 0;
  while (axis < kAxisCount && kAxisNames[axis] != name) ++axis;
  return axis;
}

/// X, Y, Z are linear (SI unit m); A, C are rotary (SI unit rad).
constexpr bool is_rotary(std::size_t axis) { return axis >= kA; }

template <class T>
using PerAxis = std::array<T, kAxisCount>;

/// The two directions across linear axis `axis`, in the order X, Y, Z: of X these are Y and Z.
struct Sideways {
  int first, second;
};
constexpr Sideways sideways(std::size_t axis) { return {axis == kX ? 1 : 0, axis == kZ ? 1 : 2}; }

/// Positions [m, m, m, rad, rad] or their time derivatives.
using AxisVector = PerAxis<double>;

}  // namespace vcnc
