// The drive state machine of CiA 402 as pure functions of controlword and statusword.
#pragma once

#include <cstdint>

namespace vcnc::cia402 {

enum class State : std::uint8_t {
  not_ready,
  switch_on_disabled,
  ready,
  switched_on,
  operation_enabled,
  quick_stop,
  fault_reaction,
  fault
};

// Controlwords
inline constexpr std::uint16_t kDisableVoltage = 0x00, kQuickStop = 0x02, kShutdown = 0x06,
                               kSwitchOn = 0x07, kEnable = 0x0f, kFaultReset = 0x80;
// Extra status bits
inline constexpr std::uint16_t kWarning = 0x80, kRemote = 0x200, kTargetReached = 0x400,
                               kInternalLimit = 0x800, kFollowsCommand = 0x1000,
                               kFollowingError = 0x2000;
inline constexpr std::uint16_t kLocked = 0x4000;  ///< ours: the spindle's lock is latched

/// State shown by a statusword (object 6041h).
constexpr State state_of(std::uint16_t sw) {
  switch (sw & 0x4f) {
    case 0x00:
      return State::not_ready;
    case 0x40:
      return State::switch_on_disabled;
    case 0x0f:
      return State::fault_reaction;
    case 0x08:
      return State::fault;
    default:
      break;
  }
  switch (sw & 0x6f) {
    case 0x21:
      return State::ready;
    case 0x23:
      return State::switched_on;
    case 0x27:
      return State::operation_enabled;
    case 0x07:
      return State::quick_stop;
    default:
      return State::not_ready;
  }
}

/// Statusword bits 0..6 that show a state.
constexpr std::uint16_t statusword_of(State s) {
  switch (s) {
    case State::not_ready:
      return 0x00;
    case State::switch_on_disabled:
      return 0x40;
    case State::ready:
      return 0x31;
    case State::switched_on:
      return 0x33;
    case State::operation_enabled:
      return 0x37;
    case State::quick_stop:
      return 0x17;
    case State::fault_reaction:
      return 0x1f;
    case State::fault:
      return 0x18;
  }
  return 0;
}

/// Next state for a controlword (object 6040h). `standing`: the axis has come to rest, which ends a
/// quick stop (quick-stop option 6: stay in quick-stop active until voltage is disabled).
/// A fault is left only on a rising edge of bit 7, which the caller detects as `reset_edge`.
constexpr State next_state(State s, std::uint16_t cw, bool reset_edge) {
  const bool voltage = cw & 0x02, no_quick_stop = cw & 0x04;
  switch (s) {
    case State::not_ready:
      return State::switch_on_disabled;
    case State::fault_reaction:
      return State::fault;
    case State::fault:
      return reset_edge ? State::switch_on_disabled : State::fault;
    case State::quick_stop:
      return voltage ? State::quick_stop : State::switch_on_disabled;
    default:
      break;
  }
  if (!voltage) return State::switch_on_disabled;
  if (!no_quick_stop)
    return s == State::operation_enabled ? State::quick_stop : State::switch_on_disabled;
  const int level = (cw & 0x01) ? ((cw & 0x08) ? 3 : 2) : 1;  // shutdown, switch on, enable
  switch (s) {
    case State::switch_on_disabled:
      return level == 1 ? State::ready : s;
    case State::ready:
      return level >= 2 ? State::switched_on : s;
    case State::switched_on:
      return level == 3 ? State::operation_enabled : level == 1 ? State::ready : s;
    case State::operation_enabled:
      return level == 2 ? State::switched_on : level == 1 ? State::ready : s;
    default:
      return s;
  }
}

}  // namespace vcnc::cia402
