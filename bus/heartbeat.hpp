// Heartbeats (CiA 301, 7.2.8.2.2): each node says in fixed intervals in which state it is, and
// whoever depends on it notices when it does not.
//
// A producer with period P speaks in the cycles k with k mod P = (id mod 16) P div 16, so that no
// two of the ids 1..8 and 127 speak in one cycle when P is 16 or more. A consumer begins to watch
// with the first heartbeat it hears; more than its time without one means that the node is lost,
// until the next. By default that time is three periods.
#pragma once

#include <cmath>
#include <optional>

#include "bus/messages.hpp"

namespace vcnc {

inline constexpr Tick kHeartbeatPatience = 3;  ///< consumer time in periods of the producer

constexpr bool heartbeat_due(Tick k, int id, Tick period) {
  return period > 0 && k % period == (id % 16) * period / 16;
}

inline Tick heartbeat_cycles(double period_s) {
  return static_cast<Tick>(std::llround(period_s / kCycle));
}

/// One watched node.
class HeartbeatWatch {
 public:
  enum class Event { none, lost, back };

  HeartbeatWatch() = default;
  explicit HeartbeatWatch(Tick time) : time_(time) {}

  Tick time() const { return time_; }
  void set_time(Tick time) {
    time_ = time;
    last_.reset();
    lost_ = false;
  }
  void heard(NmtState state, Tick k) {
    last_ = k;
    state_ = state;
  }
  /// Once in each cycle, after what has been heard in it.
  Event check(Tick k) {
    const bool lost = time_ > 0 && last_ && k - *last_ > time_;
    if (lost == lost_) return Event::none;
    lost_ = lost;
    return lost ? Event::lost : Event::back;
  }
  bool lost() const { return lost_; }
  NmtState state() const { return state_; }  ///< last heard

 private:
  Tick time_ = 0;
  std::optional<Tick> last_;
  NmtState state_ = NmtState::operational;
  bool lost_ = false;
};

}  // namespace vcnc
