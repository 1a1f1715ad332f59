// Faults of the bus and of modules in simulated time: data that decorators act upon.
//
// The same decorators serve in one process and in the module programs, so a scenario with faults
// has one trace hash in every layout. A fault is active in the cycles from .. from + cycles - 1
// (cycles 0: to the end); in cycle k it changes what a module takes over at SYNC(k) and what it
// says in cycle k.
//
// Text form, for command lines and files: NODE KIND key=value ...
//   probe mute from_s=1.5 for_s=0.005
//   NODE     drive X|Y|Z|A|C|spindle, probe, overtravel, NC unit, bus; for kill, stop and slow also
//            analysis
//   from_s   beginning [s] (0), for_s  duration [s] (to the end)
//
//   kind          of       means
//   mute          any      sends nothing, hears nothing: unplugged, bus off
//   silent        any      sends nothing
//   deaf          any      hears nothing
//   drop          any      the frame id=0x187 is lost: sent by the node, or heard by it
//   corrupt       any      bits of a payload flip unnoticed by the CRC: bit=N, else 1..3 bits drawn
//                          from cycle and identifier; id=: sent or heard, else all that it sends
//   delay         any      cycles=N: comes N cycles later; id= as above
//   duplicate     any      comes twice; id= as above
//   lose_sync     modules  no SYNC: nothing latched, no cyclic frame; the motion goes on;
//   emergencies
//                          are sent. On its return the missed SYNCs are told (EMCY 8100h)
//   babble        any      frames=N (20) more frames in each cycle, of id=0x07F
//   stuck         bus      stuck dominant: no module is heard and none hears
//   encoder_jump  axes     um=, urad= added to what the measuring system counts
//   fault         axes     the drive raises EMCY 2310h and stops by itself
//   wire_break, stuck_adc, saturated
//                 probe    channel=x|y|z (x): both signals at mid voltage, converter frozen, at its
//                          end
//   kill, stop, slow       of the host, on real processes: SIGKILL, SIGSTOP, stopped half of the
//                          time; at from_s or, in host time, at wall_s
//
// `bus` stands for all modules; drop, corrupt, delay and duplicate act once, at the sender, there.
// The NC unit silent or mute: no command and no SYNC reaches a module.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/node.hpp"

namespace vcnc {

struct BusFault {
  enum class Kind {
    mute,
    silent,
    deaf,
    drop,
    corrupt,
    delay,
    duplicate,
    lose_sync,
    babble,
    stuck,
    encoder_jump,
    fault,
    wire_break,
    stuck_adc,
    saturated,
    kill,
    stop,
    slow
  };
  std::string node;
  Kind kind = Kind::mute;
  Tick from = 0;
  Tick cycles = 0;     ///< 0: to the end
  int id = -1;         ///< identifier it is about, -1: all that the node sends
  int count = 0;       ///< cycles of a delay, frames of a babbler
  int bit = -1;        ///< that flips, -1: drawn
  int channel = 0;     ///< of the probe
  double value = 0;    ///< encoder jump [m or rad]
  double wall_s = -1;  ///< faults of the host: when in host time, -1: by simulated time
  std::string text{};  ///< as it was written

  bool active(Tick k) const { return k >= from && (cycles == 0 || k - from < cycles); }
  bool of_host() const { return kind >= Kind::kill; }
  bool of_module() const { return kind >= Kind::encoder_jump && kind < Kind::kill; }
};

using BusFaults = std::vector<BusFault>;

inline constexpr std::string_view kNcUnitName = "NC unit", kWholeBus = "bus";

/// Throws std::invalid_argument: one sentence with the word that is wrong and what is allowed.
BusFault parse_fault(std::string_view text);

/// Whether the simulated fault touches the module of this name.
bool concerns(const BusFault& fault, std::string_view node);
bool concerns(const BusFaults& faults, std::string_view node);

/// What the faults of one module make of its frames.
class FaultFilter {
 public:
  /// Keeps those that concern it.
  FaultFilter(const BusFaults& faults, std::string_view node);

  const BusFaults& faults() const { return faults_; }
  bool empty() const { return faults_.empty(); }
  bool synced(Tick k) const;      ///< it gets SYNC
  bool speechless(Tick k) const;  ///< it can send nothing at all
  /// The frames of `inputs` that it hears in cycle k, in CAN-ID order.
  void hear(Tick k, std::span<const Frame> inputs, Frames& heard);
  /// Appends to `out` what becomes of the frames that it says in cycle k.
  void say(Tick k, std::span<const Frame> said, Frames& out);

 private:
  enum class Way { heard, said };
  struct Held {
    Tick due;
    Way way;
    Frame frame;
  };
  bool is(Tick k, BusFault::Kind kind) const;
  void pass(Tick k, Way way, Frame frame, Frames& to);
  void release(Tick k, Way way, Frames& to);

  std::string node_;
  BusFaults faults_;
  std::vector<Held> held_;
};

/// A module with faults. Pure, like the one inside.
class FaultedNode : public Node {
 public:
  /// `inner` outlives this one.
  FaultedNode(Node& inner, const BusFaults& faults);

  int id() const override { return inner_.id(); }
  std::string_view name() const override { return inner_.name(); }
  bool accepts(std::uint16_t cob_id) const override { return inner_.accepts(cob_id); }
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;
  bool at_rest() const override { return inner_.at_rest(); }
  void leave_bus() override { inner_.leave_bus(); }
  bool faulted() const override { return true; }
  bool speechless() const override { return speechless_; }
  bool harmless() const { return filter_.empty(); }  ///< no fault concerns it

 private:
  Node& inner_;
  FaultFilter filter_;
  Frames heard_, said_;
  std::uint32_t missed_syncs_ = 0;
  bool speechless_ = false;
};

/// The NC unit with faults.
class FaultedMaster : public Master {
 public:
  FaultedMaster(Master& inner, const BusFaults& faults);

  bool step(Tick k, std::span<const Frame> answers, Frames& out) override;
  void cycle_load(double share) override { inner_.cycle_load(share); }
  void node_lost(int id, const std::string& why) override { inner_.node_lost(id, why); }

 private:
  Master& inner_;
  FaultFilter filter_;
  Frames heard_, said_;
};

}  // namespace vcnc
