// Faults of simulated kinds from a seed.
//
// Fault number i of a seed is a pure function of (seed, i). Node and kind go through all that there
// are, in order, so that any run of as many faults as pairs() has every kind at every node once;
// drawn are the moment, the duration (half of them last to the end, the others 1 .. 50 cycles,
// logarithmic) and the keys of the kind.
#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "bus/fault.hpp"

namespace vcnc {

class FaultDraw {
 public:
  explicit FaultDraw(std::uint64_t seed) : seed_(seed) {}

  /// Every simulated kind with every node it may befall.
  static const std::vector<std::pair<std::string_view, BusFault::Kind>>& pairs();

  /// Node and kind number `number` of all, in turn.
  BusFault in_turn(std::uint64_t number, Tick first, Tick last) const;
  /// Node and kind drawn too.
  BusFault any(std::uint64_t number, Tick first, Tick last) const;

 private:
  std::uint64_t seed_;
};

}  // namespace vcnc
