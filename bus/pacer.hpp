// The only object that reads a wall clock or sleeps.
//
// Free-running, the machine goes as fast as the host can. Paced, cycle k begins no earlier than
// start + k * cycle / speed (absolute deadlines, so errors do not add up). A cycle that begins more
// than a tenth of a period late is counted as an overrun; nothing is skipped, the machine just
// catches up. Pacing never changes a result.
#pragma once

#include <cstdint>

#include "bus/tick.hpp"

namespace vcnc {

class Pacer {
 public:
  /// `speed` times real time; 0: free-running. Throws std::invalid_argument if negative or not
  /// finite.
  explicit Pacer(double speed = 0);

  /// Waits until cycle k may begin. The first call sets the start of the time scale.
  void wait(Tick k);

  bool paced() const { return period_ns_ > 0; }
  std::uint64_t overruns() const { return overruns_; }

  /// Host seconds since the pacer was made. Only for time-outs and reports, never for a result.
  double elapsed() const;

 private:
  std::int64_t period_ns_ = 0;  ///< of one cycle; 0: free-running
  std::int64_t made_ns_ = 0;
  std::int64_t start_ns_ = 0;  ///< host time of tick 0
  bool started_ = false;
  std::uint64_t overruns_ = 0;
};

}  // namespace vcnc
