#include "diagnosis/search/consequence.hpp"

#include <algorithm>
#include <cmath>

#include "model/axes.hpp"

namespace vcnc {
namespace {

constexpr double kArithmetic = 1e-9;  ///< of a contour, that rounding of numbers makes [um]

struct Difference {
  double sum = 0, n = 0;
};

Difference difference(const Evidence& evidence, const Prediction& a, const Prediction& b,
                      std::size_t channel) {
  Difference d;
  if (a[channel].shares(b[channel])) return d;
  const std::vector<double>&x = a[channel], &y = b[channel];
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

/// Sum of squares of what a tool position changes by across the way it goes, or at all where it
/// stands.
Difference across_the_way(const Evidence& evidence, const Prediction& a, const Prediction& b,
                          const std::vector<std::size_t>& components) {
  constexpr std::size_t kReach = 5;      // samples to either side
  constexpr double kStandsBelow = 1e-3;  // [m/s]
  const double least = 2 * kReach * evidence.record().period * kStandsBelow;
  Difference d;
  for (const RecordBlock& block : evidence.partition().blocks)
    for (std::size_t k = block.begin + kReach; k + kReach < block.end; ++k) {
      Vec3 by = Vec3::Zero(), way = Vec3::Zero();
      for (std::size_t i = 0; i < components.size(); ++i) {
        const std::vector<double>&x = a[components[i]], &y = b[components[i]];
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

}  // namespace

Consequence consequence(const Evidence& evidence, const Prediction& a, const Prediction& b) {
  const std::vector<ComparedChannel>& channels = evidence.replica().channels();
  const bool probed = std::any_of(channels.begin(), channels.end(),
                                  [](const auto& c) { return is_reading(c.kind); });
  Consequence of;
  double sum = 0, n = 0;  // of the contour
  std::vector<std::size_t> tool, linear;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const Difference d = difference(evidence, a, b, c);
    const bool reading = is_reading(channels[c].kind);
    if (channels[c].kind == SignalKind::tool_position) tool.push_back(c);
    const bool of_linear = channels[c].kind == SignalKind::position && !is_rotary(channels[c].axis);
    if (of_linear && goes_anywhere(evidence, b[c])) linear.push_back(c);
    if (probed ? reading : of_linear) {
      sum += d.sum;
      n = std::max(n, d.n);
    }
    const double noise = evidence.noise().channels[c].rms;
    if (d.n == 0 || noise <= 0) continue;
    const double share = std::sqrt(d.sum / d.n) / noise;
    of.of_noise = std::max(of.of_noise, share);
    if (!reading) of.of_noise_but_readings = std::max(of.of_noise_but_readings, share);
  }
  // A single axis has no contour but its position.
  if (!probed && linear.size() > 1) tool = linear;
  if (!tool.empty()) {
    const Difference d = across_the_way(evidence, a, b, tool);
    sum = d.sum;
    n = d.n;
  }
  if (n > 0) of.contour_um = std::sqrt(sum / n) * 1e6;
  if (of.contour_um < kArithmetic) of.contour_um = 0;
  return of;
}

}  // namespace vcnc
