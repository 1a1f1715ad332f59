#include "diagnosis/search/unknown_force.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "diagnosis/replica/machine_replica.hpp"

namespace vcnc {
namespace {

constexpr int kRounds = 5;
constexpr double kReach = 5e-3;     // of the mean to either side [s]
constexpr double kStanding = 1e-4;  // of the highest speed
/// Part of the mean square of what the position is off that may be left; after one turn.
constexpr double kMostLeft = 0.8, kMostLeftAtFirst = 0.9;

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

/// Means of what is known of 2 reach + 1 samples.
std::vector<double> smooth(const std::vector<double>& series, std::size_t reach) {
  std::vector<double> result(series.size(), kMissing);
  double sum = 0, n = 0;
  const auto count = [&](std::size_t k, int by) {
    if (std::isfinite(series[k])) sum += by * series[k], n += by;
  };
  for (std::size_t k = 0; k < std::min(series.size(), reach); ++k) count(k, 1);
  for (std::size_t k = 0; k < series.size(); ++k) {
    if (k + reach < series.size()) count(k + reach, 1);
    if (k > reach) count(k - reach - 1, -1);
    if (std::isfinite(series[k])) result[k] = sum / n;
  }
  return result;
}

double mean_square(const std::vector<double>& series) {
  double sum = 0, n = 0;
  for (const double x : series)
    if (std::isfinite(x)) sum += x * x, n += 1;
  return n > 0 ? sum / n : 0;
}

/// Says nothing of where an axis is told to stand.
void leave_out_standing(const std::vector<double>& command, std::vector<double>& series) {
  std::vector<double> way(command.size(), 0.0);
  double most = 0;
  for (std::size_t k = 1; k + 1 < command.size(); ++k) {
    way[k] = std::abs(command[k + 1] - command[k - 1]);
    if (std::isfinite(way[k])) most = std::max(most, way[k]);
  }
  for (std::size_t k = 0; k < series.size(); ++k)
    if (!(way[k] > kStanding * most)) series[k] = kMissing;
}

/// Without readings of a probe, which take most of the time and tell nothing of forces.
Record of_drives(Record record) {
  std::erase_if(record.signals,
                [](const MeasuredSignal& s) { return s.kind == SignalKind::deflection; });
  return record;
}

bool has(const Replica& replica, SignalKind kind, std::size_t axis) {
  const std::vector<ComparedChannel>& all = replica.channels();
  return std::find(all.begin(), all.end(), ComparedChannel{kind, axis}) != all.end();
}

/// Of axes whose command, position and force are known, and no force beside that of the drive.
std::vector<std::size_t> told_axes(const Record& record, const Replica& replica) {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (record.find(SignalKind::command, axis) && has(replica, SignalKind::position, axis) &&
        has(replica, SignalKind::force, axis) && !record.find(SignalKind::applied_force, axis) &&
        !record.find(SignalKind::added_force, axis))
      axes.push_back(axis);
  return axes;
}

}  // namespace

void hold_over_gaps(std::vector<double>& series) {
  const auto first = std::find_if(series.begin(), series.end(), [](double x) { return x == x; });
  double last = first == series.end() ? 0 : *first;
  for (double& x : series) {
    if (std::isfinite(x)) last = x;
    x = last;
  }
}

ForceOfAxes unknown_force(const Record& healthy, const Machine& declared) {
  const Record record = of_drives(healthy);
  ForceOfAxes force, best;
  if (record.stretches.empty()) return best;
  MachineReplica replica(record, declared, std::nullopt);
  std::vector<std::size_t> axes = told_axes(record, replica);
  PerAxis<double> at_first{}, least{};
  const auto reach = static_cast<std::size_t>(std::round(kReach / record.period));
  for (int round = 0; round <= kRounds && !axes.empty(); ++round) {
    const Prediction predicted = replica.predict(declared);
    const auto off = [&](SignalKind kind, std::size_t axis) {
      const std::vector<ComparedChannel>& all = replica.channels();
      const auto channel = std::find(all.begin(), all.end(), ComparedChannel{kind, axis});
      std::vector<double> left = record.find(kind, axis)->value;
      const SharedSeries& yhat = predicted[static_cast<std::size_t>(channel - all.begin())];
      for (std::size_t k = 0; k < left.size(); ++k) left[k] -= yhat[k];
      take_means_of_laps(record.stretches, left);
      return left;
    };
    for (const std::size_t axis : axes) {
      const double now = mean_square(off(SignalKind::position, axis));
      if (round == 0) at_first[axis] = least[axis] = now;
      if (now < least[axis]) least[axis] = now, best[axis] = force[axis];
      std::vector<double> more = off(SignalKind::force, axis);
      leave_out_standing(record.find(SignalKind::command, axis)->value, more);
      more = smooth(more, reach);
      hold_over_gaps(more);
      force[axis].resize(more.size(), 0.0);
      for (std::size_t k = 0; k < more.size(); ++k) force[axis][k] -= more[k];
    }
    const double most = round == 0 ? 1 : round == kRounds ? kMostLeft : kMostLeftAtFirst;
    std::erase_if(axes, [&](std::size_t axis) {
      const bool no_force = least[axis] > most * at_first[axis];
      if (no_force) best[axis].clear(), force[axis].clear();
      return no_force;
    });
    if (round < kRounds) replica.apply(force);
  }
  return best;
}

}  // namespace vcnc
