// The NC unit: brings the drives up, plays the program, watches the probe, samples the machine.
//
// It is the bus master. In cycle k, once every module has answered, step() in this order
//   latch      reads the answers: drive positions at t_k+1, the probe's deflection at t_k,
//              protection state
//   supervise  stops on a faulty drive and on the overtravel protection: the module's, and - a
//              second path, independent of it - the NC unit's own on the same samples
//   advance    one interpolator cycle: the set-points for t_k+2; program, feed hold or retraction
//   command    sends them, compensated (controller/compensation.hpp); the drives act on them in
//              cycle k+1
//   sample     hands out the telemetry row of instant t_k: command, measured position and
//              deflection of that same instant (commanded in cycle k-2, measured in k-1, digitised
//              in k). Positions are those of the program: what the compensation of errors adds is
//              taken off the measured ones again
//
// A soft stop (SOFT_STOP, see model/safety/protection.hpp) holds the feed on the path, then
// retracts the probe (retract.hpp) with the drives in operation; a quick stop leaves braking to the
// drives. Either way the run ends in an alarm, with the spindle locked.
//
// A probing move of the program ends where the probe's reading says so (Player::feel): each reading
// goes with the measured positions of the instant it belongs to, be it one or two cycles old.
//
// A power-fail signal while the program runs is ridden out: see controller/outage.hpp. Each step is
// kept in the unit's memory (controller/nc_record.hpp), so that a program goes on after the supply
// was exhausted, too. What the own protection has latched is kept there as well.
//
// It watches the heartbeat of every module and produces its own (node 127). A module that the bus
// has lost, whose heartbeat fails or shows another state than operational, or of which no valid
// frame younger than two cycles has come, means a quick stop of the others, whichever it is. The
// run then goes on at least as long as an axis needs to brake from full speed, since a silent one
// cannot be seen to stand.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/heartbeat.hpp"
#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/node_memory.hpp"
#include "bus/telemetry.hpp"
#include "controller/alarms.hpp"
#include "controller/compensation.hpp"
#include "controller/nc_record.hpp"
#include "controller/operation.hpp"
#include "controller/outage.hpp"
#include "controller/player.hpp"
#include "controller/retract.hpp"
#include "model/effects/chain.hpp"
#include "model/machine.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {

/// What the operator wants when the mains return to a machine that has ridden out their loss.
enum class OnPowerReturn { end, resume };

struct NcUnitOptions {
  OnPowerReturn on_power_return = OnPowerReturn::end;
  NodeMemory* memory = nullptr;         ///< outlives the unit; null: nothing is kept
  NodeMemory* data = nullptr;           ///< the same, of offsets, parameters and tools
  KeptNcData kept{};                    ///< what it holds
  NcRecord record{};                    ///< what was kept; program, hashes and latch go on in it
  bool resume = false;                  ///< go on where the record says, axes standing at ...
  AxisVector switched_on_at{};          ///< ... these positions
  std::vector<Operation> operations{};  ///< what the operator does at the panel
  PlayerOptions player{};
};

class NcUnit : public Master {
 public:
  /// `machine` as the unit knows it: see as_nc_believes(). Checks the program (throws
  /// ProgramError, and InputError when it is not the one to resume). `sink` outlives the unit.
  NcUnit(const Machine& machine, const std::string& program, TelemetrySink& sink,
         const NcUnitOptions& options = {});
  NcUnit(const NcUnit&) = delete;
  NcUnit& operator=(const NcUnit&) = delete;

  bool step(Tick k, std::span<const Frame> answers, Frames& out) override;
  void cycle_load(double share) override { bus_load_ = share; }
  void node_lost(int id, const std::string& why) override { gone_.emplace_back(id, why); }

  /// The supply's power-fail signal; told before step(k).
  void power_fail(bool failing) { mains_failing_ = failing; }

  bool complete() const { return state_ == NcState::done; }
  const std::string& reason() const { return reason_; }  ///< why it ended, for people
  bool alarmed() const { return alarmed_ || ended_by_mains_; }
  RunStage stage() const;  ///< of the program, as it is kept
  /// What the operator has had no occasion to do, as it was written.
  std::vector<std::string> never_operated() const { return panel_.never(); }

