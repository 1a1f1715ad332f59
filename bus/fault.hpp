// Faults of the bus and of modules in simulated time: data that decorators act upon.
//
// The same decorators serve in one process and in the module programs, so a scenario with faults
// has one trace hash in every layout. A fault is active in the cycles from .. from + cycles - 1
// (cycles 0: to the end); in cycle k it changes what a module takes over at SYNC(k) and what it
// says in cycle k.
//
// Text form, for command lines and files: NODE KIND key=value ...
//   probe mute from_s=1.5 for_s=0.005
// The table of kinds, what each may befall and its keys is kKinds in bus/fault.cpp; `vcnc faults`
// prints it (docs/faults.md).
//
// `bus` stands for all modules; drop, corrupt, delay and duplicate act once, at the sender, there.
// The NC unit silent or mute: no command and no SYNC reaches a module.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/error_counters.hpp"
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
    power_loss,
    bus_off,
    encoder_jump,
    fault,
    wire_break,
    stuck_adc,
    saturated,
    slip,
    kill,
    stop,
    slow,
    restart,
    disk_full
  };
  std::string node;
  Kind kind = Kind::mute;
  Tick from = 0;
  Tick cycles = 0;          ///< 0: to the end
  int id = -1;              ///< identifier it is about, -1: all that the node sends
  int count = 0;            ///< cycles of a delay, frames of a babbler, periods of a slip
  int bit = -1;             ///< that flips, -1: drawn
  int channel = 0;          ///< of the probe
  double value = 0;         ///< encoder jump [m or rad]
  double wall_s = -1;       ///< faults of the host: when in host time, -1: by simulated time
  bool at_contact = false;  ///< `from` counts from the first touch; resolved before a run
  std::string text{};       ///< as it was written

  bool active(Tick k) const { return k >= from && (cycles == 0 || k - from < cycles); }
  bool of_host() const { return kind >= Kind::kill; }
  bool of_supply() const { return kind == Kind::power_loss; }
  bool of_module() const { return kind >= Kind::encoder_jump && kind < Kind::kill; }
};

using BusFaults = std::vector<BusFault>;

inline constexpr std::string_view kNcUnitName = "NC unit", kWholeBus = "bus",
                                  kSupplyName = "supply";

/// What a kind may befall.
enum class FaultPlace {
  node,
  module_or_bus,
  one_node,
  module,
  bus,
  supply,
  axis,
  probe,
  process,
  analysis
};

struct FaultKind {
  BusFault::Kind kind;
  std::string_view name;
  std::string_view keys;  ///< besides from_s and for_s, separated by blanks
  FaultPlace place;
  std::string_view means;     ///< to the machine
  std::string_view detected;  ///< what the machine makes of it
};

std::span<const FaultKind> fault_kinds();
/// The nodes that a kind may befall, for people and for draws.
std::vector<std::string_view> nodes_of(const FaultKind& kind);

/// Throws std::invalid_argument: one sentence with the word that is wrong and what is allowed.
BusFault parse_fault(std::string_view text);
/// parse_fault(text_of(x)) gives x, whatever x.text was.
std::string text_of(const BusFault& fault);

/// Whether the simulated fault touches the module of this name.
bool concerns(const BusFault& fault, std::string_view node);
bool concerns(const BusFaults& faults, std::string_view node);

/// What the faults of one module make of its frames.
class FaultFilter {
 public:
  /// Keeps those that concern it.
  FaultFilter(const BusFaults& faults, std::string_view node);

  const BusFaults& faults() const { return faults_; }
  /// Those that have changed anything so far, as they were written.
  std::vector<std::string> struck() const;
  bool empty() const { return faults_.empty(); }
  bool synced(Tick k) const;      ///< it gets SYNC
  bool speechless(Tick k) const;  ///< it can send nothing at all
  /// Bus time that destroyed frames and error frames took in the last cycle [ns].
  std::int64_t wasted_ns() const { return wasted_ns_; }
  /// The emergency of a node that can speak again after errors, once.
  std::optional<std::uint16_t> take_return(Tick k);
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
  void strike_whole(Tick k);

  bool off() const { return counters_.state() == ErrorCounters::State::bus_off; }
  /// What destroying does to the node's controller in cycle k. False: nothing gets through.
  bool transmit(Tick k, std::span<const Frame> said);

  std::string node_;
  BusFaults faults_;
  std::vector<char> struck_;  ///< by fault
  std::vector<Held> held_;
  ErrorCounters counters_;
  std::optional<std::uint16_t> return_;  ///< to be told when it can speak again
  std::int64_t wasted_ns_ = 0;
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
  bool watches(int node) const override { return inner_.watches(node); }
  void request(const Frame& frame, Frames& out) override { inner_.request(frame, out); }
  void note(const Emergency& emergency) override { inner_.note(emergency); }
  bool faulted() const override { return true; }
  bool speechless() const override { return speechless_; }
  std::int64_t wasted_ns() const override { return filter_.wasted_ns(); }
  bool harmless() const { return filter_.empty(); }  ///< no fault concerns it
  std::vector<std::string> struck() const { return filter_.struck(); }

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
  std::vector<std::string> struck() const { return filter_.struck(); }

 private:
  Master& inner_;
  FaultFilter filter_;
  Frames heard_, said_;
};

}  // namespace vcnc
