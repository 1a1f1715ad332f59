#include "servo_sim/spindle_node.hpp"

#include "servo_sim/drive_node.hpp"

namespace vcnc {

namespace {

SpindleMode mode_of(GroupCommand::SpindleMode mode) {
  switch (mode) {
    case GroupCommand::SpindleMode::clockwise:
      return SpindleMode::clockwise;
    case GroupCommand::SpindleMode::counter_clockwise:
      return SpindleMode::counter_clockwise;
    case GroupCommand::SpindleMode::orient:
      return SpindleMode::orient;
    case GroupCommand::SpindleMode::off:
      break;
  }
  return SpindleMode::off;
}

}  // namespace

SpindleNode::SpindleNode(const Machine& machine) : drive_(machine.spindle) {}

bool SpindleNode::accepts(std::uint16_t cob_id) const {
  return cob_id == kCommandId || cob_id == kStatusBase + kOvertravelNode;
}

/// Tells once, in the cycle in which the silence becomes too long.
void SpindleNode::lock_if_silent(Frames& out) {
  const bool command_lost = commanded_ && cycles_without_command_ > kSilentCyclesAllowed;
  const bool guard_lost = guarded_ && cycles_without_overtravel_ > kSilentCyclesAllowed;
  if (!command_lost && !guard_lost) return;
  if (!locked_)
    out.push_back(encode(Emergency{.node = id(),
                                   .code = guard_lost ? kGuardLostError : kCommandLostError,
                                   .error_register = 0x11}));
  locked_ = true;
}

void SpindleNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  const std::size_t first = out.size();
  out.emplace_back();  // the cyclic frame comes first; filled in below
  ++cycles_without_command_;
  ++cycles_without_overtravel_;
  bool reset = false;
  for (const Frame& frame : inputs) {
    if (const auto command = decode_group_command(frame)) {
      if (!is_finite(*command)) continue;
      command_ = *command;
      commanded_ = true;
      cycles_without_command_ = 0;
      reset = (command->flags & kResetLatch) != 0;
    } else if (const auto overtravel = decode_overtravel_state(frame)) {
      guarded_ = true;
      cycles_without_overtravel_ = 0;
      tripped_ = overtravel->state >= OvertravelState::State::soft_stop;
    }
  }
  const bool asked_to_lock = (command_.flags & kSpindleLock) != 0;
  if (tripped_ || asked_to_lock)
    locked_ = true;
  else if (reset)
    locked_ = false;
  lock_if_silent(out);

  // The locked spindle stays in operation: it brakes and holds, but takes no mode.
  state_ = cia402::next_state(state_, locked_ ? cia402::kEnable : command_.controlword, false);
  const bool enabled = state_ == cia402::State::operation_enabled && !locked_;
  const SpindleCycle cycle = drive_.step(
      enabled ? mode_of(command_.spindle_mode) : SpindleMode::off, command_.spindle_speed);

  std::uint16_t statusword = cia402::statusword_of(state_) | cia402::kRemote;
  if (locked_ || cycle.limited) statusword |= cia402::kInternalLimit;
  if (cycle.at_speed || cycle.oriented) statusword |= cia402::kTargetReached;
  out[first] = encode(DriveStatus{.node = id(),
                                  .tick = low16(k + 1),
                                  .statusword = statusword,
                                  .position = cycle.angle,
                                  .second_encoder = cycle.speed});
}

}  // namespace vcnc
