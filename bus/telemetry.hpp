// What the machine's sampling interface tells a PC: one row per cycle, and what frames a run.
//
// The NC unit collects, for one and the same instant t_k, the commanded positions, the measured
// positions and the probe's deflection (see NcUnit), and hands them to a TelemetrySink. A sink is a
// recording or analysis in the same process, or the DDS publisher (bus/dds/).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bus/tick.hpp"

namespace vcnc {

/// One instant. Plain numbers in SI units; kChannels names each of them.
struct TelemetryRow {
  double tick = 0;                     ///< instant t = tick * 1 ms, exact integer
  double line = 0;                     ///< program line being executed
  double state = 0;                    ///< NcState
  double feed = 0;                     ///< commanded tool-tip speed [m/s]
  std::array<double, 5> q_cmd{};       ///< commanded axis positions [m, rad]
  std::array<double, 5> q_act{};       ///< measured axis positions [m, rad]
  std::array<double, 5> q_second{};    ///< load minus motor side [m, rad]
  std::array<double, 5> force{};       ///< share of the force limit
  std::array<double, 3> deflection{};  ///< probe frame [m]
  std::array<double, 6> adc{};         ///< raw sin/cos codes
  double probe_flags = 0;              ///< ProbeSample::Flag
  double overtravel = 0;               ///< OvertravelState::State
  double spindle_speed = 0;            ///< [rad/s]
  double bus_load = 0;                 ///< share of the cycle the bus was busy
};

inline constexpr std::size_t kRowWidth = sizeof(TelemetryRow) / sizeof(double);

struct Channel {
  std::string_view name, unit;
};
/// Name and unit of each number of a TelemetryRow, in order.
extern const std::array<Channel, kRowWidth> kChannels;

/// NC states as they appear in TelemetryRow::state.
enum class NcState : int { starting = 0, running = 1, hold = 2, dwell = 3, alarm = 4, done = 5 };

struct Alarm {
  Tick tick = 0;
  int code = 0;
  std::string source;  ///< node or part that raised it
  std::string text;
};

/// What is known when a run begins.
struct RunBegin {
  std::string run_id;  ///< unique per run
  std::string program_name;
  std::string declared_toml;  ///< the declared machine, resolved, as TOML
  std::string piece_toml;     ///< the workpiece as TOML; empty: none
  std::uint64_t seed = 0;
};

/// What is known when it ends. The defaults say "interrupted".
struct RunEnd {
  bool complete = false;  ///< the program came to its end
  std::string reason = "interrupted";
  std::int64_t cycles = 0;
  std::string trace_hash;     ///< over every frame of every cycle
  double wall_seconds = 0;    ///< host time; never part of a result
  double bus_load_worst = 0;  ///< largest share of a cycle the bus was busy
  std::uint64_t gaps = 0;     ///< rows that were lost on the way, or frames lost on the bus
};

class TelemetrySink {
 public:
  virtual ~TelemetrySink() = default;
  virtual void begin(const RunBegin&) = 0;
  virtual void row(const TelemetryRow&) = 0;
  virtual void alarm(const Alarm&) = 0;
  virtual void end(const RunEnd&) = 0;
};

}  // namespace vcnc
