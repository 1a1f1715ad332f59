#include "diagnosis/search/differential.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

/// Lengths of laps of one condition differ by their start within a sample.
constexpr std::size_t kSlack = 3;

}  // namespace

DifferentialRecord less_healthy(const Record& now, const Record& healthy, const Replica& of_healthy,
                                const Machine& declared) {
  DifferentialRecord result{now, 1};
  const Prediction predicted = of_healthy.predict(declared);
  const std::vector<ComparedChannel>& channels = of_healthy.channels();
  std::size_t fewest = 0, unmatched = 0;
  for (MeasuredSignal& signal : result.record.signals) {
    if (!is_compared(signal.kind)) continue;
    const auto channel = std::find_if(
        channels.begin(), channels.end(),
        [&](const ComparedChannel& c) { return c.kind == signal.kind && c.axis == signal.axis; });
    const MeasuredSignal* partner = healthy.find(signal.kind, signal.axis);
    std::vector<double> left(signal.value.size(), kMissing);
    if (channel != channels.end() && partner) {
      const std::vector<double>& yhat =
          predicted[static_cast<std::size_t>(channel - channels.begin())];
      for (const Stretch& s : now.stretches) {
        std::vector<const Stretch*> laps;
        for (const Stretch& h : healthy.stretches) {
          const std::size_t a = h.end - h.begin, b = s.end - s.begin;
          if (h.condition == s.condition && (a > b ? a - b : b - a) <= kSlack) laps.push_back(&h);
        }
        unmatched += laps.empty();
        if (laps.empty()) continue;
        fewest = fewest == 0 ? laps.size() : std::min(fewest, laps.size());
        for (std::size_t k = s.begin; k < s.end; ++k) {
          double sum = 0;
          for (const Stretch* h : laps) {
            const std::size_t at = std::min(h->begin + (k - s.begin), h->end - 1);
            sum += partner->value[at] - yhat[at];
          }
          left[k] = signal.value[k] - sum / static_cast<double>(laps.size());
        }
      }
    }
    signal.value = std::move(left);
  }
  if (unmatched > 0)
    result.record.warnings.push_back(
        "Some motions have no partner in the reference run and are left out: was it the same "
        "program?");
  if (fewest > 0) result.noise_scale = std::sqrt(1 + 1 / static_cast<double>(fewest));
  return result;
}

}  // namespace vcnc
