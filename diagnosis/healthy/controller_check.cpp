#include "diagnosis/healthy/controller_check.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/records/series.hpp"

namespace vcnc {
namespace {

/// What an effect makes of r, of what it makes of the position: less, and it is a force.
constexpr double kLeastShare = 0.3;

double velocity_gain(const AxisParams& axis) {
  const ServoParams& s = axis.servo;
  return s.velocity_gain > 0 ? s.velocity_gain
                             : 2 * kPi * s.velocity_bandwidth * axis.mechanics.total_inertia();
}

/// a / (s + a) of a signal that has been what it is at first.
class LowPass {
 public:
  LowPass(double a, double period) : share_(a * period / (1 + a * period)) {}
  double low(double x) {
    if (!begun_) low_ = x, begun_ = true;
    return low_ += share_ * (x - low_);
  }
  /// s / (s + a)
  double high(double x) { return x - low(x); }

 private:
  double share_, low_ = 0;
  bool begun_ = false;
};

SeriesOfChannels difference(const Prediction& a, const Prediction& b) {
  SeriesOfChannels d(a.size());
  for (std::size_t c = 0; c < a.size(); ++c) {
    if (a[c].shares(b[c])) continue;
    d[c].resize(a[c].size());
    for (std::size_t k = 0; k < d[c].size(); ++k) d[c][k] = a[c][k] - b[c][k];
  }
  return d;
}

}  // namespace

ControllerCheck::ControllerCheck(const Record& record, const std::vector<ComparedChannel>& channels,
                                 const Machine& declared)
    : record_(record), channels_(channels), declared_(declared.axes) {}

std::optional<std::size_t> ControllerCheck::channel(SignalKind kind, std::size_t axis) const {
  const auto found = std::find(channels_.begin(), channels_.end(), ComparedChannel{kind, axis});
  if (found == channels_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - channels_.begin());
}

std::vector<double> ControllerCheck::equation(std::size_t axis,
                                              const SeriesOfChannels& change) const {
  const auto position = channel(SignalKind::position, axis),
             force = channel(SignalKind::force, axis), twist = channel(SignalKind::twist, axis);
  if (!position || !force || record_.stretches.empty()) return {};
  const ServoParams& servo = declared_[axis].servo;
  const bool of_load = servo.feedback == ServoParams::Feedback::load;
  const double kp = velocity_gain(declared_[axis]), kv = servo.kv_per_s, dt = record_.period;
  const double reset =
      servo.controller == ServoParams::Controller::cascade ? 1 / servo.integral_time : 0;
  const auto at = [&](const std::optional<std::size_t>& c, std::size_t k) {
    return c && !change[*c].empty() ? change[*c][k] : 0.0;
  };
  std::vector<double> r(record_.samples(), kMissing);
  for (const Stretch& lap : record_.stretches) {
    LowPass of_position(kv, dt), of_motor(kv, dt), of_demand(kv, dt), integral(reset, dt);
    for (std::size_t k = lap.begin; k < lap.end; ++k) {
      const double e_x = at(position, k), e_f = at(force, k),
                   e_m = e_x - (of_load ? at(twist, k) : 0);
      if (!std::isfinite(e_x + e_m + e_f)) continue;
      const double demand = (reset > 0 ? integral.high(e_f) : e_f) / (kp * kv);
      r[k] = of_position.low(e_x) + of_motor.high(e_m) + of_demand.low(demand);
    }
  }
  return r;
}

std::optional<Confirmation> ControllerCheck::of(std::size_t axis, const Prediction& without,
                                                const Prediction& with) const {
  const SeriesOfChannels made = difference(with, without);
  const std::vector<double> d = equation(axis, made);
  if (d.empty()) return std::nullopt;
  const std::vector<double>& moved = made[*channel(SignalKind::position, axis)];
  if (!(mean_square(d) > kLeastShare * kLeastShare * mean_square(moved))) return std::nullopt;
  SeriesOfChannels left(channels_.size());
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    if (channels_[c].axis != axis || is_reading(channels_[c].kind)) continue;
    left[c] = record_.find(channels_[c].kind, axis)->value;
    for (std::size_t k = 0; k < left[c].size(); ++k) left[c][k] -= with[c][k];
  }
  const std::vector<double> r = equation(axis, left);
  double dd = 0, rd = 0;
  std::vector<std::pair<double, double>> of_stretch;
  for (const Stretch& lap : record_.stretches) {
    double own_dd = 0, own_rd = 0;
    for (std::size_t k = lap.begin; k < lap.end; ++k)
      if (std::isfinite(r[k]) && std::isfinite(d[k])) own_dd += d[k] * d[k], own_rd += r[k] * d[k];
    dd += own_dd, rd += own_rd;
    of_stretch.emplace_back(own_dd, own_rd);
  }
  if (!(dd > 0)) return std::nullopt;
  // Of a ratio of sums: what every stretch is off it.
  Confirmation b{1 + rd / dd, 0};
  double off = 0;
  for (const auto& [own_dd, own_rd] : of_stretch) off += std::pow(own_rd - rd / dd * own_dd, 2);
  b.deviation = std::sqrt(off) / dd;
  return b;
}

}  // namespace vcnc
