#include "servo_sim/drive_node.hpp"

#include "bus/fault.hpp"

namespace vcnc {
static_assert(kLoopStepsPerCycle == std::tuple_size_v<decltype(AxisCycle::truth)>);
static_assert(kDriveLoopSteps == kLoopStepsPerCycle &&
              kDriveLoopSteps * kPlantStepsPerLoop == kPlantStepsPerCycle);

namespace {

constexpr double kImplausible = 1.5;  ///< times the velocity limit of the axis

}  // namespace

DriveNode::DriveNode(std::size_t axis, const Machine& machine, std::uint64_t seed, TruthPort& truth)
    : axis_(axis),
      name_("drive " + std::string(kAxisNames[axis])),
      quick_stop_deceleration_(machine.axes[axis].limits.acceleration),
      largest_velocity_(kImplausible * machine.axes[axis].limits.velocity),
      following_window_(machine.axes[axis].following_window(is_rotary(axis))),
      lower_switch_(machine.axes[axis].limits.min - machine.axes[axis].limits.switch_distance),
      upper_switch_(machine.axes[axis].limits.max + machine.axes[axis].limits.switch_distance),
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
      if (!plausible(*command)) continue;
      command_ = *command;
      commanded_ = true;
      cycles_without_command_ = 0;
    } else if (const auto overtravel = decode_overtravel_state(frame)) {
      guarded_ = true;
      cycles_without_overtravel_ = 0;
      tripped_ = overtravel->state == OvertravelState::State::hard;
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
      out.push_back(encode(Emergency{.node = id(),
                                     .code = command_lost ? kCommandLostError : kGuardLostError,
                                     .error_register = 0x11}));
    return;
  }
  if (state_ == State::fault_reaction && !drive_.standing()) return;
  state_ = cia402::next_state(state_, command_.controlword, reset_edge);
}

/// A set-point faster than the axis can ever be told to move is a spoiled frame.
bool DriveNode::plausible(const GroupCommand& command) const {
  return is_finite(command) && std::abs(command.axes[axis_].velocity) <= largest_velocity_;
}

bool DriveNode::at_rest() const {
  return state_ != cia402::State::operation_enabled && drive_.standing();
}

void DriveNode::suffer(const BusFault& fault) {
  if (fault.kind == BusFault::Kind::fault) failing_ = true;
  if (fault.kind == BusFault::Kind::encoder_jump) encoder_jump_ += fault.value;
}

void DriveNode::fail(Frames& out) {
  using cia402::State;
  if (state_ == State::fault_reaction || state_ == State::fault) return;
  state_ = State::fault_reaction;
  out.push_back(encode(Emergency{.node = id(), .code = kOvercurrentError, .error_register = 0x03}));
}

/// Faults of the drive itself.
void DriveNode::watch(const AxisCycle& cycle, Frames& out) {
  using cia402::State;
  const bool beyond = cycle.measured < lower_switch_ || cycle.measured > upper_switch_;
  const bool hits_switch = beyond && !beyond_switch_;  // one may drive back from it
  beyond_switch_ = beyond;
  if (state_ != State::operation_enabled) return;
  const bool lags = std::abs(drive_.position() - cycle.measured) > following_window_;
  if (!lags && !hits_switch) return;
  if (lags) drive_.follow_up();
  state_ = State::fault_reaction;
  out.push_back(encode(Emergency{.node = id(),
                                 .code = lags ? kFollowingErrorCode : kLimitSwitchError,
                                 .error_register = 0x21}));
}

AxisCycle DriveNode::move() {
  switch (state_) {
    case cia402::State::operation_enabled:
      return drive_.follow({command_.axes[axis_].position, command_.axes[axis_].velocity});
    case cia402::State::quick_stop:
    case cia402::State::fault_reaction:
      return drive_.brake(quick_stop_deceleration_);
    default:
      return drive_.hold();
  }
}

void DriveNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  const std::size_t first = out.size();
  out.emplace_back();  // the cyclic frame comes first; filled in below
  read(inputs, out);
  if (failing_) fail(out);
  drive_.shift_encoder(encoder_jump_);
  failing_ = false;
  encoder_jump_ = 0;
  AxisVector positions, velocities;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    positions[i] = command_.axes[i].position;
    velocities[i] = command_.axes[i].velocity;
  }
  if (commanded_) drive_.tell_commands(positions, velocities);
  const AxisCycle cycle = move();
  watch(cycle, out);

  TruthCycle truth{.tick = k, .position = cycle.truth};
  if (!alone_) truth_.publish(axis_, truth);

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
