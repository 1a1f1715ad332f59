#include "diagnosis/records/position_jumps.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

namespace {

constexpr double kTimesNeighbours = 10;
constexpr double kOfSpanWraps = 0.8, kOfSpanZeros = 0.05;

struct LowAndHigh {
  double low = HUGE_VAL, high = -HUGE_VAL;
  void take(double v) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  double span() const { return high >= low ? high - low : 0; }
};

bool goes_on(double before, double jump, double after) {
  return before * jump < 0 && after * jump < 0 &&
         std::abs(jump) > kTimesNeighbours * std::max(std::abs(before), std::abs(after));
}

}  // namespace

std::optional<PositionJump> position_jump(const std::vector<double>& x) {
  LowAndHigh all;
  for (const double v : x) all.take(v);
  const double span = all.span();
  for (std::size_t k = 2; k + 1 < x.size(); ++k) {
    const double jump = x[k] - x[k - 1], before = x[k - 1] - x[k - 2];
    if (!(std::abs(jump) > kOfSpanZeros * span)) continue;
    if (std::abs(jump) > kOfSpanWraps * span && goes_on(before, jump, x[k + 1] - x[k]))
      return PositionJump{k, 0, x[k - 1], x[k]};
    if (x[k] != 0 || !(std::abs(jump) > kTimesNeighbours * std::abs(before))) continue;
    std::size_t end = k;
    while (end < x.size() && x[end] == 0) ++end;
    if (end < k + 2 || end + 1 >= x.size()) continue;
    const double back = x[end], after = x[end + 1] - back;
    if (back * x[k - 1] > 0 && std::abs(back) > kOfSpanZeros * span &&
        std::abs(back) > kTimesNeighbours * std::abs(after))
      return PositionJump{k, end - k, x[k - 1], 0};
  }
  return std::nullopt;
}

std::optional<std::size_t> stays_while(const std::vector<double>& value,
                                       const std::vector<double>& other, double far) {
  std::size_t begin = 0;
  LowAndHigh gone;
  for (std::size_t k = 0; k < value.size(); ++k) {
    if (k == 0 || value[k] != value[k - 1]) begin = k, gone = {};
    gone.take(other[k]);
    if (gone.span() > far) return begin;
  }
  return std::nullopt;
}

}  // namespace vcnc
