#include "diagnosis/screening/consequence.hpp"

#include <algorithm>
#include <cmath>

#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kFineNoise = 0.1e-6;  // [m]
constexpr double kArithmetic = 1e-9;   ///< of a contour, that rounding of numbers makes [um]

struct Difference {
  double sum = 0, n = 0;
};

/// One signal of two machines.
struct Both {
  SharedSeries a, b;
};

Difference difference(const Evidence& evidence, const Both& of) {
  Difference d;
  if (of.a.shares(of.b)) return d;
  const std::vector<double>&x = of.a, &y = of.b;
  for (const RecordBlock& block : evidence.partition().blocks)
    for (std::size_t k = block.begin; k < block.end; ++k)
      if (const double by = x[k] - y[k]; std::isfinite(by)) d.sum += by * by, d.n += 1;
  return d;
}

/// Whether a predicted position goes anywhere.
bool goes_anywhere(const Evidence& evidence, const std::vector<double>& position) {
  constexpr double kFar = 1e-3;  // [m]
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const RecordBlock& block : evidence.partition().blocks)
    for (std::size_t k = block.begin; k < block.end; ++k)
      if (std::isfinite(position[k]))
        low = std::min(low, position[k]), high = std::max(high, position[k]);
  return high - low > kFar;
}

/// How far a speed went.
std::vector<double> way_of(const std::vector<double>& velocity, double period) {
  std::vector<double> way(velocity.size(), kMissing);
  double gone = 0;
  for (std::size_t k = 0; k < way.size(); ++k)
    if (std::isfinite(velocity[k])) way[k] = gone += velocity[k] * period;
  return way;
}

/// Sum of squares of what a tool position changes by across the way it goes, or at all where it
/// stands.
Difference across_the_way(const Evidence& evidence, const std::vector<Both>& components) {
  constexpr std::size_t kReach = 5;      // samples to either side
  constexpr double kStandsBelow = 1e-3;  // [m/s]
  const double least = 2 * kReach * evidence.record().period * kStandsBelow;
  Difference d;
  for (const RecordBlock& block : evidence.partition().blocks)
    for (std::size_t k = block.begin + kReach; k + kReach < block.end; ++k) {
      Vec3 by = Vec3::Zero(), way = Vec3::Zero();
      for (std::size_t i = 0; i < components.size(); ++i) {
        const std::vector<double>&x = components[i].a, &y = components[i].b;
        const auto at = static_cast<Eigen::Index>(i);
        by[at] = x[k] - y[k];
        way[at] = y[k + kReach] - y[k - kReach];
      }
      if (!by.allFinite() || !way.allFinite()) continue;
      if (way.norm() > least) by -= way * (by.dot(way) / way.squaredNorm());
      d.sum += by.squaredNorm();
      d.n += 1;
    }
  return d;
}

Both ways_of(const Both& velocity, double period) {
  if (velocity.a.shares(velocity.b)) {
    const SharedSeries way = way_of(velocity.a, period);
    return {way, way};
  }
  return {way_of(velocity.a, period), way_of(velocity.b, period)};
}

bool has(const std::vector<ComparedChannel>& channels, const ComparedChannel& channel) {
  return std::find(channels.begin(), channels.end(), channel) != channels.end();
}

}  // namespace

Consequence consequence(const Evidence& evidence, const Prediction& a, const Prediction& b) {
  const std::vector<ComparedChannel>& channels = evidence.replica().channels();
  const bool probed = std::any_of(channels.begin(), channels.end(),
                                  [](const auto& c) { return is_reading(c.kind); });
  Consequence of;
  double sum = 0, n = 0;  // of the contour
  std::vector<Both> tool, linear;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto [kind, axis] = channels[c];
    const Both signal{a[c], b[c]};
    const Difference d = difference(evidence, signal);
    const bool reading = is_reading(kind);
    if (kind == SignalKind::tool_position) tool.push_back(signal);
    const bool only_speed =
        kind == SignalKind::velocity && !has(channels, {SignalKind::position, axis});
    const bool of_linear = (kind == SignalKind::position || only_speed) && !is_rotary(axis);
    if (probed ? reading : of_linear) {
      const Both position = only_speed ? ways_of(signal, evidence.record().period) : signal;
      const Difference moved = only_speed ? difference(evidence, position) : d;
      sum += moved.sum;
      n = std::max(n, moved.n);
      if (of_linear && goes_anywhere(evidence, position.b)) linear.push_back(position);
    }
    const double noise = evidence.noise().channels[c].rms;
    if (d.n == 0 || noise <= 0) continue;
    const bool length = kind == SignalKind::position && !is_rotary(axis);
    const double share = std::sqrt(d.sum / d.n) / std::max(noise, length ? kFineNoise : 0);
    of.of_noise = std::max(of.of_noise, share);
    if (!reading) of.of_noise_but_readings = std::max(of.of_noise_but_readings, share);
  }
  // A single axis has no contour but its position.
  if (!probed && linear.size() > 1) tool = linear;
  if (!tool.empty()) {
    const Difference d = across_the_way(evidence, tool);
    sum = d.sum;
    n = d.n;
  }
  if (n > 0) of.contour_um = std::sqrt(sum / n) * 1e6;
  if (of.contour_um < kArithmetic) of.contour_um = 0;
  return of;
}

}  // namespace vcnc
