#include "diagnosis/records/commanded_motion.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

constexpr double kSettling = 50e-3;       // [s] after a gap, until the drive has forgotten it
constexpr double kStarting = 0.3;         // [s] after a begin in motion, the same
constexpr double kFollowedReach = 12e-3;  // [s] to either side of a sample of what is followed
constexpr double kStandingStart = 1e-4;   // [m/s or rad/s] below which a record begins at rest

/// Fills what is missing by straight lines, constant beyond the ends; tells where.
std::vector<double> bridged(const std::vector<double>& value, std::vector<char>& known,
                            std::size_t settling) {
  std::vector<double> result = value;
  const std::size_t n = value.size();
  std::size_t i = 0;
  while (i < n) {
    if (!std::isnan(value[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < n && std::isnan(value[end])) ++end;
    const double before = i > 0 ? value[i - 1] : end < n ? value[end] : 0;
    const double after = end < n ? value[end] : before;
    const double steps = static_cast<double>(end - i + 1);
    for (std::size_t j = i; j < end; ++j)
      result[j] = before + (after - before) * static_cast<double>(j - i + 1) / steps;
    for (std::size_t j = i; j < std::min(n, end + settling); ++j) known[j] = false;
    i = end;
  }
  return result;
}

/// Value at each sample of the cubic that fits those within `half` samples best; fewer at the ends.
std::vector<double> by_cubics(const std::vector<double>& value, std::size_t half) {
  const std::size_t n = value.size();
  std::vector<double> result = value;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const std::size_t reach = std::min({half, i, n - 1 - i});
    if (reach < 2) continue;
    const auto m = static_cast<double>(reach);
    double sum = 0;
    for (std::size_t j = i - reach; j <= i + reach; ++j) {
      const double off = static_cast<double>(j) - static_cast<double>(i);
      sum += (3 * m * m + 3 * m - 1 - 5 * off * off) * value[j];
    }
    result[i] = 3 * sum / ((2 * m - 1) * (2 * m + 1) * (2 * m + 3));
  }
  return result;
}

/// Noise of a sample, by the median size of third differences.
double noise_of(const std::vector<double>& value) {
  std::vector<double> third;
  for (std::size_t k = 3; k < value.size(); ++k)
    third.push_back(std::abs(value[k] - 3 * value[k - 1] + 3 * value[k - 2] - value[k - 3]));
  if (third.empty()) return 0;
  const auto middle = third.begin() + static_cast<std::ptrdiff_t>(third.size() / 2);
  std::nth_element(third.begin(), middle, third.end());
  return 1.4826 * *middle / std::sqrt(20.0);
}

/// Where an axis was measured, so smooth that the noise of its acceleration is a hundredth of it: a
/// cubic by least squares over N samples has 26.8 sigma / (h^2 N^2.5) of it.
std::vector<double> smooth_path(const std::vector<double>& measured, double h) {
  constexpr double kNoisePart = 0.01;
  const auto pass = [&](std::vector<double> x, std::size_t half) {
    for (int i = 0; i < 3; ++i) x = by_cubics(x, half);
    return x;
  };
  const auto most = static_cast<std::size_t>(std::round(kFollowedReach / h));
  const std::vector<double> smoothest = pass(measured, most);
  double square = 0;
  for (std::size_t k = 2; k < smoothest.size(); ++k)
    square += std::pow(smoothest[k] - 2 * smoothest[k - 1] + smoothest[k - 2], 2);
  const double difference = std::sqrt(square / static_cast<double>(smoothest.size()));
  if (!(difference > 0)) return smoothest;
  const double needed = 1.3 * std::pow(26.8 * noise_of(measured) / (kNoisePart * difference), 0.4);
  const double half = std::ceil((needed - 1) / 2);
  if (half >= static_cast<double>(most)) return smoothest;
  return pass(measured, static_cast<std::size_t>(std::max(2.0, half)));
}

/// A drive is told multiples of the step of its bus.
void round_to(std::vector<double>& value, double step) {
  if (step > 0)
    for (double& v : value) v = std::round(v / step) * step;
}

/// Known forces on an axis.
std::vector<KnownForce> forces(const Record& record, std::size_t axis, std::vector<char>& known,
                               std::size_t settling) {
  std::vector<KnownForce> all;
  const auto take = [&](SignalKind kind, double KnownForce::*part) {
    const MeasuredSignal* signal = record.find(kind, axis);
    if (signal == nullptr) return;
    all.resize(signal->value.size());
    const std::vector<double> value = bridged(signal->value, known, settling);
    for (std::size_t k = 0; k < all.size(); ++k) all[k].*part = value[k];
  };
  take(SignalKind::applied_force, &KnownForce::applied);
  take(SignalKind::added_force, &KnownForce::added);
  return all;
}

}  // namespace

