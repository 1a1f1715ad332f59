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
// Following window, its time-out, quick-stop deceleration and quick-stop option are objects
// (6065h, 6066h, 6085h, 605Ah) and act at once. The loss of the NC unit's heartbeat is a quick stop
// too. An error that is gone is told as EMCY 0000h.
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

/// A command heard in cycle k was sent in the one before; an older one is borne as long as none is.
inline bool is_fresh(const GroupCommand& command, Tick k) {
  return static_cast<std::uint16_t>(low16(k - 1) - command.tick) <= kSilentCyclesAllowed;
}

/// Error codes of a drive (CiA 301, CiA 402). 8130h: detail is the node not heard.
inline constexpr std::uint16_t kCommandLostError = 0x8250, kGuardLostError = 0x8130,
                               kFollowingErrorCode = 0x8611, kLimitSwitchError = 0x8612,
                               kOvercurrentError = 0x2310;

class DriveNode : public Node {
 public:
  /// Quick-stop options (605Ah): after standing, switch-on disabled or quick stop active.
  static constexpr std::int64_t kLeaveQuickStop = 2, kStayInQuickStop = 6;

  /// `axis` 0..4 in the order X Y Z A C; `seed` of all noise; `truth` outlives the node.
  DriveNode(std::size_t axis, const Machine& machine, std::uint64_t seed, TruthPort& truth);

  int id() const override { return drive_node(axis_); }
  std::string_view name() const override { return name_; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;
  bool at_rest() const override;
  cia402::State state() const { return state_; }
  /// The probe may still be reading the last cycles, which further ones would overwrite.
  void leave_bus() override { alone_ = true; }
  DeviceProfile profile() const override;
  void declare(ObjectDictionary& objects) override;
  void nc_unit_lost(bool lost) override { nc_unit_lost_ = lost; }
  /// encoder_jump, fault
  void suffer(const BusFault& fault) override;

 private:
  bool plausible(const GroupCommand& command) const;
  void tell(std::uint16_t code, std::uint8_t error_register, std::uint8_t detail, Frames& out);
  void tell_reset(Frames& out);
  bool lags(const AxisCycle& cycle);
  void fail(Frames& out);
  void read(Tick k, std::span<const Frame> inputs, Frames& out);
  void watch(const AxisCycle& cycle, Frames& out);
  AxisCycle move();

  std::size_t axis_;
  std::string name_;
  double quick_stop_deceleration_;
  double largest_velocity_;
  double following_window_;
  Tick following_timeout_ = 0;  ///< cycles beyond the window that are borne
  Tick lagging_cycles_ = 0;
  std::int64_t quick_stop_option_ = kStayInQuickStop;
  DeviceProfile profile_;
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
  bool alone_ = false;  ///< the bus has ended
  bool nc_unit_lost_ = false;
  std::uint16_t error_ = 0;  ///< code told and not yet reset
  std::uint16_t statusword_ = 0;
  double lower_limit_, upper_limit_;
  double position_, velocity_ = 0, force_ = 0;  ///< measured at the end of the cycle
  bool failing_ = false;                        ///< has a fault of its own in this cycle
  double encoder_jump_ = 0;                     ///< [m or rad] in this cycle
};

}  // namespace vcnc
