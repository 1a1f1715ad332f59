// The NC unit: brings the drives up, plays the program, watches the probe, samples the machine.
//
// It is the bus master. In cycle k, once every module has answered, step() in this order
//   latch      reads the answers: drive positions at t_k+1, the probe's deflection at t_k,
//   protection state supervise  stops on a trip, on a faulty drive and - a second path, independent
//   of the overtravel
//              module - on a deflection out of range seen by itself
//   advance    one interpolator cycle: the set-points for t_k+2
//   command    sends them; the drives act on them in cycle k+1
//   sample     hands out the telemetry row of instant t_k: command, measured position and
//   deflection
//              of that same instant (commanded in cycle k-2, measured in k-1, digitised in k)
#pragma once

#include <array>
#include <string>

#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/telemetry.hpp"
#include "controller/player.hpp"
#include "model/effects/chain.hpp"
#include "model/machine.hpp"
#include "model/probe/contact.hpp"

namespace vcnc {

class NcUnit : public Master {
 public:
  /// `machine` as the unit knows it: see as_nc_believes(). Checks the program (throws
  /// ProgramError). `sink` outlives the unit.
  NcUnit(const Machine& machine, const std::string& program, TelemetrySink& sink);

  bool step(Tick k, std::span<const Frame> answers, Frames& out) override;
  void cycle_load(double share) override { bus_load_ = share; }

  bool complete() const { return state_ == NcState::done; }
  const std::string& reason() const { return reason_; }  ///< why it ended, for people
  bool alarmed() const { return alarmed_; }

 private:
  /// Everything commanded for one instant.
  struct Commanded {
    PlayerStep step;
    NcState state = NcState::starting;
  };
  enum class Code {
    overtravel = 1001,
    probe_range = 1002,
    probe_signal = 1003,
    drive = 2001,
    start_up = 2002,
    node = 3001
  };

  void latch(Tick k, std::span<const Frame> answers);
  void supervise(Tick k);
  void advance(Tick k);
  void shape(Tick k);
  void command(Tick k, Frames& out);
  void sample(Tick k);
  void raise(Tick k, Code code, std::string source, std::string text);
  bool standing() const;

  Machine machine_;
  UsableRange probe_range_;
  Player player_;
  Chain<InterpolationPort> shaping_;  ///< of the set-points
  TelemetrySink& sink_;

  NcState state_ = NcState::starting;
  bool alarmed_ = false;
  std::string reason_ = "interrupted";
  Tick ending_since_ = -1;  ///< when the last motion was commanded

  std::array<DriveStatus, kAxisCount + 1> measured_next_{};  ///< of t_k+1: axes, spindle
  std::array<DriveStatus, kAxisCount + 1> measured_{};       ///< of t_k
  ProbeSample probe_;
  OvertravelState overtravel_;
  Commanded planned_;                 ///< for t_k+2
  std::array<Commanded, 2> earlier_;  ///< for t_k+1 and t_k
  double bus_load_ = 0;
};

}  // namespace vcnc
