#include "controller/rate_planner.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vcnc {

namespace {

constexpr double kShortestChange = 10 * kCycle;
constexpr double kAligned = 1e-6;        ///< of a cycle: a change that is aligned stays as it is
constexpr double kHorizon = 2;           ///< so far ahead on the path is looked [s]
constexpr double kSteepestChange = 1.5;  ///< of a change: largest r' T / |r1 - r0|
constexpr double kCurved = 6;            ///< largest r'' T^2 / |r1 - r0|
constexpr double kGrowth = 1.3;
constexpr int kCandidates = 10;

/// Differences of the axes' positions over the last cycles.
class Differences {
 public:
  explicit Differences(const AxisVector& q) { q_.fill(Eigen::Map<const Coordinates>(q.data())); }
  void add(const AxisVector& q) {
    std::rotate(q_.begin(), q_.end() - 1, q_.end());
    q_[0] = Eigen::Map<const Coordinates>(q.data());
  }
  Coordinates first() const { return (q_[0] - q_[1]) / kCycle; }
  Coordinates second() const { return (q_[0] - 2 * q_[1] + q_[2]) / (kCycle * kCycle); }
  Coordinates third() const {
    return (q_[0] - 3 * q_[1] + 3 * q_[2] - q_[3]) / (kCycle * kCycle * kCycle);
  }

 private:
  std::array<Coordinates, 4> q_;  ///< newest first
};

double largest(const Coordinates& x, const Coordinates& limit) {
  return x.cwiseAbs().cwiseQuotient(limit).maxCoeff();
}

double whole_cycles(double tau) { return std::floor(tau / kCycle); }

}  // namespace

AlignedChange aligned(const RateChange& change) {
  AlignedChange result{change};
  if (change.to != 1 || change.from == 1) return result;
  const double whole = whole_cycles(change.start), fraction = change.start / kCycle - whole;
  const double passed = 0.5 * change.time * std::abs(1 - change.from) / kCycle - kAligned;
  if (change.from < 1) {
    const double n = std::max(std::ceil(passed - fraction), 1.0);
    result.change.time = 2 * (n + fraction) * kCycle / (1 - change.from);
    result.base = static_cast<Tick>(whole - n);
  } else {
    const double n = std::ceil(passed + fraction);
    result.change.time = 2 * (n - fraction) * kCycle / (change.from - 1);
    result.base = static_cast<Tick>(whole + n);
  }
  return result;
}

RatePlanner::RatePlanner(const Machine& machine)
    : feed_limits_(machine, 1),
      rapid_limits_(machine, machine.nc.rapid_limit),
      probing_(probing_limit(machine)) {}

const MotionLimits& RatePlanner::limits(const Trajectory& run) const {
  const bool rapid = run.path().segments().front().move.kind == Move::Kind::rapid;
  return rapid ? rapid_limits_ : feed_limits_;
}

/// In which the change could be made if the path were straight there.
double RatePlanner::shortest_time(const Trajectory& run, double at, double difference,
                                  double share) const {
  const MotionSample now = run.at(at);
  const Coordinates v = Eigen::Map<const Coordinates>(now.dq.data()) * std::abs(difference);
  const MotionLimits& most = limits(run);
  return std::max({kShortestChange, kSteepestChange * largest(v, most.acceleration) / share,
                   std::sqrt(kCurved * largest(v, most.jerk) / share)});
}

bool RatePlanner::keeps_limits(const Trajectory& run, const RateChange& change) const {
  const MotionLimits& most = limits(run);
  const auto before = [&](int cycles) {
    return run.at(std::max(change.start - cycles * kCycle * change.from, 0.0)).q;
  };
  Differences differences(before(3));
  differences.add(before(2));
  differences.add(before(1));
  differences.add(run.at(change.start).q);
  const auto cycles = static_cast<Tick>(std::ceil(change.time / kCycle)) + 3;
  for (Tick k = 1; k <= cycles; ++k) {
    const double tau = change.path_time(seconds(k));
    differences.add(run.at(tau).q);
    if (largest(differences.first(), most.velocity) > kAllowedShare ||
        largest(differences.second(), most.acceleration) > kAllowedShare ||
        largest(differences.third(), most.jerk) > kAllowedJerk)
      return false;
    if (tau >= run.duration()) break;
  }
  return true;
}

std::optional<RateChange> RatePlanner::change(const Trajectory& run, double start, double from,
                                              double to, double share) const {
  double time = shortest_time(run, start, to - from, share);
  for (int i = 0; i < kCandidates; ++i, time *= kGrowth) {
    const RateChange candidate = aligned({start, from, to, time}).change;
    if (keeps_limits(run, candidate)) return candidate;
  }
  return std::nullopt;
}

std::optional<RateChange> RatePlanner::change_ending(const Trajectory& run, double end, double from,
                                                     double to, double earliest) const {
  double time = shortest_time(run, end, to - from);
  for (int i = 0; i < kCandidates; ++i, time *= kGrowth) {
    RateChange candidate{0, from, to, time};
    candidate.start = end - candidate.way();
    if (candidate.start < earliest) return std::nullopt;
    time = std::max(time, shortest_time(run, candidate.start, to - from));
    candidate.time = time;
    candidate.start = end - candidate.way();
    if (candidate.start < earliest) return std::nullopt;
    if (keeps_limits(run, candidate)) return candidate;
  }
  return std::nullopt;
}

RateChange RatePlanner::slowest(const Trajectory& run, double start, double from, double to) const {
  const double time = shortest_time(run, start, to - from) * std::pow(kGrowth, kCandidates - 1);
  return aligned({start, from, to, time}).change;
}

double RatePlanner::fast_until(const Trajectory& run, double tau, double rate) const {
  const MotionLimits& most = limits(run);
  Differences differences(run.at(std::max(tau - 3 * kCycle, 0.0)).q);
  for (int k = 2; k > 0; --k) differences.add(run.at(std::max(tau - k * kCycle, 0.0)).q);
  double until = tau;
  for (Tick k = 0;; ++k) {
    const double at = tau + seconds(k);
    if (at >= run.duration() || at > tau + kHorizon) return until;
    const MotionSample sample = run.at(at);
    differences.add(sample.q);
    const bool fast =
        sample.panel == Move::Panel::acts &&
        rate * largest(differences.first(), most.velocity) <= 1 &&
        rate * rate * largest(differences.second(), most.acceleration) <= kFastShare &&
        rate * rate * rate * largest(differences.third(), most.jerk) <= kFastShare &&
        (!probing_ || probing_->at(sample.q, sample.dq).factor >= rate);
    if (!fast) return until;
    until = at;
  }
}

double RatePlanner::block_end(const Trajectory& run, double tau) {
  constexpr int kHalvings = 30;
  const int line = run.at(tau).line;
  double before = tau, behind = tau;
  do {
    before = behind;
    if (before >= run.duration()) return run.duration();
    behind = std::min(before + kCycle, run.duration());
  } while (run.at(behind).line == line);
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (before + behind);
    (run.at(middle).line == line ? before : behind) = middle;
  }
  return behind;
}

}  // namespace vcnc
