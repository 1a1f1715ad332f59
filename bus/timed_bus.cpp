#include "bus/timed_bus.hpp"

#include <algorithm>
#include <limits>

#include "bus/tick.hpp"

namespace vcnc {

std::span<const TimedBus::Slot> TimedBus::arbitrate(std::span<const Request> requests) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  slots_.assign(requests.size(), {});
  sent_.assign(requests.size(), 0);
  std::int64_t idle_ns = 0;
  for (std::size_t done = 0; done < requests.size(); ++done) {
    std::int64_t first_ready_ns = std::numeric_limits<std::int64_t>::max();
    for (std::size_t i = 0; i < requests.size(); ++i)
      if (!sent_[i]) first_ready_ns = std::min(first_ready_ns, requests[i].ready_ns);
    const std::int64_t start_ns = std::max(idle_ns, first_ready_ns);
    std::size_t winner = kNone;
    for (std::size_t i = 0; i < requests.size(); ++i)
      if (!sent_[i] && requests[i].ready_ns <= start_ns &&
          (winner == kNone || requests[i].id < requests[winner].id))
        winner = i;
    sent_[winner] = 1;
    idle_ns = start_ns + requests[winner].duration_ns;
    slots_[winner] = {start_ns, idle_ns};
  }
  return slots_;
}

double bus_load(std::span<const Frame> frames, const BitRates& rates) {
  double nominal = 0, data = 0;
  for (const Frame& frame : frames) {
    const FrameBits bits = exact_bits(frame);
    nominal += bits.nominal;
    data += bits.data;
  }
  return (nominal / rates.nominal + data / rates.data) / kCycle;
}

}  // namespace vcnc
