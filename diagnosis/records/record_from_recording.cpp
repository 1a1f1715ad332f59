#include "diagnosis/records/record_from_recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bus/tick.hpp"
#include "configs/config.hpp"
#include "diagnosis/records/stretches.hpp"
#include "model/probe/signals.hpp"

namespace vcnc {
namespace {

constexpr double kPositionStep = 1e-10;  // [m or rad] in which positions travel on the bus
constexpr double kForceStep = 1e-4;      // share of the limit
constexpr std::size_t kBeforeAlarm = 3;  // cycles between a fault and the state it leads to

/// Signals in the order of the axes, one sample per tick.
class RecordBuilder {
 public:
  explicit RecordBuilder(const Machine& machine) : machine_(machine), adc_{machine.probe.adc_bits} {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const std::string name(kAxisNames[i]);
      const double limit = machine.axes[i].mechanics.force_limit;
      add(SignalKind::command, i, "q_cmd." + name, kPositionStep);
      add(SignalKind::position, i, "q_act." + name, kPositionStep);
      add(SignalKind::twist, i, "q_second." + name, kPositionStep);
      add(SignalKind::force, i, "force." + name, kForceStep * limit);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const std::string name(1, "xyz"[c]);
      add(SignalKind::deflection, c, "deflection." + name, kPositionStep);
      add(SignalKind::cosine, c, "adc." + name + "_cos", adc_.lsb() / Adc::kGain);
      add(SignalKind::sine, c, "adc." + name + "_sin", adc_.lsb() / Adc::kGain);
    }
  }

  /// False: nothing is taken any more.
  bool take(const TelemetryRow& row) {
    const auto tick = static_cast<std::size_t>(row.tick);
    if (row.state == static_cast<double>(static_cast<int>(NcState::alarm))) {
      resize(std::max(samples_, kBeforeAlarm) - kBeforeAlarm);
      return false;
    }
    if (tick < samples_) return true;  // a row told twice
    missing_ += tick - samples_;
    resize(tick + 1);
    std::size_t s = 0;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      set(s++, row.q_cmd[i]);
      set(s++, row.q_act[i]);
      set(s++, row.q_second[i]);
      set(s++, row.force[i] * machine_.axes[i].mechanics.force_limit);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      set(s++, row.deflection[c]);
      set(s++, adc_.signal(static_cast<std::uint16_t>(row.adc[2 * c])));
      set(s++, adc_.signal(static_cast<std::uint16_t>(row.adc[2 * c + 1])));
    }
    return true;
  }

  Record record;
  std::size_t missing() const { return missing_; }

 private:
  void add(SignalKind kind, std::size_t axis, std::string source, double resolution) {
    record.signals.push_back({kind, axis, std::move(source), {}, resolution});
  }
  void resize(std::size_t samples) {
    samples_ = samples;
    for (MeasuredSignal& signal : record.signals) signal.value.resize(samples, kMissing);
  }
  void set(std::size_t signal, double value) { record.signals[signal].value.back() = value; }

  const Machine& machine_;
  Adc adc_;
  std::size_t samples_ = 0, missing_ = 0;
};

Record finished(RecordBuilder& builder, const RunBegin& begin, const std::vector<Alarm>& alarms,
                bool cut) {
  Record record = std::move(builder.record);
  record.period = kCycle;
  record.machine_toml = begin.declared_toml;
  record.piece_toml = begin.piece_toml;
  for (const Alarm& alarm : alarms)
    record.warnings.push_back(fmt::format("alarm {} of {} at {:.3f} s: {}", alarm.code,
                                          alarm.source, seconds(alarm.tick), alarm.text));
  if (cut)
    record.warnings.push_back(
        fmt::format("the machine was stopped by an alarm: only the first {:.3f} s are used",
                    static_cast<double>(record.samples()) * kCycle));
  if (builder.missing() > 0)
    record.warnings.push_back(fmt::format("{} rows are missing", builder.missing()));
  record.stretches = stretches_of(record);
  return record;
}

}  // namespace

Record record_from(const RecordingReader& recording) {
  const RunBegin& begin = recording.begin();
  const Machine machine = parse_machine(begin.declared_toml, recording.path().string());
  RecordBuilder builder(machine);
  bool going_on = true;
  recording.for_each([&](const TelemetryRow& row) { going_on = going_on && builder.take(row); });
  Record record = finished(builder, begin, recording.alarms(), !going_on);
  record.source = recording.path().string();
  for (const std::string& part : recording.missing())
    record.warnings.push_back("the recording is not whole: " + part);
  if (record.samples() < 2)
    throw RecordingError(record.source + ": holds no motion before the machine was stopped");
  return record;
}

Record record_from(const RunBegin& begin, const std::vector<TelemetryRow>& rows,
                   const std::vector<Alarm>& alarms) {
  const Machine machine = parse_machine(begin.declared_toml, begin.run_id);
  RecordBuilder builder(machine);
  const bool whole = std::all_of(rows.begin(), rows.end(),
                                 [&](const TelemetryRow& row) { return builder.take(row); });
  Record record = finished(builder, begin, alarms, !whole);
  record.source = begin.run_id;
  return record;
}

}  // namespace vcnc
