#include "diagnosis/records/late_velocity.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/records/series.hpp"

namespace vcnc {
namespace {

constexpr double kReach = 5e-3;      // of a mean, to either side [s]
constexpr double kFast = 0.1;        // of the highest speed
constexpr double kKnownTo = 0.2e-3;  // [s]
constexpr double kOfRounding = 1e-6;

}  // namespace

std::optional<double> lateness_of_velocity(const Record& record, std::size_t axis) {
  const MeasuredSignal* velocity = record.find(SignalKind::velocity, axis);
  const MeasuredSignal* position = record.find(SignalKind::position, axis);
  if (!velocity || !position) return std::nullopt;
  const auto reach = static_cast<std::size_t>(std::max(1.0, std::round(kReach / record.period)));
  const std::vector<double> told = moving_mean(velocity->value, reach),
                            speed = moving_mean(first_derivative(position->value, record.period),
                                                reach),
                            acceleration = first_derivative(speed, record.period);
  double fastest = 0;
  for (const double v : speed)
    if (std::isfinite(v)) fastest = std::max(fastest, std::abs(v));
  double aa = 0, ra = 0, rr = 0, count = 0;
  for (std::size_t k = 0; k < told.size(); ++k) {
    const double r = told[k] - speed[k], a = acceleration[k];
    if (!std::isfinite(r) || !std::isfinite(a) || !(std::abs(speed[k]) > kFast * fastest)) continue;
    aa += a * a, ra += r * a, rr += r * r, ++count;
  }
  if (!(kKnownTo * std::sqrt(aa / count) > kOfRounding * fastest)) return std::nullopt;
  // Means over w samples are as good as one in w of them.
  const double left = std::max(0.0, rr - ra * ra / aa), width = static_cast<double>(2 * reach + 1);
  const double error = std::sqrt(width * left / (count * aa));
  if (!(error < kKnownTo)) return std::nullopt;
  return -ra / aa;
}

}  // namespace vcnc
