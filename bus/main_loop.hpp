// The main loop of the machine: every cycle, in this order,
//
//   wait      the pacer says when cycle k may begin (free-running: at once)
//   sync      SYNC(k) goes out: every node now takes the frames of cycle k-1 and steps to t_k+1
//   collect   the barrier: every node of the roster has answered, or is lost by name
//   step      the master takes the answers and decides about cycle k+1
//   command   its frames go out; they act in cycle k+1
//   log       the frames of cycle k by identifier: trace hash, bus load, taps
//
// Before that, start-up: NMT "reset communication" every 200 ms until every node of the roster has
// sent its boot-up message; then each is asked by SDO what it is (1000h, 1018h), and a wrong one is
// refused by name; then NMT "start" until every node says that it is operational. Whatever a node
// sent before lies in front of that answer, so cycle 0 begins with an empty bus. The roster is then
// frozen: a node that restarts, answers twice, leaves or stays silent is lost. The master is told,
// the cycle goes on without it until the master has brought the machine to rest, for
// degraded_cycles at most, and the run has failed. After the last cycle, whatever the reason, NMT
// "stop".
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bus/barrier.hpp"
#include "bus/frame_time.hpp"
#include "bus/node.hpp"
#include "bus/pacer.hpp"
#include "bus/transport.hpp"

namespace vcnc {

/// Sees every cycle's frames in order of their identifiers (logs, gateways).
class FrameTap {
 public:
  virtual ~FrameTap() = default;
  virtual void cycle(Tick k, std::span<const Frame> frames) = 0;
};

struct MainLoopOptions {
  Pacer& pacer;
  BitRates rates{};
  int answer_timeout_ms = 5000;
  int start_timeout_ms = 15000;
  Tick degraded_cycles = 10000;  ///< at most so many after the first node was lost
  std::vector<FrameTap*> taps{};
  const std::atomic<bool>* stop = nullptr;  ///< set from outside (Ctrl-C): ends after this cycle
};

struct MainLoopResult {
  Tick cycles = 0;            ///< complete cycles
  std::string trace_hash;     ///< over every frame of every complete cycle
  double bus_load_worst = 0;  ///< largest share of a cycle the bus was busy
  bool complete = false;      ///< the master said that the run is over, with no node lost
  std::string failure;        ///< why not; names the node
  std::vector<LostNode> lost_nodes;
  std::uint64_t late_frames = 0;  ///< that lost nodes sent afterwards
  std::uint64_t lost = 0;         ///< frames the host dropped on the way to the master
};

/// Runs until the master is done, the bus fails or `stop` is set. Failures of the bus and of nodes
/// are in the result; exceptions of the master pass through after NMT "stop".
MainLoopResult run_main_loop(Master& master, Transport& bus, const Roster& roster,
                             const MainLoopOptions& options);

}  // namespace vcnc
