#include "servo_sim/spindle_node.hpp"

#include "bus/heartbeat.hpp"
#include "bus/object_dictionary.hpp"
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

constexpr std::uint8_t kLatchVersion = 1;

}  // namespace

std::vector<std::uint8_t> encode_spindle_lock(bool locked) {
  return {kLatchVersion, static_cast<std::uint8_t>(locked)};
}

std::optional<bool> decode_spindle_lock(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != 2 || bytes[0] != kLatchVersion || bytes[1] > 1) return std::nullopt;
  return bytes[1] == 1;
}

SpindleNode::SpindleNode(const Machine& machine, NodeMemory* memory)
    : params_(machine.spindle),
      profile_{kSpindleDrive, kSpindleDriveProduct, heartbeat_cycles(machine.bus.heartbeat_time)},
      drive_(machine.spindle),
      memory_(memory) {
  if (memory_ == nullptr) return;
  const std::vector<std::uint8_t> kept = memory_->load();
  if (kept.empty()) return;
  const std::optional<bool> locked = decode_spindle_lock(kept);
  if (!locked) refuse_state("spindle");
  locked_ = kept_locked_ = *locked;
}

/// Keeps the latch where it has changed.
void SpindleNode::remember() {
  if (memory_ == nullptr || locked_ == kept_locked_) return;
  memory_->save(encode_spindle_lock(locked_));
  kept_locked_ = locked_;
}

// clang-format off
void SpindleNode::declare(ObjectDictionary& objects) {
  using enum ObjectAccess;
  using enum ObjectType;
  const auto fixed = [](std::int64_t value) { return [value] { return value; }; };
  objects.add({0x2100, 0, "Locked", boolean, read_only, "", [this] { return locked_ ? 1 : 0; }});
  objects.add({0x2101, 0, "Orientation angle of M19", i32, constant, "0.1 urad",
               fixed(counts(params_.orient_angle, 1e7))});
  objects.add({0x603f, 0, "Error code", u16, read_only, "", [this] { return error_; }});
  objects.add({0x6040, 0, "Controlword", u16, read_only, "", [this] { return command_.controlword; }});
  objects.add({0x6041, 0, "Statusword", u16, read_only, "", [this] { return statusword_; }});
  objects.add({0x6060, 0, "Modes of operation", i8, read_write, "", fixed(9),
               [](std::int64_t v) { return v == 9 ? SdoAbort::none : SdoAbort::value; }});
  objects.add({0x6061, 0, "Modes of operation display", i8, read_only, "", fixed(9)});
  objects.add({0x6064, 0, "Position actual value", i32, read_only, "0.1 urad",
               [this] { return counts(now_.angle, 1e7); }});
  objects.add({0x606c, 0, "Velocity actual value", i32, read_only, "mrad/s",
               [this] { return counts(now_.speed, 1e3); }});
  objects.add({0x607f, 0, "Max profile velocity", u32, constant, "mrad/s",
               fixed(counts(params_.max_speed, 1e3))});
  objects.add({0x60ff, 0, "Target velocity", i32, read_only, "mrad/s",
               [this] { return counts(command_.spindle_speed, 1e3); }});
  objects.add({0x6502, 0, "Supported drive modes", u32, constant, "", fixed(0x100)});
}
// clang-format on

bool SpindleNode::accepts(std::uint16_t cob_id) const {
  return cob_id == kCommandId || cob_id == kStatusBase + kOvertravelNode;
}

/// Tells once, in the cycle in which the silence becomes too long.
void SpindleNode::lock_if_silent(Frames& out) {
  const bool command_lost = commanded_ && cycles_without_command_ > kSilentCyclesAllowed;
  const bool guard_lost = guarded_ && cycles_without_overtravel_ > kSilentCyclesAllowed;
  if (!command_lost && !guard_lost && !nc_unit_lost_) return;
  if (!locked_ && (command_lost || guard_lost)) {
    error_ = guard_lost ? kGuardLostError : kCommandLostError;
    Emergency emergency{.node = id(), .code = error_, .error_register = 0x11};
    if (guard_lost) emergency.detail[0] = kOvertravelNode;
    out.push_back(encode(emergency));
  }
  locked_ = true;
}

void SpindleNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  const std::size_t first = out.size();
  out.emplace_back();  // the cyclic frame comes first; filled in below
  ++cycles_without_command_;
  ++cycles_without_overtravel_;
  bool pressed = false;
  for (const Frame& frame : inputs) {
    if (const auto command = decode_group_command(frame)) {
      if (!is_finite(*command) || !is_fresh(*command, k)) continue;
      command_ = *command;
      commanded_ = true;
      cycles_without_command_ = 0;
      pressed = (command->flags & kResetLatch) != 0;
    } else if (const auto overtravel = decode_overtravel_state(frame)) {
      guarded_ = true;
      cycles_without_overtravel_ = 0;
      tripped_ = overtravel->state >= OvertravelState::State::soft_stop;
    }
  }
  const bool reset = reset_.step(pressed);
  const bool asked_to_lock = (command_.flags & kSpindleLock) != 0;
  if (tripped_ || asked_to_lock)
    locked_ = true;
  else if (reset)
    locked_ = false;
  lock_if_silent(out);
  remember();
  if (!locked_ && error_ != 0) {
    error_ = 0;
    out.push_back(encode(Emergency{.node = id(), .code = kErrorReset}));
  }

  // The locked spindle stays in operation: it brakes and holds, but takes no mode.
  const bool stays = locked_ && state_ == cia402::State::operation_enabled;
  state_ = cia402::next_state(state_, stays ? cia402::kEnable : command_.controlword, false);
  const bool enabled = state_ == cia402::State::operation_enabled && !locked_;
  const SpindleCycle cycle = drive_.step(
      enabled ? mode_of(command_.spindle_mode) : SpindleMode::off, command_.spindle_speed);

  std::uint16_t statusword = cia402::statusword_of(state_) | cia402::kRemote;
  if (locked_ || cycle.limited) statusword |= cia402::kInternalLimit;
  if (locked_) statusword |= cia402::kLocked;
  if (cycle.at_speed || cycle.oriented) statusword |= cia402::kTargetReached;
  statusword_ = statusword;
  now_ = cycle;
  out[first] = encode(DriveStatus{.node = id(),
                                  .tick = low16(k + 1),
                                  .statusword = statusword,
                                  .position = cycle.angle,
                                  .second_encoder = cycle.speed});
}

}  // namespace vcnc
