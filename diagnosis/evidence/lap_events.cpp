#include "diagnosis/evidence/lap_events.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <tuple>

#include "diagnosis/evidence/noise_audit.hpp"

namespace vcnc {
namespace {

constexpr double kEvent = 40, kFaded = 4;  // times what laps usually differ by
constexpr double kClip = 8;                // of the same, not usual any more
constexpr double kMostSamples = 0.02;      // of all samples
constexpr double kMostOfOneLap = 0.1;      // of the same, where the other laps agree
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

/// RMS of what is no more than kClip times it, of no more than `limit` to begin with.
double usual(const std::vector<Repeated>& laps,
             double limit = std::numeric_limits<double>::infinity()) {
  double rms = 0;
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

/// The same however much a fifth of the laps is off.
double usual_of_most(const std::vector<Repeated>& laps) {
  constexpr double kMostLaps = 0.75;
  std::vector<double> known;
  for (const Repeated& r : laps)
    std::copy_if(r.off.begin(), r.off.end(), std::back_inserter(known),
                 [](double d) { return std::isfinite(d); });
  if (known.empty()) return 0;
  const auto at = known.begin() +
                  static_cast<std::ptrdiff_t>(kMostLaps * static_cast<double>(known.size() - 1));
  std::nth_element(known.begin(), at, known.end());
  return usual(laps, kClip * *at);
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

/// The one that differs from all others over part of the laps, which agree within `agree` or a
/// tenth of that; none where there are but two of them.
std::optional<Stretch> only_lap(const std::vector<Stretch>& laps, const std::vector<double>& series,
                                std::size_t begin, std::size_t end, double agree) {
  constexpr double kAgree = 0.1;
  if (laps.size() < 3) return {};
  const auto others = static_cast<double>(laps.size() - 1);
  for (const Stretch& alone : laps) {
    double off = 0, of_others = 0;
    for (std::size_t k = begin; k < end; ++k) {
      double mean = 0;
      for (const Stretch& s : laps)
        if (s.begin != alone.begin) mean += series[s.begin + k] / others;
      for (const Stretch& s : laps) {
        double& most = s.begin == alone.begin ? off : of_others;
        most = std::max(most, std::abs(series[s.begin + k] - mean));
      }
    }
    if (of_others <= std::max(agree, kAgree * off)) return alone;
  }
  return {};
}

LapEvent event(const ComparedChannel& channel, const Stretch& lap, std::size_t begin,
               std::size_t end) {
  return {channel.axis, lap.begin + begin, lap.begin + end};
}

/// Of one channel, in all laps.
std::vector<LapEvent> events_of_all(const ComparedChannel& channel,
                                    const std::vector<Repeated>& laps, std::size_t reach) {
  const double rms = usual(laps);
  if (!(rms > 0)) return {};
  double samples = 0, within = 0;
  std::vector<LapEvent> all;
  for (const Repeated& r : laps) {
    samples += static_cast<double>(r.off.size());
    for (const auto& [begin, end] : events(r.off, kEvent * rms, kFaded * rms, reach)) {
      within += static_cast<double>(end - begin);
      for (const Stretch& lap : r.laps) all.push_back(event(channel, lap, begin, end));
    }
  }
  if (within > kMostSamples * samples) all.clear();
  return all;
}

/// The same of one lap while the others agree.
std::vector<LapEvent> events_of_one(const ComparedChannel& channel,
                                    const std::vector<Repeated>& laps,
                                    const std::vector<double>& series, std::size_t reach) {
  const double rms = std::max(usual_of_most(laps), exactness(channel, series));
  double samples = 0, within = 0;
  std::vector<LapEvent> all;
  for (const Repeated& r : laps) {
    samples += static_cast<double>(r.laps.size() * r.off.size());
    for (const auto& [begin, end] : events(r.off, kEvent * rms, kFaded * rms, reach))
      if (const auto lap = only_lap(r.laps, series, begin, end, kFaded * rms)) {
        within += static_cast<double>(end - begin);
        all.push_back(event(channel, *lap, begin, end));
      }
  }
  if (within > kMostOfOneLap * samples) all.clear();
  return all;
}

}  // namespace

std::vector<LapEvent> lap_events(const Partition& partition, double period,
                                 const std::vector<ComparedChannel>& channels,
                                 const SeriesOfChannels& difference) {
  const auto reach = static_cast<std::size_t>(std::round(kEventReach / period));
  std::vector<LapEvent> all;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (is_reading(channels[c].kind)) continue;
    const std::vector<Repeated> laps = repeated(partition, difference[c]);
    for (const auto& found : {events_of_all(channels[c], laps, reach),
                              events_of_one(channels[c], laps, difference[c], reach)})
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
