// What the NC unit keeps in its memory, so that an interrupted program can go on.
//
// Written when the program begins, at the power-fail signal, then every 20 ms while the axes come
// to rest and the probe is retracted, at each of these steps' ends, and when the program ends or
// stops in an alarm. `held` and `path_point` are known from the signal on, because the feed hold's
// course is: so a record of any moment after it is enough to resume.
//
// As bytes (little-endian; positions and times as IEEE 754 doubles):
//   1 version (1), 1 stage, 1 state and 1 cause of the protection, 4 number of the alarm, 8 cycle,
//   16 + 16 hashes of program and machine, 8 + 8 `held`, 5 x 8 position, 5 x 8 path_point,
//   3 x 8 deflection, 8 deflection of the protection, 2 + n the program's path
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/player.hpp"
#include "model/axes.hpp"
#include "model/machine.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {

enum class RunStage : std::uint8_t {
  none,        ///< no program has run
  running,     ///< the power-fail signal has not come
  holding,     ///< braking on the path
  held,        ///< at rest on the path
  retracting,  ///< the probe is being taken off
  retracted,   ///< off what it touched, waiting
  returning,   ///< on the way back to the path
  alarm,       ///< stopped in an alarm
  done         ///< came to its end
};

/// A program that was left so can go on.
constexpr bool resumable(RunStage stage) {
  return stage >= RunStage::holding && stage <= RunStage::returning;
}

using ContentHash = std::array<std::uint8_t, 16>;

/// XXH3 (128 bit, canonical).
ContentHash hash_of(std::string_view content);

struct NcRecord {
  RunStage stage = RunStage::none;
  std::string program;  ///< its absolute path
  ContentHash program_hash{}, machine_hash{};
  Tick cycle = 0;  ///< in which it was written
  ProgramTime held;
  AxisVector position{};           ///< of the axes, as measured
  AxisVector path_point{};         ///< where the program goes on
  Vec3 deflection = Vec3::Zero();  ///< of the probe
  int alarm = 0;                   ///< first one of the run, 0: none
  ProtectionLatch protection;      ///< of the NC unit's own check
};

std::vector<std::uint8_t> encode_record(const NcRecord& record);
/// Nothing for bytes that are no record, or hold a number that is none.
std::optional<NcRecord> decode_record(std::span<const std::uint8_t> bytes);

/// For people: "holding on the path".
const char* text_of(RunStage stage);

/// Where the axes stand when the machine is switched on again. A probe that still touched has been
/// driven off by hand by then, along its deflection: its counters begin at zero, so it has to be
/// free when it is switched on.
AxisVector position_at_switch_on(const Machine& machine, const NcRecord& record);
/// Whether it had to.
bool driven_off_by_hand(const Machine& machine, const NcRecord& record);

}  // namespace vcnc
