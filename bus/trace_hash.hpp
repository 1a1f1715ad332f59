// One number for a whole run: XXH3 (128 bit) over every frame of every cycle.
//
// Two runs with the same hash have exchanged the same bytes in the same cycles. Hashed are, per
// cycle, the tick and each frame's identifier, length, kind and payload, in order of the
// identifiers.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bus/frame.hpp"
#include "bus/tick.hpp"

struct XXH3_state_s;

namespace vcnc {

class TraceHash {
 public:
  TraceHash();
  /// Frames of cycle k, sorted by identifier.
  void add(Tick k, std::span<const Frame> frames);
  /// 32 hexadecimal digits over everything added so far.
  std::string hex() const;

 private:
  struct Free {
    void operator()(XXH3_state_s* state) const;
  };
  std::unique_ptr<XXH3_state_s, Free> state_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace vcnc
