#include "diagnosis/evidence/comparable.hpp"

#include <algorithm>
#include <cmath>

#include "model/axes.hpp"

namespace vcnc {
namespace {

using Flags = std::vector<std::vector<char>>;

/// An axis stands when its command moved less than this in each of the last and next 25 ms.
constexpr double kStandingLinear = 0.2e-3, kStandingRotary = 0.2e-3;  // [m/s], [rad/s]
constexpr double kCurveReach = 0.025;                                 // [s]
/// So long after its last motion nothing but the rounding of its encoder says where it rests.
constexpr double kSettled = 0.5;  // [s]
/// Readings are rough where their second differences in that reach are as large, of the usual.
constexpr double kRough = 8;
constexpr double kSlowSliding = 20e-3;  // [m/s]
/// A ball that is deflected by less of the largest deflection is free, whatever its inertia does;
/// readings so soon before and after it touches depend on where exactly the piece lies.
constexpr double kFree = 0.003, kTouching = 0.05;  // [s]
/// A ball that swings goes through zero within half a period of the slowest suspension.
constexpr double kHalfSwing = 0.03;  // [s]
/// A ball on a piece rests below this part of its usual speed; its drag has turned over after
/// twice the friction times the deflection, for a friction of 0.2.
constexpr double kResting = 0.04, kTurnOver = 0.4;
constexpr double kLever = 0.1;  // of a rotary axis [m]

void mask_standing(const Record& record, const std::vector<ComparedChannel>& channels,
                   Flags& valid) {
  const auto reach = static_cast<std::size_t>(std::round(kCurveReach / record.period));
  for (std::size_t c = 0; c < valid.size(); ++c) {
    const ComparedChannel& channel = channels[c];
    if (channel.kind != SignalKind::force && channel.kind != SignalKind::twist &&
        channel.kind != SignalKind::velocity)
      continue;
    const MeasuredSignal* command = record.find(SignalKind::command, channel.axis);
    if (!command) continue;
    const double slow = (is_rotary(channel.axis) ? kStandingRotary : kStandingLinear) *
                        static_cast<double>(reach) * record.period;
    const std::vector<double>& q = command->value;
    for (std::size_t k = 0; k < q.size(); ++k) {
      const std::size_t before = k > reach ? k - reach : 0;
      const std::size_t after = std::min(q.size() - 1, k + reach);
      if (std::abs(q[k] - q[before]) < slow || std::abs(q[after] - q[k]) < slow) valid[c][k] = 0;
    }
  }
}

void mask_settled(const Record& record, const std::vector<ComparedChannel>& channels,
                  Flags& valid) {
  const auto settled = static_cast<std::size_t>(std::round(kSettled / record.period));
  for (std::size_t c = 0; c < valid.size(); ++c) {
    const ComparedChannel& channel = channels[c];
    if (channel.kind != SignalKind::position) continue;
    const MeasuredSignal* command = record.find(SignalKind::command, channel.axis);
    if (!command) continue;
    const double slow =
        (is_rotary(channel.axis) ? kStandingRotary : kStandingLinear) * record.period;
    const std::vector<double>& q = command->value;
    std::size_t still = settled;  // samples since it moved; before the record it stood
    for (std::size_t k = 1; k < q.size(); ++k) {
      still = std::abs(q[k] - q[k - 1]) < slow ? still + 1 : 0;
      if (still > settled) valid[c][k] = 0;
    }
  }
}

/// Of the ball at every sample [m].
std::vector<double> deflections(const std::vector<ComparedChannel>& channels,
                                const Prediction& deflected, std::size_t samples) {
  std::vector<double> all(samples, 0.0);
  for (std::size_t c = 0; c < channels.size(); ++c)
    for (std::size_t k = 0; channels[c].kind == SignalKind::deflection && k < samples; ++k)
      if (std::isfinite(deflected[c][k])) all[k] = std::hypot(all[k], deflected[c][k]);
  return all;
}

void mask_touching(const Record& record, const std::vector<ComparedChannel>& channels,
                   const Prediction& deflected, Flags& valid) {
  const auto samples = [&](double time) {
    return static_cast<std::size_t>(std::round(time / record.period));
  };
  const std::size_t n = record.samples();
  const std::vector<double> deflection = deflections(channels, deflected, n);
  const double least = kFree * *std::max_element(deflection.begin(), deflection.end());
  const auto free = [&](std::size_t k) { return deflection[k] <= least; };
  std::vector<std::size_t> readings;
  for (std::size_t c = 0; c < valid.size(); ++c)
    if (channels[c].kind == SignalKind::deflection) readings.push_back(c);
  // Within half a period a ball that swings was on the other side.
  const auto swings = [&](std::size_t k) {
    for (std::size_t j = k > samples(kHalfSwing) ? k - samples(kHalfSwing) : 0; j < k; ++j) {
      double along = 0;
      for (const std::size_t c : readings) along += deflected[c][j] * deflected[c][k];
      if (along < 0) return true;
    }
    return false;
  };
  // When it lost the piece before it came to rest.
  const auto released = [&](std::size_t k) {
    while (k > 0 && swings(k - 1)) --k;
    return k;
  };
  const auto leave_out_about = [&](std::size_t k) {
    const std::size_t begin = k > samples(kTouching) ? k - samples(kTouching) : 0;
    for (const std::size_t c : readings)
      std::fill(valid[c].begin() + static_cast<std::ptrdiff_t>(begin),
                valid[c].begin() + static_cast<std::ptrdiff_t>(std::min(n, k + samples(kTouching))),
                0);
  };
  for (std::size_t begin = 0; begin < n && !readings.empty();) {
    std::size_t end = begin;
    while (end < n && free(end)) ++end;
    if (end - begin > samples(kCurveReach)) {  // shorter: a reading goes through zero
      if (begin > 0) {
        leave_out_about(released(begin));
        leave_out_about(begin);
      }
      if (end < n) leave_out_about(end);
    }
    begin = end + 1;
  }
}

/// Way of the ball over the piece in each cycle, by the commands [m]; empty where one is missing.
std::vector<double> ways(const Record& record) {
  std::vector<double> squares(record.samples(), 0.0);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const MeasuredSignal* command = record.find(SignalKind::command, axis);
    if (!command) {
      if (!is_rotary(axis)) return {};
      continue;
    }
    const double lever = is_rotary(axis) ? kLever : 1;
    for (std::size_t k = 1; k < squares.size(); ++k) {
      const double way = lever * (command->value[k] - command->value[k - 1]);
      squares[k] += way * way;
    }
  }
  if (squares.size() > 1) squares[0] = squares[1];
  for (double& s : squares) s = std::sqrt(s);
  return squares;
}

void mask_resting_ball(const Record& record, const std::vector<ComparedChannel>& channels,
                       const Prediction& deflected, Flags& valid) {
  const std::vector<double> way = ways(record);
  if (way.empty()) return;
  const std::vector<double> deflection = deflections(channels, deflected, way.size());
  const double least = kFree * *std::max_element(deflection.begin(), deflection.end());
  std::vector<double> usual;
  for (std::size_t k = 0; k < way.size(); ++k)
    if (deflection[k] > least && way[k] > 0) usual.push_back(way[k]);
  if (usual.empty()) return;
  const auto middle = usual.begin() + static_cast<std::ptrdiff_t>(usual.size() / 2);
  std::nth_element(usual.begin(), middle, usual.end());
  double since = 0;
  for (std::size_t k = 0; k < way.size(); ++k) {
    since = way[k] < kResting * *middle ? 0 : since + way[k];
    if (deflection[k] <= least || since > kTurnOver * deflection[k]) continue;
    for (std::size_t c = 0; c < valid.size(); ++c)
      if (channels[c].kind == SignalKind::deflection) valid[c][k] = 0;
  }
}

void mask_turning_drag(const Record& record, const std::vector<ComparedChannel>& channels,
                       const SeriesOfChannels& measured, const Prediction& declared, Flags& valid) {
  const auto reach = static_cast<std::size_t>(std::round(kCurveReach / record.period));
  const std::size_t n = record.samples();
  std::vector<double> squared_speed(n, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const MeasuredSignal* command = record.find(SignalKind::command, axis);
    if (!command) return;
    for (std::size_t k = 1; k < n; ++k) {
      const double v = (command->value[k] - command->value[k - 1]) / record.period;
      squared_speed[k] += v * v;
    }
  }
  for (std::size_t c = 0; c < valid.size(); ++c) {
    if (channels[c].kind != SignalKind::deflection) continue;
    std::vector<double> second(n, 0.0), present;  // squares of second differences of the residual
    for (std::size_t k = 2; k < n; ++k) {
      if (!valid[c][k] || !valid[c][k - 1] || !valid[c][k - 2]) continue;
      const auto r = [&](std::size_t i) { return measured[c][i] - declared[c][i]; };
      const double d = r(k) - 2 * r(k - 1) + r(k - 2);
      second[k] = d * d;
      present.push_back(second[k]);
    }
    if (present.empty()) continue;
    const auto middle = present.begin() + static_cast<std::ptrdiff_t>(present.size() / 2);
    std::nth_element(present.begin(), middle, present.end());
    constexpr double kMedianOfSquare = 0.455;  // of a normal deviate
    const double most = kRough * kRough * *middle / kMedianOfSquare;
    std::vector<double> sum(n + 1, 0.0);
    for (std::size_t k = 0; k < n; ++k) sum[k + 1] = sum[k] + second[k];
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t first = k > reach ? k - reach : 0, last = std::min(n, k + reach + 1);
      const double mean = (sum[last] - sum[first]) / static_cast<double>(last - first);
      if (mean > most && squared_speed[k] < kSlowSliding * kSlowSliding) valid[c][k] = 0;
    }
  }
}

}  // namespace

std::vector<std::vector<char>> comparable_samples(const Record& record,
                                                  const std::vector<ComparedChannel>& channels,
                                                  const SeriesOfChannels& measured,
                                                  const Prediction& declared,
                                                  const Prediction& deflected) {
  Flags valid;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    std::vector<char>& flags = valid.emplace_back(record.samples());
    for (std::size_t k = 0; k < flags.size(); ++k)
      flags[k] = std::isfinite(measured[c][k]) && std::isfinite(declared[c][k]);
  }
  mask_standing(record, channels, valid);
  mask_settled(record, channels, valid);
  mask_touching(record, channels, deflected, valid);
  mask_resting_ball(record, channels, deflected, valid);
  mask_turning_drag(record, channels, measured, declared, valid);
  return valid;
}

}  // namespace vcnc
