// Every alarm of the machine: number, text, cause, remedy. `vcnc alarms` prints the table.
//
//   1xxx  probe and overtravel protection
//   2xxx  drives
//   3xxx  bus and modules
//   4xxx  mains and supply
//   5xxx  program and operator
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace vcnc {

enum class AlarmCode {
  overtravel_hard = 1001,
  overtravel_hard_nc = 1002,
  overtravel_soft = 1003,
  overtravel_soft_nc = 1004,
  drive_left_operation = 2001,
  drives_not_enabled = 2002,
  following_error = 2101,
  limit_switch = 2102,
  command_lost = 2103,
  overtravel_module_lost = 2104,
  drive_fault = 2105,
  spindle_locked = 2201,
  module_emergency = 3001,
  communication_disturbed = 3101,
  frames_lost = 3102,
  bus_overloaded = 3103,
  module_gone = 3201,
  module_silent = 3202,
  heartbeat_lost = 3203,
  mains_lost = 4001,
  mains_back = 4002,
  supply_exhausted = 4003,
  secured = 4004,
  resumed = 4005,
  program_refused = 5001,
  probe_no_contact = 5002,
  probe_at_begin = 5003,
};

struct AlarmText {
  AlarmCode code;
  const char* title;
  const char* cause;
  const char* remedy;
};

/// All alarms by ascending number.
std::span<const AlarmText> alarm_texts();
/// The text of one; every code has one.
const AlarmText& alarm_text(AlarmCode code);

/// The alarm that an emergency message stands for; `detail` is its first byte of detail.
AlarmCode alarm_of_emergency(std::uint16_t code, std::uint8_t detail = 0);

/// The table as Markdown.
std::string alarms_markdown();

}  // namespace vcnc
