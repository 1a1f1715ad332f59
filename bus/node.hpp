// What a module on the bus is: a pure step.
//
// A node owns no socket, thread, clock, sleep or file. Cycle k begins with SYNC(k); the node is
// then given every frame that was sent in cycle k-1 and that it accepts, in CAN-ID order, steps its
// own state through [t_k, t_k+1) and answers. So a frame sent in cycle k acts from cycle k+1 on,
// whatever the transport and the scheduling of the host.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "bus/frame.hpp"
#include "bus/tick.hpp"

namespace vcnc {

struct BusFault;
struct Emergency;
class ObjectDictionary;

/// What a module says it is, and how often that it lives.
struct DeviceProfile {
  std::uint32_t device_type = 0;   ///< object 1000h; 0: it follows no standard profile
  std::uint32_t product_code = 0;  ///< object 1018h
  Tick heartbeat = 0;              ///< producer period [cycles], 0: none
};

class Node {
 public:
  virtual ~Node() = default;
  virtual int id() const = 0;                 ///< CANopen node id, 1..127
  virtual std::string_view name() const = 0;  ///< for people: "drive X", "probe"
  /// Acceptance filter; asked once for every identifier, so it must not change. NMT and SYNC
  /// never reach a node, NodeShell handles them; heartbeats only those that it watches.
  virtual bool accepts(std::uint16_t cob_id) const = 0;
  /// One cycle. `inputs` are the accepted frames of cycle k-1 in CAN-ID order; answers are appended
  /// to `out` and must begin with the node's cyclic frame (COB-ID 180h + id).
  virtual void step(Tick k, std::span<const Frame> inputs, Frames& out) = 0;
  /// Nothing moves and nothing will without a command: the module may be switched off.
  virtual bool at_rest() const { return true; }
  /// Told once when the bus has ended: from now on nobody listens, on no channel.
  virtual void leave_bus() {}

  // As a CANopen device (bus/canopen_device.hpp).
  virtual DeviceProfile profile() const { return {}; }
  /// Adds the objects of its own. Their functions are called between steps, as long as it lives.
  virtual void declare(ObjectDictionary&) {}
  /// Told before the step: the heartbeat of the NC unit has been lost, or is back.
  virtual void nc_unit_lost(bool /*lost*/) {}
  /// Whether heartbeats of that node are handed to step().
  virtual bool watches(int /*node*/) const { return false; }
  /// A frame for it between cycles (SDO in pre-operational).
  virtual void request(const Frame&, Frames& /*out*/) {}
  /// An emergency has been sent in its name by the protocol.
  virtual void note(const Emergency&) {}

  // Faults in simulated time (bus/fault.hpp).
  /// A fault of the module's own for the next step; called before each in which it is active.
  virtual void suffer(const BusFault&) {}
  /// Its cyclic frame may be missing or come more than once: the shell ends each answer by a token.
  virtual bool faulted() const { return false; }
  /// It could send nothing in the last cycle.
  virtual bool speechless() const { return false; }
  /// Bus time that its destroyed frames took in the last cycle [ns].
  virtual std::int64_t wasted_ns() const { return 0; }
};

/// The one module that drives the cycle (the NC unit).
class Master {
 public:
  virtual ~Master() = default;
  /// Ends cycle k: `answers` holds every node's frames of cycle k in CAN-ID order; commands for
  /// cycle k+1 are appended to `out`. Returns false when the run is over.
  virtual bool step(Tick k, std::span<const Frame> answers, Frames& out) = 0;
  /// Told before step(k): the share of the last complete cycle (k-1) in which the bus was busy.
  virtual void cycle_load(double /*share*/) {}
  /// Told before step(k): this node takes part no more, from cycle k on. `why` names it. The master
  /// ends the run when it sees fit.
  virtual void node_lost(int /*id*/, const std::string& /*why*/) {}
};

}  // namespace vcnc
