// The slave's side of the protocol, without any I/O: frames in, frames out.
//
//   NMT reset    -> boot-up message (700h+id, 00); inputs are dropped
//   NMT start    -> heartbeat "operational" (05); the next SYNC is tick 0
//   NMT preop    -> heartbeat "pre-operational" (7F). Inputs and PDOs stop, time does not: with
//                   each SYNC the node is stepped, and its emergencies and heartbeats are sent
//   NMT stop     -> over() becomes true
//   SDO request  -> answered at once in pre-operational; in operation an input like others
//   SYNC(k)      -> the frames accepted since SYNC(k-1) are handed to Node::step in CAN-ID order;
//                   its answers follow, the cyclic frame (180h+id) last, so that whoever has
//                   received that one has received them all. A module with faults in simulated
//                   time may say less; a token (780h+id) ends its answer instead, which also
//                   tells the bus time that its destroyed frames took [ns, 32 bit]
//
// The SYNC counter 1..240 is unwrapped to a 64-bit tick. A SYNC that is missing or comes twice, a
// second cyclic frame of one sender in a cycle, and frames lost by the host are counted, and the
// first of each kind raises an EMCY with the answer: 8100h, or 8110h for frames the host lost
// (detail: 1 missed, 2 repeated, 3 double frame, 4 lost; then the count, 32 bit). More than
// kMostFrames between two SYNCs, far beyond what a bus can carry in a cycle, are not kept and count
// as lost.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>

#include "bus/messages.hpp"
#include "bus/node.hpp"

namespace vcnc {

class NodeShell {
 public:
  static constexpr std::size_t kMostFrames = 1024;

  /// The node outlives the shell. Throws std::invalid_argument for an id outside 1..127.
  explicit NodeShell(Node& node);

  /// One frame from the bus; what the node has to say to it is appended to `out`.
  void feed(const Frame& frame, Frames& out);

  /// The boot-up message, to be sent once when the module is switched on.
  void boot(Frames& out);

  /// Tells the shell how many frames the host has dropped so far.
  void note_lost(std::uint64_t total) { host_lost_ = total; }

  NmtState state() const { return state_; }
  bool over() const { return state_ == NmtState::stopped; }
  Tick next_tick() const { return next_tick_; }
  std::uint64_t missed_syncs() const { return fault_count_[kMissed]; }
  std::uint64_t repeated_syncs() const { return fault_count_[kRepeated]; }
  std::uint64_t double_frames() const { return fault_count_[kDouble]; }

 private:
  enum Fault : std::size_t { kMissed, kRepeated, kDouble, kLost, kFaults };

  void on_nmt(const Nmt& nmt, Frames& out);
  void on_sync(const Sync& sync, Frames& out);
  void stand_by(Frames& out);
  void report_faults(Frames& out);

  Node& node_;
  std::bitset<2048> accepted_;
  NmtState state_ = NmtState::boot_up;
  bool started_ = false;  ///< since the last reset
  Tick next_tick_ = 0;
  Frames arriving_;  ///< since the last SYNC
  Frames inputs_;    ///< of the cycle being stepped
  std::uint64_t host_lost_ = 0, surplus_ = 0;
  std::array<std::uint64_t, kFaults> fault_count_{};
  std::array<bool, kFaults> reported_{};
};

}  // namespace vcnc
