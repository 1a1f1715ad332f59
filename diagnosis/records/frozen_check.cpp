#include "diagnosis/records/frozen_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/records/signal_name.hpp"

namespace vcnc {

namespace {

constexpr double kFrozenTime = 50e-3;                    ///< [s] that a value stays at least
constexpr std::size_t kFrozenSamples = 20;               // ... and so many samples
constexpr double kLongerThanAll = 10;                    // times the longest run that is none
constexpr double kJumpOfReading = 10, kJumpOfForce = 3;  // times the usual step
constexpr double kAboveNext = 3;                         // times the steps after the jump
constexpr std::size_t kNextSteps = 5;
constexpr double kNearNone = 0.2;      ///< share of the largest reading
constexpr double kSpeedChanges = 0.2;  ///< share of the largest speed
constexpr double kGoesOn = 0.5;        ///< share of samples in which another reading changes
constexpr double kAlwaysChanges = 0.95;

/// Samples [begin, end) of one value.
struct EqualRun {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
};

std::vector<EqualRun> equal_runs(const std::vector<double>& x, std::size_t shortest) {
  std::vector<EqualRun> runs;
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= x.size(); ++k) {
    if (k < x.size() && x[k] == x[begin]) continue;
    if (k - begin >= shortest) runs.push_back({begin, k});
    begin = k;
  }
  return runs;
}

/// Share of the steps within [begin, end) that are none of zero; `frozen` of them do not count.
double changing(const std::vector<double>& x, std::size_t begin, std::size_t end,
                std::size_t frozen = 0) {
  double count = 0;
  for (std::size_t k = begin + 1; k < end; ++k) count += x[k] != x[k - 1];
  return end > begin + 1 + frozen ? count / static_cast<double>(end - begin - 1 - frozen) : 0;
}

double usual_step(const std::vector<double>& x) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < x.size(); ++k)
    if (const double d = std::abs(x[k] - x[k - 1]); std::isfinite(d) && d > 0) steps.push_back(d);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

bool jumps_after(const std::vector<double>& x, const EqualRun& run, double least) {
  if (run.end >= x.size()) return false;
  const double jump = std::abs(x[run.end] - x[run.end - 1]);
  double next = 0;
  for (std::size_t k = run.end + 1; k < std::min(x.size(), run.end + 1 + kNextSteps); ++k)
    if (const double d = std::abs(x[k] - x[k - 1]); std::isfinite(d)) next = std::max(next, d);
  return jump > least && jump > kAboveNext * next;
}

struct Extremes {
  double low = HUGE_VAL, high = -HUGE_VAL;
  void take(double v) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  double largest() const { return std::max(std::abs(low), std::abs(high)); }
};

Extremes extremes_of(const std::vector<double>& x) {
  Extremes e;
  for (const double v : x) e.take(v);
  return e;
}

class FrozenSearch {
 public:
  FrozenSearch(const Record& record, const MeasuredSignal& signal)
      : record_(record), signal_(signal), range_(extremes_of(signal.value)) {
    if (is_reading()) return;
    const MeasuredSignal* p = record.find(SignalKind::position, signal.axis);
    if (!p) p = record.find(SignalKind::command, signal.axis);
    if (!p) return;
    moved_.assign(p->value.size(), kMissing);
    constexpr std::size_t kReach = kFrozenSamples / 2;
    for (std::size_t k = kReach; k + kReach < moved_.size(); ++k)
      moved_[k] = p->value[k + kReach] - p->value[k - kReach];
    fastest_ = extremes_of(moved_).largest();
  }

  std::vector<EqualRun> frozen() const {
    const std::vector<double>& x = signal_.value;
    const auto shortest = std::max(
        kFrozenSamples, static_cast<std::size_t>(std::lround(kFrozenTime / record_.period)));
    const double jump = (is_reading() ? kJumpOfReading : kJumpOfForce) * usual_step(x);
    std::vector<EqualRun> result;
    double longest = 0;      // of those that are none
    std::size_t frozen = 0;  // samples
    for (const EqualRun& run : equal_runs(x, kFrozenSamples)) {
      if (!(is_reading() ? is_moved(run) : is_driven(run))) continue;
      const bool to_the_end = run.end == x.size() && run.begin > shortest &&
                              (!is_reading() || changing(x, 0, run.begin, frozen) > kAlwaysChanges);
      if (run.size() >= shortest && (to_the_end || jumps_after(x, run, jump)))
        result.push_back(run), frozen += run.size();
      else
        longest = std::max(longest, static_cast<double>(run.size()));
    }
    std::erase_if(result, [&](const EqualRun& run) {
      return static_cast<double>(run.size()) < kLongerThanAll * longest;
    });
    return result;
  }

 private:
  bool is_reading() const { return vcnc::is_reading(signal_.kind); }

  /// Whether the ball is moved: other readings say so, or it is far out.
  bool is_moved(const EqualRun& run) const {
    if (std::abs(signal_.value[run.begin]) > kNearNone * range_.largest()) return true;
    return std::any_of(record_.signals.begin(), record_.signals.end(), [&](const auto& o) {
      return o.kind == signal_.kind && o.axis != signal_.axis &&
             changing(o.value, run.begin, run.end) > kGoesOn;
    });
  }

  /// Whether the motion asks for another force meanwhile, of a drive that is not at its limit.
  bool is_driven(const EqualRun& run) const {
    const double value = signal_.value[run.begin];
    if (moved_.empty() || value == range_.low || value == range_.high) return false;
    Extremes speed;
    for (std::size_t k = run.begin; k < run.end; ++k) speed.take(moved_[k]);
    return speed.high - speed.low > kSpeedChanges * fastest_;
  }

  const Record& record_;
  const MeasuredSignal& signal_;
  Extremes range_;
  std::vector<double> moved_;  ///< by the axis of a force, in equal times
  double fastest_ = 0;
};

std::string told(const MeasuredSignal& s, const EqualRun& run, const Record& record) {
  const auto at = [&](std::size_t k) { return record.time_of(k); };
  return fmt::format("at {:.6g} (SI) from {:.3f} to {:.3f} s", s.value[run.begin], at(run.begin),
                     at(run.end));
}

}  // namespace

void take_out_frozen(Record& record) {
  std::vector<std::vector<EqualRun>> all;
  for (const MeasuredSignal& s : record.signals)
    all.push_back(is_reading(s.kind) || s.kind == SignalKind::force
                      ? FrozenSearch(record, s).frozen()
                      : std::vector<EqualRun>{});
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].empty()) continue;
    MeasuredSignal& s = record.signals[i];
    constexpr std::size_t kMostTold = 3;
    std::string when;
    std::size_t samples = 0;
    for (std::size_t r = 0; r < all[i].size(); ++r) {
      const EqualRun& run = all[i][r];
      if (r < kMostTold) when += (r > 0 ? ", " : "") + told(s, run, record);
      samples += run.size();
      std::fill(s.value.begin() + static_cast<std::ptrdiff_t>(run.begin),
                s.value.begin() + static_cast<std::ptrdiff_t>(run.end), kMissing);
    }
    if (all[i].size() > kMostTold)
      when += fmt::format(" and {} times more", all[i].size() - kMostTold);
    record.warnings.push_back(fmt::format(
        "\"{}\" ({}) stays to the last digit {} while the machine moves: it was not updated; these "
        "{} samples are taken as missing",
        s.source, signal_name(s.kind, s.axis), when, samples));
  }
}

}  // namespace vcnc
