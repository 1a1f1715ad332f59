// What share of its limits every axis uses, from its positions at the bus cycle:
//   v = Delta q / T,   a = Delta^2 q / T^2,   j = Delta^3 q / T^3,   T = kCycle
// The axes rest before the first position.
#pragma once

#include <array>

#include "model/axes.hpp"
#include "model/machine.hpp"

namespace vcnc {

class LimitUse {
 public:
  LimitUse(const Machine& machine, const AxisVector& start);

  void add(const AxisVector& q);  ///< the position one cycle later

  /// Largest so far of one axis; order 1 velocity, 2 acceleration, 3 jerk.
  double share(std::size_t axis, int order) const {
    return worst_[axis][static_cast<std::size_t>(order - 1)];
  }
  double largest(int order) const;  ///< of all axes

 private:
  std::array<AxisLimits, kAxisCount> limits_;
  std::array<AxisVector, 3> last_;  ///< newest first
  std::array<std::array<double, 3>, kAxisCount> worst_{};
};

}  // namespace vcnc
