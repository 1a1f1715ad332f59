#include "diagnosis/search/consequence.hpp"

#include <algorithm>
#include <cmath>

#include "model/axes.hpp"

namespace vcnc {
namespace {

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

}  // namespace

Consequence consequence(const Evidence& evidence, const Prediction& a, const Prediction& b) {
  const std::vector<ComparedChannel>& channels = evidence.replica().channels();
  const bool probed = std::any_of(channels.begin(), channels.end(),
                                  [](const auto& c) { return is_reading(c.kind); });
  Consequence of;
  double sum = 0, n = 0;  // of the contour
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const Difference d = difference(evidence, a, b, c);
    const bool reading = is_reading(channels[c].kind);
    const bool contour =
        probed ? reading : channels[c].kind == SignalKind::position && !is_rotary(channels[c].axis);
    if (contour) {
      sum += d.sum;
      n = std::max(n, evidence.count(c, Role::both));
    }
    const double noise = evidence.noise().channels[c].rms;
    if (d.n == 0 || noise <= 0) continue;
    const double share = std::sqrt(d.sum / d.n) / noise;
    of.of_noise = std::max(of.of_noise, share);
    if (!reading) of.of_noise_but_readings = std::max(of.of_noise_but_readings, share);
  }
  if (n > 0) of.contour_um = std::sqrt(sum / n) * 1e6;
  return of;
}

}  // namespace vcnc
