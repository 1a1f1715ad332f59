#include "diagnosis/beforehand/period_slip_search.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

using Series = std::vector<double>;

constexpr std::size_t kSlipReach = 5;  // samples on either side
constexpr double kOff = 0.15;          // of a period
constexpr double kQuietBeside = 0.3;

/// Mean of the samples from k on less the mean of those before; NaN where one is missing.
double step_at(const Series& r, std::size_t k) {
  double step = 0;
  for (std::size_t i = 0; i < kSlipReach; ++i) step += r[k + i] - r[k - 1 - i];
  return step / kSlipReach;
}

/// Whether the reading hardly moves from sample to sample but from k - 1 to k.
bool sudden(const Series& r, std::size_t k, double most) {
  for (std::size_t i = k + 1 - kSlipReach; i < k + kSlipReach; ++i)
    if (i != k && !(std::abs(r[i] - r[i - 1]) < most)) return false;
  return true;
}

/// Whole periods in a step, 0: it is none.
int periods_in(double step, double period) {
  const double n = std::round(step / period);
  return std::abs(step / period - n) < kOff ? static_cast<int>(n) : 0;
}

/// Sums of squares of something that a step may be taken from.
struct Misfit {
  double as_it_is = 0, without = 0;
  bool empty = true;

  void add(double value, double step) {
    if (!std::isfinite(value)) return;
    empty = false;
    as_it_is += value * value;
    without += (value - step) * (value - step);
  }
  bool better_without() const { return without < as_it_is; }
};

/// Whether what follows from k on is nearer to nothing without the step: in the laps, if there are.
bool stays(const Record& record, const Series& r, std::size_t k, double step) {
  Misfit misfit;
  const auto add = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = std::max(begin, k); i < end; ++i) misfit.add(r[i], step);
  };
  for (const Stretch& s : record.stretches) add(s.begin, s.end);
  if (record.stretches.empty()) add(k, r.size());
  return misfit.better_without();
}

/// Whether laps after k are like those of the same condition before, but for the step; so where
/// there are none.
bool laps_differ(const Record& record, const Series& r, std::size_t k, double step) {
  Misfit misfit;
  for (const Stretch& before : record.stretches)
    for (const Stretch& after : record.stretches)
      if (before.condition == after.condition && before.end <= k && k <= after.begin)
        for (std::size_t i = 0; before.begin + i < before.end && after.begin + i < after.end; ++i)
          misfit.add(r[after.begin + i] - r[before.begin + i], step);
  return misfit.empty || misfit.better_without();
}

}  // namespace

std::optional<PeriodSlip> find_period_slip(const Record& record,
                                           const std::vector<ComparedChannel>& channels,
                                           const Prediction& predicted, double period) {
  std::vector<Series> residual;
  std::vector<int> channel;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (channels[c].kind != SignalKind::deflection) continue;
    Series r = record.find(channels[c].kind, channels[c].axis)->value;
    for (std::size_t k = 0; k < r.size(); ++k) r[k] -= predicted[c][k];
    residual.push_back(std::move(r));
    channel.push_back(static_cast<int>(channels[c].axis));
  }
  std::optional<PeriodSlip> found;
  for (std::size_t c = 0; c < residual.size(); ++c) {
    const Series& r = residual[c];
    for (std::size_t k = kSlipReach; k + kSlipReach <= r.size(); ++k) {
      const int n = periods_in(r[k] - r[k - 1], period);
      if (n == 0 || !sudden(r, k, kQuietBeside * period) ||
          periods_in(step_at(r, k), period) != n || !stays(record, r, k, n * period) ||
          !laps_differ(record, r, k, n * period))
        continue;
      const bool alone = std::all_of(residual.begin(), residual.end(), [&](const Series& other) {
        return &other == &r || !(std::abs(other[k] - other[k - 1]) > kQuietBeside * period);
      });
      if (!alone) continue;
      if (found) return std::nullopt;
      found = PeriodSlip{
          .periods = n, .channel = channel[c], .start = static_cast<double>(k) * record.period};
    }
  }
  return found;
}

}  // namespace vcnc
