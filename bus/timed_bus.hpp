// One cycle on the wire: who gets the bus when.
//
// Arbitration: whenever the bus falls idle, of all frames that are ready the one with the lowest
// identifier is sent; a frame once begun is not interrupted. A frame that becomes ready while the
// bus is busy waits for the next idle moment.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bus/frame_time.hpp"

namespace vcnc {

class TimedBus {
 public:
  struct Request {
    std::uint16_t id = 0;
    std::int64_t ready_ns = 0;  ///< since the start of the cycle
    std::int64_t duration_ns = 0;
  };
  struct Slot {
    std::int64_t start_ns = 0, end_ns = 0;
  };

  /// When each request starts and ends, in the order given. Valid until the next call.
  std::span<const Slot> arbitrate(std::span<const Request> requests);

 private:
  std::vector<Slot> slots_;
  std::vector<char> sent_;
};

/// Share of a bus cycle that these frames keep the bus busy, with their actual stuff bits.
double bus_load(std::span<const Frame> frames, const BitRates& rates);

}  // namespace vcnc