 private:
  /// Everything commanded for one instant.
  struct Commanded {
    PlayerStep step;
    NcState state = NcState::starting;
    AxisVector correction{};  ///< of it, for the errors of the machine
  };
  /// How the machine comes to rest after an alarm.
  enum class Stop { none, hold, retract, quick };

  void latch(Tick k, std::span<const Frame> answers);
  void supervise(Tick k);
  void refuse_start(Tick k);
  void watch_modules(Tick k);
  void watch_heartbeats(Tick k);
  void watch_bus(Tick k);
  void watch_protection(Tick k);
  void watch_drives(Tick k);
  void watch_mains(Tick k);
  void ride_out(Tick k);
  void seek();
  void operate(Tick k);
  void feel(Tick k);
  void watch_probing(Tick k);
  void tell(Tick k, AlarmCode code, const std::string& detail);
  void remember(Tick k);
  void remember_data(Tick k, bool now);
  void advance(Tick k);
  void shape(Tick k);
  void stop_softly(Tick k);
  Vec3 touching() const;
  void command(Tick k, Frames& out);
  void sample(Tick k);
  /// Stops the machine, at least as hard as it is stopping already, and tells why.
  void raise(Tick k, AlarmCode code, std::string source, const std::string& detail, Stop stop);
  bool heard(int node, std::uint16_t tick, std::uint16_t expected);
  bool seen(std::size_t drive) const;  ///< its status can be trusted
  bool standing() const;

  Machine machine_;
  Protection protection_;  ///< the NC unit's own
  Player player_;
  OperatorPanel panel_;
  Tick at_zero_ = 0;                  ///< cycles at an override of 0 %
  Chain<InterpolationPort> shaping_;  ///< of the set-points
  CompensationRules compensation_;
  CompensationState compensating_;
  TelemetrySink& sink_;
  Tick heartbeat_period_;  ///< own, and of every module

  NcState state_ = NcState::starting;
  bool alarmed_ = false;
  Stop stop_ = Stop::none;
  bool mains_failing_ = false, mains_told_ = false;  ///< the signal, and whether 4001 was told
  bool ended_by_mains_ = false;
  Outage outage_;
  NcUnitOptions options_;
  NcRecord saved_;  ///< what the memory holds
  Tick saved_at_ = 0, data_saved_at_ = 0;
  std::optional<Retract> retract_;
  Tick retracting_since_ = 0;
  std::string reason_ = "interrupted";
  Tick ending_since_ = -1;  ///< when the last motion was commanded

  std::array<DriveStatus, kAxisCount + 1> measured_next_{};  ///< of t_k+1: axes, spindle
  std::array<DriveStatus, kAxisCount + 1> measured_{};       ///< of t_k
  std::array<AxisVector, 3> places_{};  ///< as the program has them: of t_k, t_k-1, t_k-2
  ProbeSample probe_;
  bool probe_heard_ = false;  ///< a sample came in this cycle
  OvertravelState overtravel_;
  Commanded planned_;                 ///< for t_k+2
  std::array<Commanded, 2> earlier_;  ///< for t_k+1 and t_k
  double bus_load_ = 0;

  std::vector<std::pair<int, std::string>> gone_;         ///< told by the bus, not yet raised
  std::array<int, kOvertravelNode + 1> silent_cycles_{};  ///< by node
  std::array<bool, kOvertravelNode + 1> missing_{};       ///< by node: an alarm has been raised
  std::array<HeartbeatWatch, kOvertravelNode + 1> heartbeats_{};  ///< by node
  std::optional<AlarmCode> spindle_alone_;  ///< it has locked itself for want of a message
  /// What each drive has said last by an emergency message.
  std::array<std::optional<AlarmCode>, kAxisCount + 1> drive_emergency_;
  int stray_id_ = -1;        ///< a frame of this cycle that does not belong there
  bool stray_told_ = false;  ///< an alarm has been raised
  int overloaded_cycles_ = 0;
  Tick blind_stop_cycles_ = 0;  ///< in which an axis stops from full speed
};

}  // namespace vcnc