std::vector<double> spline_derivative(const std::vector<double>& y, double h) {
  const std::size_t n = y.size();
  std::vector<double> slope(n, 0);
  if (n < 2) return slope;
  // Slopes d of the natural spline: 2 d0 + d1 = 3 (y1 - y0) / h;
  // d[i-1] + 4 d[i] + d[i+1] = 3 (y[i+1] - y[i-1]) / h; the end as the beginning.
  std::vector<double> share(n, 0);
  share[0] = 0.5;
  slope[0] = 1.5 * (y[1] - y[0]) / h;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double pivot = 4 - share[i - 1];
    share[i] = 1 / pivot;
    slope[i] = (3 * (y[i + 1] - y[i - 1]) / h - slope[i - 1]) / pivot;
  }
  slope[n - 1] = (3 * (y[n - 1] - y[n - 2]) / h - slope[n - 2]) / (2 - share[n - 2]);
  for (std::size_t i = n - 1; i-- > 0;) slope[i] -= share[i] * slope[i + 1];
  return slope;
}

CommandedMotion commanded_motion(const Record& record) {
  CommandedMotion motion;
  motion.known.assign(record.samples(), true);
  const auto settling = static_cast<std::size_t>(std::ceil(kSettling / record.period));
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const MeasuredSignal* signal = record.find(SignalKind::command, axis);
    motion.told[axis] = CommandedMotion::Told::command;
    if (signal == nullptr) {
      signal = record.find(SignalKind::position, axis);
      motion.followed[axis] = is_followed(record, axis);
      if (!motion.followed[axis]) motion.told[axis] = CommandedMotion::Told::position;
    }
    if (signal == nullptr) {
      motion.told[axis] = CommandedMotion::Told::nothing;
      continue;
    }
    motion.position[axis] = bridged(signal->value, motion.known, settling);
    if (motion.followed[axis])
      motion.position[axis] = smooth_path(motion.position[axis], record.period);
    motion.velocity[axis] = spline_derivative(motion.position[axis], record.period);
    motion.force[axis] = forces(record, axis, motion.known, settling);
    if (motion.told[axis] != CommandedMotion::Told::command) continue;
    if (std::abs(motion.velocity[axis].front()) > kStandingStart) {
      const auto starting = static_cast<std::size_t>(std::ceil(kStarting / record.period));
      std::fill_n(motion.known.begin(), std::min(starting, motion.known.size()), false);
    }
    if (!motion.followed[axis]) round_to(motion.position[axis], signal->resolution);
  }
  return motion;
}

Record with_bridged_commands(Record record) {
  std::vector<char> known(record.samples());
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::command) s.value = bridged(s.value, known, 0);
  return record;
}

bool is_followed(const Record& record, std::size_t axis) {
  const bool probed = std::any_of(record.signals.begin(), record.signals.end(),
                                  [](const MeasuredSignal& s) { return is_reading(s.kind); });
  const auto has = [&](SignalKind kind) { return record.find(kind, axis) != nullptr; };
  return !probed && !has(SignalKind::command) && has(SignalKind::position) &&
         (has(SignalKind::twist) || has(SignalKind::force));
}

AxisVector CommandedMotion::start(const AxisVector& declared) const {
  AxisVector q = declared;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (!position[axis].empty()) q[axis] = position[axis].front();
  return q;
}

}  // namespace vcnc
