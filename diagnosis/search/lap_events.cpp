#include "diagnosis/search/lap_events.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace vcnc {
namespace {

constexpr double kEvent = 40, kFaded = 4;  // times what laps usually differ by
constexpr double kClip = 8;                // of the same, not usual any more
constexpr double kMost = 0.02;             // of all samples
constexpr double kEventReach = 0.05;       // [s]
constexpr int kClippings = 10;

/// Laps of one condition, and how far the one that differs most from their mean is off it.
struct Repeated {
  std::vector<Stretch> laps;
  std::vector<double> off;
};

std::vector<Repeated> repeated(const Partition& partition, const std::vector<double>& series) {
  std::vector<Repeated> all;
  for (const std::vector<Stretch>& of : partition.repetitions()) {
    Repeated& r = all.emplace_back(Repeated{of, {}});
    for (std::size_t k = 0; k < of.front().end - of.front().begin; ++k) {
      double mean = 0, most = 0;
      for (const Stretch& s : of) mean += series[s.begin + k] / static_cast<double>(of.size());
      for (const Stretch& s : of) most = std::max(most, std::abs(series[s.begin + k] - mean));
      r.off.push_back(std::isnan(mean) ? kMissing : most);
    }
  }
  return all;
}

/// RMS of what is no more than kClip times it.
double usual(const std::vector<Repeated>& laps) {
  double limit = std::numeric_limits<double>::infinity(), rms = 0;
  for (int i = 0; i < kClippings; ++i) {
    double sum = 0, n = 0;
    for (const Repeated& r : laps)
      for (const double d : r.off)
        if (d <= limit) sum += d * d, n += 1;
    rms = n > 0 ? std::sqrt(sum / n) : 0;
    if (kClip * rms >= limit) break;
    limit = kClip * rms;
  }
  return rms;
}

/// [begin, end) within a lap: about each sample beyond `event`, as far as `faded` is exceeded with
/// gaps of `reach` at most, and `reach` more.
std::vector<std::pair<std::size_t, std::size_t>> events(const std::vector<double>& off,
                                                        double event, double faded,
                                                        std::size_t reach) {
  std::vector<std::pair<std::size_t, std::size_t>> all;
  for (std::size_t k = 0; k < off.size(); ++k) {
    if (!(off[k] > event)) continue;
    std::size_t first = k, last = k;
    for (std::size_t i = k; i-- > 0 && first - i <= reach;)
      if (off[i] > faded) first = i;
    for (std::size_t i = k; i < off.size() && i - last <= reach; ++i)
      if (off[i] > faded) last = i;
    all.emplace_back(first > reach ? first - reach : 0, std::min(off.size(), last + reach + 1));
    k = last;
  }
  return all;
}

}  // namespace

std::vector<LapEvent> lap_events(const Partition& partition, double period,
                                 const std::vector<ComparedChannel>& channels,
                                 const SeriesOfChannels& difference) {
  const auto reach = static_cast<std::size_t>(std::round(kEventReach / period));
  std::vector<LapEvent> all;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (channels[c].kind == SignalKind::deflection) continue;
    const std::vector<Repeated> laps = repeated(partition, difference[c]);
    const double rms = usual(laps);
    if (!(rms > 0)) continue;
    std::size_t samples = 0, within = 0;
    std::vector<LapEvent> found;
    for (const Repeated& r : laps) {
      samples += r.off.size();
      for (const auto& [begin, end] : events(r.off, kEvent * rms, kFaded * rms, reach)) {
        within += end - begin;
        for (const Stretch& lap : r.laps)
          found.push_back({channels[c].axis, lap.begin + begin, lap.begin + end});
      }
    }
    if (static_cast<double>(within) > kMost * static_cast<double>(samples)) continue;
    all.insert(all.end(), found.begin(), found.end());
  }
  std::sort(all.begin(), all.end(), [](const LapEvent& x, const LapEvent& y) {
    return std::tie(x.axis, x.begin, x.end) < std::tie(y.axis, y.begin, y.end);
  });
  // Of several channels: one event.
  std::vector<LapEvent> merged;
  for (const LapEvent& e : all) {
    if (!merged.empty() && merged.back().axis == e.axis && e.begin <= merged.back().end)
      merged.back().end = std::max(merged.back().end, e.end);
    else
      merged.push_back(e);
  }
  return merged;
}

}  // namespace vcnc
