#include "controller/limit_use.hpp"

#include <algorithm>
#include <cmath>

#include "bus/tick.hpp"

namespace vcnc {

LimitUse::LimitUse(const Machine& machine, const AxisVector& start) {
  for (std::size_t i = 0; i < kAxisCount; ++i) limits_[i] = machine.axes[i].limits;
  last_.fill(start);
}

void LimitUse::add(const AxisVector& q) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double d1 = q[i] - last_[0][i];
    const double d2 = d1 - (last_[0][i] - last_[1][i]);
    const double d3 = d2 - (last_[0][i] - 2 * last_[1][i] + last_[2][i]);
    const std::array<double, 3> shares{std::abs(d1) / kCycle / limits_[i].velocity,
                                       std::abs(d2) / (kCycle * kCycle) / limits_[i].acceleration,
                                       std::abs(d3) / (kCycle * kCycle * kCycle) / limits_[i].jerk};
    for (std::size_t k = 0; k < shares.size(); ++k)
      worst_[i][k] = std::max(worst_[i][k], shares[k]);
  }
  std::rotate(last_.begin(), last_.end() - 1, last_.end());
  last_[0] = q;
}

double LimitUse::largest(int order) const {
  double result = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i) result = std::max(result, share(i, order));
  return result;
}

}  // namespace vcnc
