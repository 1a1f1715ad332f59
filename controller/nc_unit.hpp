// The NC unit: brings the drives up, plays the program, watches the probe, samples the machine.
//
// It is the bus master. In cycle k, once every module has answered, step() in this order
//   latch      reads the answers: drive positions at t_k+1, the probe's deflection at t_k,
//              protection state
//   supervise  stops on a faulty drive and on the overtravel protection: the module's, and - a
//              second path, independent of it - the NC unit's own on the same samples
//   advance    one interpolator cycle: the set-points for t_k+2; program, feed hold or retraction
//   command    sends them; the drives act on them in cycle k+1
//   sample     hands out the telemetry row of instant t_k: command, measured position and
//              deflection of that same instant (commanded in cycle k-2, measured in k-1, digitised
//              in k)
//
// A soft stop (SOFT_STOP, see model/safety/protection.hpp) holds the feed on the path, then
// retracts the probe (retract.hpp) with the drives in operation; a quick stop leaves braking to the
// drives. Either way the run ends in an alarm, with the spindle locked.
//
// A module that the bus has lost, or of which no valid frame younger than two cycles has come,
// means a quick stop of the others, whichever it is. The run then goes on at least as long as an
// axis needs to brake from full speed, since a silent one cannot be seen to stand.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/telemetry.hpp"
#include "controller/alarms.hpp"
#include "controller/player.hpp"
#include "controller/retract.hpp"
#include "model/effects/chain.hpp"
#include "model/machine.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {

class NcUnit : public Master {
 public:
  /// `machine` as the unit knows it: see as_nc_believes(). Checks the program (throws
  /// ProgramError). `sink` outlives the unit.
  NcUnit(const Machine& machine, const std::string& program, TelemetrySink& sink);

  bool step(Tick k, std::span<const Frame> answers, Frames& out) override;
  void cycle_load(double share) override { bus_load_ = share; }
  void node_lost(int id, const std::string& why) override { gone_.emplace_back(id, why); }

  bool complete() const { return state_ == NcState::done; }
  const std::string& reason() const { return reason_; }  ///< why it ended, for people
  bool alarmed() const { return alarmed_; }

 private:
  /// Everything commanded for one instant.
  struct Commanded {
    PlayerStep step;
    NcState state = NcState::starting;
  };
  /// How the machine comes to rest after an alarm.
  enum class Stop { none, hold, retract, quick };

  void latch(Tick k, std::span<const Frame> answers);
  void supervise(Tick k);
  void watch_modules(Tick k);
  void watch_bus(Tick k);
  void watch_protection(Tick k);
  void watch_drives(Tick k);
  void advance(Tick k);
  void shape(Tick k);
  void stop_softly(Tick k);
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
  Chain<InterpolationPort> shaping_;  ///< of the set-points
  TelemetrySink& sink_;

  NcState state_ = NcState::starting;
  bool alarmed_ = false;
  Stop stop_ = Stop::none;
  std::optional<Retract> retract_;
  Tick retracting_since_ = 0;
  std::string reason_ = "interrupted";
  Tick ending_since_ = -1;  ///< when the last motion was commanded

  std::array<DriveStatus, kAxisCount + 1> measured_next_{};  ///< of t_k+1: axes, spindle
  std::array<DriveStatus, kAxisCount + 1> measured_{};       ///< of t_k
  ProbeSample probe_;
  bool probe_heard_ = false;  ///< a sample came in this cycle
  OvertravelState overtravel_;
  Commanded planned_;                 ///< for t_k+2
  std::array<Commanded, 2> earlier_;  ///< for t_k+1 and t_k
  double bus_load_ = 0;

  std::vector<std::pair<int, std::string>> gone_;         ///< told by the bus, not yet raised
  std::array<int, kOvertravelNode + 1> silent_cycles_{};  ///< by node
  std::array<bool, kOvertravelNode + 1> missing_{};       ///< by node: an alarm has been raised
  std::optional<AlarmCode> spindle_alone_;  ///< it has locked itself for want of a message
  int stray_id_ = -1;                       ///< a frame of this cycle that does not belong there
  bool stray_told_ = false;                 ///< an alarm has been raised
  int overloaded_cycles_ = 0;
  Tick blind_stop_cycles_ = 0;  ///< in which an axis stops from full speed
};

}  // namespace vcnc
