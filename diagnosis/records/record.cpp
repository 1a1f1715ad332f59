#include "diagnosis/records/record.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

bool moves(const Record& record, std::size_t axis) {
  constexpr double kMoves = 1e-6;  // [m or rad]
  const MeasuredSignal* motion = record.find(SignalKind::command, axis);
  if (!motion) motion = record.find(SignalKind::position, axis);
  if (!motion) return false;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double q : motion->value)
    if (std::isfinite(q)) low = std::min(low, q), high = std::max(high, q);
  return high - low > kMoves;
}

}  // namespace vcnc
