#include "diagnosis/healthy/unknown_force.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "diagnosis/healthy/drive_misfit.hpp"
#include "diagnosis/records/series.hpp"
#include "diagnosis/replica/machine_replica.hpp"

namespace vcnc {
namespace {

constexpr int kForceRounds = 4;
constexpr double kReach = 5e-3;     // of the mean to either side [s]
constexpr double kStanding = 1e-4;  // of the highest speed
/// Of mean squares: what is missing must be of its noise, what may be left of it in the end, and
/// what after a turn is no progress.
constexpr double kLeastOfNoise = 10, kMostForceLeft = 0.5, kLeastProgress = 0.8;

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

/// The force that is missing for an axis to move as it did.
struct Balance {
  std::vector<double> missing;  ///< as it is taken off a force on the load; held over gaps
  double noise = 0;             ///< mean square of what noise makes of it
};

Balance balance(const Record& record, const std::vector<ComparedChannel>& channels,
                const SeriesOfChannels& off, const Machine& declared, std::size_t axis) {
  const auto reach = static_cast<std::size_t>(std::round(kReach / record.period));
  std::vector<double> force = off[channel_of(channels, SignalKind::force, axis)];
  const std::vector<double>& position = off[channel_of(channels, SignalKind::position, axis)];
  leave_out_standing(record.find(SignalKind::command, axis)->value, force);
  const double inertia = declared.axes[axis].mechanics.total_inertia(),
               n = static_cast<double>(2 * reach + 1),
               of_way = inertia / std::pow(n * record.period, 2);
  Balance result;
  result.noise = mean_square_off_mean(force, reach) / n +
                 6 * of_way * of_way * mean_square_off_mean(position, reach);
  const std::vector<double> gained = second_derivative(position, record.period);
  for (std::size_t k = 0; k < gained.size(); ++k) force[k] -= inertia * gained[k];
  result.missing = moving_mean(moving_mean(force, reach), reach);
  hold_over_gaps(result.missing);
  return result;
}

}  // namespace

ForceOfAxes unknown_force(const Record& healthy, const Machine& declared) {
  const Record record = of_drives(healthy);
  ForceOfAxes force, best;
  if (record.stretches.empty()) return best;
  MachineReplica replica(record, declared, std::nullopt);
  std::vector<std::size_t> axes = axes_with_forces(record, replica);
  PerAxis<double> at_first{}, least{};
  for (int round = 0; round <= kForceRounds && !axes.empty(); ++round) {
    replica.apply(force);
    const SeriesOfChannels off_now =
        off_in_laps(record, replica.channels(), replica.predict(declared));
    std::erase_if(axes, [&](std::size_t axis) {
      const Balance now = balance(record, replica.channels(), off_now, declared, axis);
      const double off = mean_square(now.missing);
      if (round == 0) at_first[axis] = least[axis] = off;
      const bool no_more =
          round == 0 ? off < kLeastOfNoise * now.noise : off > kLeastProgress * least[axis];
      if (off < least[axis]) least[axis] = off, best[axis] = force[axis];
      if (no_more) return true;
      force[axis].resize(record.samples(), 0.0);
      for (std::size_t k = 0; k < now.missing.size(); ++k) force[axis][k] -= now.missing[k];
      return false;
    });
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      if (std::find(axes.begin(), axes.end(), axis) == axes.end()) force[axis] = best[axis];
  }
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (least[axis] > kMostForceLeft * at_first[axis]) best[axis].clear();
  return best;
}

}  // namespace vcnc
