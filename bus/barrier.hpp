// Waits until every module of a frozen roster has answered, and names those that have not.
#pragma once

#include <atomic>
#include <bitset>
#include <stdexcept>
#include <string>
#include <vector>

#include "bus/frame.hpp"
#include "bus/messages.hpp"
#include "bus/transport.hpp"

namespace vcnc {

/// The modules the master waits for.
struct RosterEntry {
  int id = 0;  ///< 1..127
  std::string name;
};
using Roster = std::vector<RosterEntry>;

/// A node that is missing, gone or out of step: one sentence naming it.
class BarrierError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Barrier {
 public:
  /// Throws std::invalid_argument for an empty roster or an id that is out of range or used twice.
  Barrier(Transport& bus, const Roster& roster, const std::atomic<bool>* stop = nullptr);

  /// Appends all frames of cycle k to `answers`; returns when each node's cyclic frame (COB-ID
  /// 180h + id, sent as its last) is there. False if `stop` was set meanwhile. Throws BarrierError
  /// if a node stays silent for timeout_ms, answers twice, restarts or leaves.
  bool collect(Tick k, Frames& answers, int timeout_ms);

  /// Start-up: takes what arrives within timeout_ms and notes the nodes whose heartbeat shows this
  /// state; other frames are dropped. Throws BarrierError if the bus is closed or a node leaves it.
  Transport::Received hear(NmtState state, int timeout_ms);
  void forget() { arrived_.reset(); }
  /// Whether every node of the roster has arrived since forget().
  bool complete() const { return (arrived_ & expected_) == expected_; }

  /// Names of those that have not arrived: "drive A, probe".
  std::string missing() const;

 private:
  using Ids = std::bitset<128>;
  void note(Tick k, const Frame& frame);
  const std::string& name(int id) const;

  Transport& bus_;
  const Roster roster_;
  const std::atomic<bool>* stop_;
  Ids expected_, arrived_;
  Frames scratch_;
};

}  // namespace vcnc
