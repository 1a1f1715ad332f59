#include "servo_sim/drive_node.hpp"

#include "bus/fault.hpp"
#include "bus/heartbeat.hpp"
#include "bus/object_dictionary.hpp"

namespace vcnc {
static_assert(kLoopStepsPerCycle == std::tuple_size_v<decltype(AxisCycle::truth)>);
static_assert(kDriveLoopSteps == kLoopStepsPerCycle &&
              kDriveLoopSteps * kPlantStepsPerLoop == kPlantStepsPerCycle);

namespace {

constexpr double kImplausible = 1.5;  ///< times the velocity limit of the axis
constexpr double kPositionCounts = 1e7, kSpeedCounts = 1e6;

}  // namespace

DriveNode::DriveNode(std::size_t axis, const Machine& machine, std::uint64_t seed, TruthPort& truth)
    : axis_(axis),
      name_("drive " + std::string(kAxisNames[axis])),
      quick_stop_deceleration_(machine.axes[axis].limits.acceleration),
      largest_velocity_(kImplausible * machine.axes[axis].limits.velocity),
      following_window_(machine.axes[axis].following_window(is_rotary(axis))),
      profile_{kServoDrive, kAxisDriveProduct, heartbeat_cycles(machine.bus.heartbeat_time)},
      lower_switch_(machine.axes[axis].limits.min - machine.axes[axis].limits.switch_distance),
      upper_switch_(machine.axes[axis].limits.max + machine.axes[axis].limits.switch_distance),
      drive_(machine, axis, seed),
      truth_(truth),
      lower_limit_(machine.axes[axis].limits.min),
      upper_limit_(machine.axes[axis].limits.max),
      position_(machine.axes[axis].limits.start) {}

DeviceProfile DriveNode::profile() const { return profile_; }

// clang-format off
void DriveNode::declare(ObjectDictionary& objects) {
  using enum ObjectAccess;
  using enum ObjectType;
  const bool rotary = is_rotary(axis_);
  const char* const length = rotary ? "0.1 urad" : "0.1 um";
  const char* const speed = rotary ? "urad/s" : "um/s";
  const char* const acceleration = rotary ? "urad/s2" : "um/s2";
  const auto fixed = [](std::int64_t value) { return [value] { return value; }; };
  const auto position = [](double value) { return counts(value, kPositionCounts); };
  constexpr std::int64_t kMost = 0x7fffffff;
  const auto ok = SdoAbort::none;

  objects.add({0x603f, 0, "Error code", u16, read_only, "", [this] { return error_; }});
  objects.add({0x6040, 0, "Controlword", u16, read_only, "",  // commanded by PDO
               [this] { return command_.controlword; }});
  objects.add({0x6041, 0, "Statusword", u16, read_only, "", [this] { return statusword_; }});
  objects.add({0x605a, 0, "Quick stop option code", i16, read_write, "",
               [this] { return quick_stop_option_; },
               [this](std::int64_t v) {
                 if (v != kLeaveQuickStop && v != kStayInQuickStop) return SdoAbort::value;
                 if (state_ == cia402::State::quick_stop) return SdoAbort::device_state;
                 quick_stop_option_ = v;
                 return ok;
               }, kLeaveQuickStop, kStayInQuickStop});
  objects.add({0x605e, 0, "Fault reaction option code", i16, constant, "", fixed(2)});
  objects.add({0x6060, 0, "Modes of operation", i8, read_write, "", fixed(8),
               [](std::int64_t v) { return v == 8 ? ok : SdoAbort::value; }});
  objects.add({0x6061, 0, "Modes of operation display", i8, read_only, "", fixed(8)});
  objects.add({0x6062, 0, "Position demand value", i32, read_only, length,
               [this, position] { return position(drive_.position()); }});
  objects.add({0x6064, 0, "Position actual value", i32, read_only, length,
               [this, position] { return position(position_); }});
  objects.add({0x6065, 0, "Following error window", u32, read_write, length,
               [this, position] { return position(following_window_); },
               [this](std::int64_t v) { following_window_ = static_cast<double>(v) / kPositionCounts; return ok; },
               1, kMost});
  objects.add({0x6066, 0, "Following error time out", u16, read_write, "ms",
               [this] { return following_timeout_; },
               [this](std::int64_t v) { following_timeout_ = v; return ok; }});
  objects.add({0x606c, 0, "Velocity actual value", i32, read_only, speed,
               [this] { return counts(velocity_, kSpeedCounts); }});
  objects.add({0x6077, 0, "Torque actual value", i16, read_only, "0.001 of the limit",
               [this] { return counts(force_, 1e3); }});
  objects.add({0x607a, 0, "Target position", i32, read_only, length,  // commanded by PDO
               [this, position] { return position(command_.axes[axis_].position); }});
  objects.record(0x607d, "Software position limit", ObjectHead::Code::array);
  objects.add({0x607d, 1, "Min position limit", i32, constant, length, fixed(position(lower_limit_))});
  objects.add({0x607d, 2, "Max position limit", i32, constant, length, fixed(position(upper_limit_))});
  objects.add({0x607f, 0, "Max profile velocity", u32, constant, speed,
               fixed(counts(largest_velocity_ / kImplausible, kSpeedCounts))});
  objects.add({0x6085, 0, "Quick stop deceleration", u32, read_write, acceleration,
               [this] { return counts(quick_stop_deceleration_, kSpeedCounts); },
               [this](std::int64_t v) { quick_stop_deceleration_ = static_cast<double>(v) / kSpeedCounts; return ok; },
               1000, kMost});
  objects.record(0x60c2, "Interpolation time period");
  objects.add({0x60c2, 1, "Interpolation time period value", u8, constant, "", fixed(1)});
  objects.add({0x60c2, 2, "Interpolation time index", i8, constant, "power of ten, s", fixed(-3)});
  objects.add({0x60f4, 0, "Following error actual value", i32, read_only, length,
               [this, position] { return position(drive_.position() - position_); }});
  objects.add({0x60fd, 0, "Digital inputs", u32, read_only, "bit 0, 1: limit switch",
               [this] { return (position_ < lower_switch_ ? 1 : 0) | (position_ > upper_switch_ ? 2 : 0); }});
  objects.add({0x6502, 0, "Supported drive modes", u32, constant, "", fixed(0x80)});
}
// clang-format on

bool DriveNode::accepts(std::uint16_t cob_id) const {
  return cob_id == kCommandId || cob_id == kStatusBase + kOvertravelNode;
}

void DriveNode::read(Tick k, std::span<const Frame> inputs, Frames& out) {
  ++cycles_without_command_;
  ++cycles_without_overtravel_;
  for (const Frame& frame : inputs) {
    if (const auto command = decode_group_command(frame)) {
      if (!plausible(*command) || !is_fresh(*command, k)) continue;
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
  if (state_ == State::operation_enabled &&
      (tripped_ || command_lost || guard_lost || nc_unit_lost_)) {
    state_ = State::quick_stop;
    if (command_lost)
      tell(kCommandLostError, 0x11, 0, out);
    else if (guard_lost && !tripped_)  // the trip itself is reported by the overtravel module
      tell(kGuardLostError, 0x11, kOvertravelNode, out);
    return;
  }
  if (state_ == State::fault_reaction && !drive_.standing()) return;
  if (state_ == State::quick_stop && quick_stop_option_ == kLeaveQuickStop && drive_.standing())
    state_ = State::switch_on_disabled;
  else
    state_ = cia402::next_state(state_, command_.controlword, reset_edge);
  tell_reset(out);
}

void DriveNode::tell(std::uint16_t code, std::uint8_t error_register, std::uint8_t detail,
                     Frames& out) {
  error_ = code;
  out.push_back(encode(
      Emergency{.node = id(), .code = code, .error_register = error_register, .detail = {detail}}));
}

/// The error is gone as soon as the state it led to has been left.
void DriveNode::tell_reset(Frames& out) {
  using cia402::State;
  if (error_ == 0 || state_ == State::quick_stop || state_ == State::fault_reaction ||
      state_ == State::fault)
    return;
  error_ = 0;
  out.push_back(encode(Emergency{.node = id(), .code = kErrorReset}));
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
  tell(kOvercurrentError, 0x03, 0, out);
}

/// Whether the following error has been beyond its window for too long.
bool DriveNode::lags(const AxisCycle& cycle) {
  const bool beyond = std::abs(drive_.position() - cycle.measured) > following_window_;
  lagging_cycles_ = beyond ? lagging_cycles_ + 1 : 0;
  return lagging_cycles_ > following_timeout_;
}

/// Faults of the drive itself.
void DriveNode::watch(const AxisCycle& cycle, Frames& out) {
  using cia402::State;
  const bool beyond = cycle.measured < lower_switch_ || cycle.measured > upper_switch_;
  const bool hits_switch = beyond && !beyond_switch_;  // one may drive back from it
  beyond_switch_ = beyond;
  if (state_ != State::operation_enabled) {
    lagging_cycles_ = 0;
    return;
  }
  const bool lagging = lags(cycle);
  if (!lagging && !hits_switch) return;
  if (lagging) drive_.follow_up();
  state_ = State::fault_reaction;
  tell(lagging ? kFollowingErrorCode : kLimitSwitchError, 0x21, 0, out);
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
  read(k, inputs, out);
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
  statusword_ = statusword;
  velocity_ = (cycle.measured - position_) / kCycle;
  position_ = cycle.measured;
  force_ = cycle.force;
  out[first] = encode(DriveStatus{.node = id(),
                                  .tick = low16(k + 1),
                                  .statusword = statusword,
                                  .position = cycle.measured,
                                  .second_encoder = cycle.second,
                                  .force = cycle.force});
}

}  // namespace vcnc
