#include "servo_sim/drive_node.hpp"

namespace vcnc {

static_assert(kLoopStepsPerCycle == std::tuple_size_v<decltype(AxisCycle::truth)>);
static_assert(kDriveLoopSteps == kLoopStepsPerCycle &&
              kDriveLoopSteps * kPlantStepsPerLoop == kPlantStepsPerCycle);

DriveNode::DriveNode(std::size_t axis, const Machine& machine, std::uint64_t seed, TruthPort& truth)
    : axis_(axis),
      name_("drive " + std::string(kAxisNames[axis])),
      quick_stop_deceleration_(machine.axes[axis].limits.acceleration),
      drive_(machine, axis, seed),
      truth_(truth) {}

bool DriveNode::accepts(std::uint16_t cob_id) const {
  return cob_id == kCommandId || cob_id == kStatusBase + kOvertravelNode;
}

void DriveNode::read(std::span<const Frame> inputs, Frames& out) {
  ++cycles_without_command_;
  ++cycles_without_overtravel_;
  for (const Frame& frame : inputs) {
    if (const auto command = decode_group_command(frame)) {
      command_ = *command;
      commanded_ = true;
      cycles_without_command_ = 0;
    } else if (const auto overtravel = decode_overtravel_state(frame)) {
      guarded_ = true;
      cycles_without_overtravel_ = 0;
      tripped_ = overtravel->state == OvertravelState::State::tripped;
    }
  }

  using cia402::State;
  const bool reset_edge = (command_.controlword & ~last_controlword_ & cia402::kFaultReset) != 0;
  last_controlword_ = command_.controlword;
  const bool command_lost = commanded_ && cycles_without_command_ > kSilentCyclesAllowed;
  const bool guard_lost = guarded_ && cycles_without_overtravel_ > kSilentCyclesAllowed;
  if (state_ == State::operation_enabled && (tripped_ || command_lost || guard_lost)) {
    state_ = State::quick_stop;
    if (!tripped_)  // the trip itself is reported by the overtravel module
      out.push_back(
          encode(Emergency{.node = id(),
                           .code = static_cast<std::uint16_t>(command_lost ? 0x8250 : 0x8130),
                           .error_register = 0x11}));
    return;
  }
  state_ = cia402::next_state(state_, command_.controlword, reset_edge);
}

AxisCycle DriveNode::move() {
  switch (state_) {
    case cia402::State::operation_enabled:
      return drive_.follow({command_.axes[axis_].position, command_.axes[axis_].velocity});
    case cia402::State::quick_stop:
      return drive_.brake(quick_stop_deceleration_);
    default:
      return drive_.hold();
  }
}

void DriveNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  const std::size_t first = out.size();
  out.emplace_back();  // the cyclic frame comes first; filled in below
  read(inputs, out);
  AxisVector positions, velocities;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    positions[i] = command_.axes[i].position;
    velocities[i] = command_.axes[i].velocity;
  }
  if (commanded_) drive_.tell_commands(positions, velocities);
  const AxisCycle cycle = move();

  TruthCycle truth{.tick = k, .position = cycle.truth};
  truth_.publish(axis_, truth);

  std::uint16_t statusword = cia402::statusword_of(state_) | cia402::kRemote;
  if (state_ == cia402::State::operation_enabled) statusword |= cia402::kFollowsCommand;
  if (std::abs(cycle.force) >= 1) statusword |= cia402::kInternalLimit;
  out[first] = encode(DriveStatus{.node = id(),
                                  .tick = low16(k + 1),
                                  .statusword = statusword,
                                  .position = cycle.measured,
                                  .second_encoder = cycle.second,
                                  .force = cycle.force});
}

}  // namespace vcnc
