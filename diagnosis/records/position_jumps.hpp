// What no axis does between two samples: positions that wrap, that are zero for a while, or that
// stay while they should move.
//
// A jump is a step of ten times those before and after it:
//   wraps    of 0.8 of the span, after which it goes on in the direction that it had before
//   zeros    of a twentieth of the span, to exactly zero, and as far back to the same side
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace vcnc {

struct PositionJump {
  std::size_t row = 0, rows = 0;  ///< the first beyond the jump; how many are zero, 0: it wraps
  double from = 0, to = 0;
};

/// The first one of a column of positions; nothing: it has none.
std::optional<PositionJump> position_jump(const std::vector<double>& value);

/// The first sample from which on a value stays to the last bit while another one goes `far`.
std::optional<std::size_t> stays_while(const std::vector<double>& value,
                                       const std::vector<double>& other, double far);

}  // namespace vcnc
