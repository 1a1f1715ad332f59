// A servo drive on the bus: CiA 402 state machine around the physics of one axis.
//
// Cycle k: the set-point received in cycle k-1 is the target for t_k+1; the drive moves there and
// reports where it is at t_k+1 (DriveStatus::tick = k+1). It publishes the true load motion on
// the truth channel, which only the simulators open.
//
// Protection acts in the drive itself, one cycle after the message was sent: an overtravel module
// in HARD, one that falls silent, or a command that fails to arrive (or has a set-point that is not
// a number) lead to a quick stop. What is
// wrong with the drive itself is a fault: quick stop ramp, then fault state until the rising edge
// of the controlword's reset bit.
//   8611h  following error: |set-point - measured| beyond the window
//   8612h  limit switch: measured beyond the switch
//   2310h  the drive itself (only as a simulated fault, bus/fault.hpp)
// After a following error the ramp starts where the axis is, not at the set-point it could not
// follow. A command that holds no numbers, or is faster than 1.5 x the axis' limit, counts as lost.
#pragma once

#include <string>

#include "bus/cia402.hpp"
#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/truth.hpp"
#include "model/drive/axis_drive.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// What a drive watches besides its set-points: cycles without a message that must come each cycle.
inline constexpr int kSilentCyclesAllowed = 2;

/// Error codes of a drive (CiA 301, CiA 402).
inline constexpr std::uint16_t kCommandLostError = 0x8250, kGuardLostError = 0x8130,
                               kFollowingErrorCode = 0x8611, kLimitSwitchError = 0x8612,
                               kOvercurrentError = 0x2310;

class DriveNode : public Node {
 public:
  /// `axis` 0..4 in the order X Y Z A C; `seed` of all noise; `truth` outlives the node.
  DriveNode(std::size_t axis, const Machine& machine, std::uint64_t seed, TruthPort& truth);

  int id() const override { return drive_node(axis_); }
  std::string_view name() const override { return name_; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;
  bool at_rest() const override;
  /// The probe may still be reading the last cycles, which further ones would overwrite.
  void leave_bus() override { alone_ = true; }
  /// encoder_jump, fault
  void suffer(const BusFault& fault) override;

 private:
  bool plausible(const GroupCommand& command) const;
  void fail(Frames& out);
  void read(std::span<const Frame> inputs, Frames& out);
  void watch(const AxisCycle& cycle, Frames& out);
  AxisCycle move();

  std::size_t axis_;
  std::string name_;
  double quick_stop_deceleration_;
  double largest_velocity_;
  double following_window_;
  double lower_switch_, upper_switch_;
  AxisDrive drive_;
  TruthPort& truth_;

  cia402::State state_ = cia402::State::not_ready;
  GroupCommand command_;
  std::uint16_t last_controlword_ = 0;
  int cycles_without_command_ = 0;
  int cycles_without_overtravel_ = 0;
  bool commanded_ = false;  ///< a first command has come
  bool guarded_ = false;    ///< a first overtravel state has come
  bool tripped_ = false;    ///< the overtravel module is in HARD
  bool beyond_switch_ = false;
  bool alone_ = false;       ///< the bus has ended
  bool failing_ = false;     ///< has a fault of its own in this cycle
  double encoder_jump_ = 0;  ///< [m or rad] in this cycle
};

}  // namespace vcnc
