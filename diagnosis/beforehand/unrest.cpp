#include "diagnosis/beforehand/unrest.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

constexpr double kStands = 0.1;        // [s] from when on
constexpr double kMean = 0.021;        // [s]
constexpr std::size_t kEnough = 1000;  // samples
constexpr double kPartOfOff = 0.1;     // of what is off, see the header

/// RMS of a signal of an axis less its moving mean while the axis has stood for a while.
std::optional<double> at_rest(const Record& record, std::size_t axis,
                              const std::vector<double>& series) {
  const MeasuredSignal* command = record.find(SignalKind::command, axis);
  if (!command) return {};
  const std::vector<double>& q = command->value;
  const auto before = static_cast<std::size_t>(kStands / record.period),
             reach = static_cast<std::size_t>(std::max(1.0, 0.5 * kMean / record.period));
  const auto width = static_cast<double>(2 * reach + 1);
  double squares = 0, count = 0, sum = 0;
  std::size_t stood = 0, known = 0;  // samples so far, up to the end of the window
  for (std::size_t k = 0; k < series.size(); ++k) {
    stood = k > 0 && q[k] == q[k - 1] ? stood + 1 : 0;
    const bool good = std::isfinite(series[k]);
    sum = good ? sum + series[k] : 0;
    known = good ? known + 1 : 0;
    if (known > 2 * reach + 1) sum -= series[k - 2 * reach - 1];
    if (known < 2 * reach + 1 || stood < before) continue;
    const double off = series[k - reach] - sum / width;
    squares += off * off;
    count += 1;
  }
  if (count < static_cast<double>(kEnough)) return {};
  return std::sqrt(squares / count);
}

/// Of a signal while the axis is told to move; empty where that is not known.
std::vector<double> in_motion(const Evidence& evidence, std::size_t axis,
                              std::vector<double> series) {
  const MeasuredSignal* command = evidence.record().find(SignalKind::command, axis);
  if (!command) return {};
  const std::vector<double>& q = command->value;
  for (std::size_t k = 0; k < series.size(); ++k)
    if (k == 0 || q[k] == q[k - 1]) series[k] = kMissing;
  return series;
}

double rms_of_known(const std::vector<double>& series) {
  double squares = 0, count = 0;
  for (const double x : series)
    if (std::isfinite(x)) squares += x * x, ++count;
  return count > 0 ? std::sqrt(squares / count) : 0;
}

/// Of series that are found by their channel.
template <class Series>
std::vector<Unrest> unrest_of_each(const Evidence& evidence, Series&& series_of) {
  const std::vector<ComparedChannel>& channels = evidence.replica().channels();
  std::vector<Unrest> all;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const std::size_t axis = channels[c].axis;
    if (!is_of_drive(channels[c], axis)) continue;
    std::vector<double> series = series_of(c);
    const std::vector<double>& declared = evidence.declared()[c];
    for (std::size_t k = 0; k < series.size(); ++k) series[k] -= declared[k];
    for (const LapEvent& e : evidence.events())
      if (e.axis == axis)
        std::fill(series.begin() + static_cast<std::ptrdiff_t>(e.begin),
                  series.begin() + static_cast<std::ptrdiff_t>(e.end), kMissing);
    const std::vector<double> moving = in_motion(evidence, axis, series);
    const std::optional<double> scatter =
        moving.empty() ? std::nullopt : lap_scatter(evidence.partition(), moving);
    const double off = rms_of_known(moving);
    all.push_back({channels[c], false, scatter, off});
    all.push_back({channels[c], true, at_rest(evidence.record(), axis, series), off});
  }
  return all;
}

}  // namespace

bool is_part_of_what_is_off(double rms, double off) { return rms < kPartOfOff * off; }

bool is_of_drive(const ComparedChannel& channel, std::size_t axis) {
  return channel.axis == axis &&
         (channel.kind == SignalKind::position || channel.kind == SignalKind::force);
}

std::vector<Unrest> unrest_of(const Evidence& evidence) {
  return unrest_of_each(evidence, [&](std::size_t c) -> const std::vector<double>& {
    const ComparedChannel& channel = evidence.replica().channels()[c];
    return evidence.record().find(channel.kind, channel.axis)->value;
  });
}

HealthyNoise healthy_noise(const Evidence& evidence) {
  HealthyNoise healthy{evidence.noise().lines, unrest_of(evidence)};
  const std::vector<ComparedChannel>& channels = evidence.replica().channels();
  for (Unrest& u : healthy.unrest)
    for (std::size_t c = 0; c < channels.size(); ++c)
      if (channels[c] == u.channel && u.rms)
        u.rms = std::max(*u.rms, evidence.noise().channels[c].rms);
  return healthy;
}

std::vector<Unrest> unrest_of(const Evidence& evidence, const Prediction& prediction) {
  return unrest_of_each(evidence,
                        [&](std::size_t c) -> const std::vector<double>& { return prediction[c]; });
}

std::optional<double> shift_between_laps(const Evidence& evidence, const Prediction& prediction,
                                         std::size_t channel) {
  const auto& [kind, axis] = evidence.replica().channels()[channel];
  const std::vector<double>& measured = evidence.record().find(kind, axis)->value;
  double squares = 0, conditions = 0;
  for (const std::vector<Stretch>& laps : evidence.partition().repetitions()) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const Stretch& lap : laps) {
      double sum = 0, count = 0;
      for (std::size_t k = lap.begin; k < lap.end; ++k) {
        const double off = measured[k] - prediction[channel][k];
        if (std::isfinite(off)) sum += off, ++count;
      }
      if (count == 0) continue;
      low = std::min(low, sum / count);
      high = std::max(high, sum / count);
    }
    if (!(high > low)) continue;
    squares += (high - low) * (high - low);
    ++conditions;
  }
  if (conditions == 0) return {};
  return std::sqrt(squares / conditions);
}

}  // namespace vcnc
