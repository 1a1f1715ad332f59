#include "diagnosis/healthy/drive_misfit.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "model/axes.hpp"

namespace vcnc {
namespace {

/// Every sample within a lap becomes the mean of all laps that do the same.
void take_means_of_laps(const std::vector<Stretch>& stretches, std::vector<double>& series) {
  std::map<int, std::vector<const Stretch*>> conditions;
  for (const Stretch& s : stretches) conditions[s.condition].push_back(&s);
  std::vector<double> mean(series.size(), kMissing);
  for (const auto& [condition, laps] : conditions)
    for (const Stretch* lap : laps)
      for (std::size_t k = lap->begin; k < lap->end; ++k) {
        double sum = 0, n = 0;
        for (const Stretch* other : laps) {
          const double x = series[std::min(other->begin + (k - lap->begin), other->end - 1)];
          if (std::isfinite(x)) sum += x, n += 1;
        }
        if (n > 0) mean[k] = sum / n;
      }
  series = std::move(mean);
}

bool has(const Replica& replica, SignalKind kind, std::size_t axis) {
  const std::vector<ComparedChannel>& all = replica.channels();
  return std::find(all.begin(), all.end(), ComparedChannel{kind, axis}) != all.end();
}

}  // namespace

Record of_drives(Record record) {
  std::erase_if(record.signals, [](const MeasuredSignal& s) { return is_reading(s.kind); });
  return record;
}

std::vector<std::size_t> axes_with_forces(const Record& record, const Replica& replica) {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (record.find(SignalKind::command, axis) && has(replica, SignalKind::position, axis) &&
        has(replica, SignalKind::force, axis) && !record.find(SignalKind::applied_force, axis) &&
        !record.find(SignalKind::added_force, axis))
      axes.push_back(axis);
  return axes;
}

SeriesOfChannels off_in_laps(const Record& record, const std::vector<ComparedChannel>& channels,
                             const Prediction& predicted) {
  SeriesOfChannels off;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    off.push_back(record.find(channels[c].kind, channels[c].axis)->value);
    for (std::size_t k = 0; k < off[c].size(); ++k) off[c][k] -= predicted[c][k];
    take_means_of_laps(record.stretches, off[c]);
  }
  return off;
}

std::size_t channel_of(const std::vector<ComparedChannel>& channels, SignalKind kind,
                       std::size_t axis) {
  return static_cast<std::size_t>(
      std::find(channels.begin(), channels.end(), ComparedChannel{kind, axis}) - channels.begin());
}

}  // namespace vcnc
