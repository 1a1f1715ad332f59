// Waits until every module of the roster has answered, and names those that do not.
//
// A module that leaves, restarts, leaves operation, answers twice or stays silent is lost: it is
// never waited for again and what it says from then on is dropped and counted. The others go on.
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
  bool token = false;  ///< ends its answers by a token: has faults in simulated time
  /// What it must be (objects 1000h and 1018h); product code 0: not asked.
  std::uint32_t device_type = 0, product_code = 0;
};
using Roster = std::vector<RosterEntry>;

/// A module that takes part no more.
struct LostNode {
  int id = 0;
  std::string name;
  Tick cycle = 0;   ///< the first without it
  std::string why;  ///< one sentence that names it
};

/// The bus is gone, or a node is missing at the start: one sentence.
class BarrierError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Barrier {
 public:
  /// Throws std::invalid_argument for an empty roster or an id that is out of range or used twice.
  Barrier(Transport& bus, const Roster& roster, const std::atomic<bool>* stop = nullptr);

  /// Appends all frames of cycle k to `answers`; returns when each node's cyclic frame (COB-ID
  /// 180h + id, sent as its last) or token is there or the node is lost. False if `stop` was set
  /// meanwhile. Throws BarrierError if the bus is closed.
  bool collect(Tick k, Frames& answers, int timeout_ms);

  const std::vector<LostNode>& lost() const { return lost_; }
  std::uint64_t late_frames() const { return late_frames_; }  ///< of lost nodes
  /// Bus time that destroyed frames took in the cycle collected last [ns].
  std::int64_t wasted_ns() const { return wasted_ns_; }

  /// Start-up: takes what arrives within timeout_ms and notes the nodes whose heartbeat shows this
  /// state; other frames are dropped. Throws BarrierError if the bus is closed or a node leaves it.
  Transport::Received hear(NmtState state, int timeout_ms);
  void forget() { arrived_.reset(); }
  /// Whether every node of the roster that is not lost has arrived since forget().
  bool complete() const { return (arrived_ & expected_) == expected_; }

  /// Names of those that have not arrived: "drive A, probe".
  std::string missing() const;

 private:
  using Ids = std::bitset<128>;
  bool note(Tick k, const Frame& frame);
  void lose(Tick k, std::size_t id, const std::string& why);
  const std::string& name(int id) const;

  Transport& bus_;
  const Roster roster_;
  const std::atomic<bool>* stop_;
  Ids expected_, arrived_, gone_, tokens_;
  std::vector<LostNode> lost_;
  std::uint64_t late_frames_ = 0;
  std::int64_t wasted_ns_ = 0;
  Frames scratch_;
};

}  // namespace vcnc
