// A servo drive on the bus: CiA 402 state machine around the physics of one axis.
//
// Cycle k: the set-point received in cycle k-1 is the target for t_k+1; the drive moves there and
// reports where it is at t_k+1 (DriveStatus::tick = k+1). It publishes the true load motion on
// the truth channel, which only the simulators open.
//
// Protection acts in the drive itself, one cycle after the message was sent: an overtravel trip, an
// overtravel module that falls silent or a command that fails to arrive all lead to a quick stop.
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

class DriveNode : public Node {
 public:
  /// `axis` 0..4 in the order X Y Z A C; `seed` of all noise; `truth` outlives the node.
  DriveNode(std::size_t axis, const Machine& machine, std::uint64_t seed, TruthPort& truth);

  int id() const override { return drive_node(axis_); }
  std::string_view name() const override { return name_; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;

 private:
  void read(std::span<const Frame> inputs, Frames& out);
  AxisCycle move();

  std::size_t axis_;
  std::string name_;
  double quick_stop_deceleration_;
  AxisDrive drive_;
  TruthPort& truth_;

  cia402::State state_ = cia402::State::not_ready;
  GroupCommand command_;
  std::uint16_t last_controlword_ = 0;
  int cycles_without_command_ = 0;
  int cycles_without_overtravel_ = 0;
  bool commanded_ = false;  ///< a first command has come
  bool guarded_ = false;    ///< a first overtravel state has come
  bool tripped_ = false;
};

}  // namespace vcnc
