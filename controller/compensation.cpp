#include "controller/compensation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vcnc {
namespace {

constexpr double kShareOfLimits = 0.5;  ///< that a transition may take
constexpr double kMoving = 1e-6;        ///< [m/s or rad/s] from which a direction counts

/// Response of p' + k p = exp(-r t) after the time t.
double lagged(double r, double k, double t) {
  if (std::abs(r - k) * t < 1e-9) return t * std::exp(-k * t);
  return (std::exp(-k * t) - std::exp(-r * t)) / (r - k);
}

/// What a table says at a position: value and slope of both parts.
struct TableReading {
  double mean = 0, mean_slope = 0, half = 0, half_slope = 0;
};

TableReading look_up(const CompensationRules::TwoWayCurve& curve, double q) {
  const std::vector<double>& at = curve.at;
  if (curve.modulo) {
    const double length = at.back() - at.front();
    q -= length * std::floor((q - at.front()) / length);
  }
  if (q <= at.front() && !curve.modulo) return {curve.mean.front(), 0, curve.half.front(), 0};
  if (q >= at.back() && !curve.modulo) return {curve.mean.back(), 0, curve.half.back(), 0};
  const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, q);
  const std::size_t j = static_cast<std::size_t>(above - at.begin()), i = j - 1;
  const double width = at[j] - at[i], s = (q - at[i]) / width;
  const double mean_step = curve.mean[j] - curve.mean[i], half_step = curve.half[j] - curve.half[i];
  return {curve.mean[i] + s * mean_step, mean_step / width, curve.half[i] + s * half_step,
          half_step / width};
}

double shortest_for(double jump, const AxisLimits& l) {
  return shortest_transition(jump, kShareOfLimits * l.velocity, kShareOfLimits * l.acceleration,
                             kShareOfLimits * l.jerk);
}

/// Notices a reversal and the moment of it, and lets the pulses of an axis go on for a cycle.
void follow_friction(const CompensationRules::OneAxis& axis, double before, double now,
                     int& direction, CompensationState::Pulse& pulse) {
  const ReversalPulse& set = axis.set.friction;
  const double k = axis.kv / axis.velocity_ff, gain = 1 / axis.velocity_ff;
  const double decay = 1 / set.decay, rise = set.rise > 0 ? 1 / set.rise : 0;
  if (set.amplitude != 0) {
    pulse.position =
        pulse.position * std::exp(-k * kCycle) +
        gain * (pulse.decaying * lagged(decay, k, kCycle) - pulse.rising * lagged(rise, k, kCycle));
    pulse.decaying *= std::exp(-decay * kCycle);
    pulse.rising *= std::exp(-rise * kCycle);
  }
  const int sign = now > kMoving ? 1 : now < -kMoving ? -1 : 0;
  if (sign == 0 || sign == direction) return;
  const bool reversal = direction != 0;
  direction = sign;
  if (!reversal || set.amplitude == 0) return;
  const bool crossed = before * sign <= 0;
  const double since = crossed ? kCycle * now / (now - before) : kCycle;
  const double amplitude = sign * set.amplitude_at(std::abs(now - before) / kCycle);
  pulse.decaying += amplitude * std::exp(-decay * since);
  pulse.position += gain * amplitude * lagged(decay, k, since);
  if (rise == 0) return;
  pulse.rising += amplitude * std::exp(-rise * since);
  pulse.position -= gain * amplitude * lagged(rise, k, since);
}

/// Errors of all axes and their rates.
struct KnownErrors {
  AxisVector value{}, rate{};
};

KnownErrors errors_at(const CompensationRules& rules, const AxisVector& q, const AxisVector& v,
                      const CompensationState& state) {
  KnownErrors e;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisCompensation& set = rules.axes[i].set;
    const SmoothedSign& turned = state.turned[i];
    e.value[i] = set.scale * (q[i] - set.scale_reference) - 0.5 * set.backlash * turned.value();
    e.rate[i] = set.scale * v[i] - 0.5 * set.backlash * turned.rate();
  }
  const SquarenessCompensation& s = rules.squareness;
  e.value[kX] += s.xy * q[kY] + s.xz * q[kZ];
  e.rate[kX] += s.xy * v[kY] + s.xz * v[kZ];
  e.value[kY] += s.yz * q[kZ];
  e.rate[kY] += s.yz * v[kZ];
  for (const CompensationRules::TwoWayCurve& curve : rules.curves) {
    const TableReading t = look_up(curve, q[curve.over]);
    const SmoothedSign& turned = state.turned[curve.over];
    e.value[curve.axis] += t.mean + turned.value() * t.half;
    e.rate[curve.axis] +=
        (t.mean_slope + turned.value() * t.half_slope) * v[curve.over] + turned.rate() * t.half;
  }
  return e;
}

}  // namespace

SmoothedSign::SmoothedSign(double duration)
    : cycles_(static_cast<std::size_t>(
          std::max(1.0, std::ceil(duration / (kAverages * kCycle) - 1e-9)))) {
  for (Average& average : averages_) average.last.assign(cycles_, 0);
}

void SmoothedSign::step(int sign) {
  std::int64_t value = sign;
  for (Average& average : averages_) {
    average.sum += value - average.last[next_];
    average.last[next_] = value;
    value = average.sum;
  }
  next_ = (next_ + 1) % cycles_;
  const double n = static_cast<double>(cycles_);
  output_ = {static_cast<double>(value) / (n * n * n), output_[0], output_[1]};
}

CompensationRules::CompensationRules(const Machine& machine)
    : squareness(machine.nc.compensation.squareness) {
  const CompensationParams& set = machine.nc.compensation;
  for (const CompensationTable& table : set.tables) {
    if (table.at.size() < 2 || table.error.size() != table.at.size())
      throw std::invalid_argument("a compensation table without points");
    TwoWayCurve curve{table.axis_index(), table.over_index(), table.at, table.error, {},
                      table.modulo};
    curve.half.assign(table.at.size(), 0);
    for (std::size_t k = 0; k < table.error_reverse.size(); ++k) {
      curve.mean[k] = 0.5 * (table.error[k] + table.error_reverse[k]);
      curve.half[k] = 0.5 * (table.error[k] - table.error_reverse[k]);
    }
    curves.push_back(std::move(curve));
  }
  AxisVector farthest{};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisLimits& l = machine.axes[i].limits;
    farthest[i] = std::max(std::abs(l.min), std::abs(l.max));
  }
  const SquarenessCompensation& s = squareness;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisParams& axis = machine.axes[i];
    const AxisCompensation& own = set.axes[i];
    axes[i] = {own,
               axis.limits.min,
               axis.limits.max,
               axis.servo.kv_per_s,
               axis.servo.velocity_ff,
               own.transition};
    if (own.transition == 0)
      for (std::size_t corrected = 0; corrected < kAxisCount; ++corrected)
        axes[i].transition =
            std::max(axes[i].transition,
                     shortest_for(set.largest_jump(corrected, i), machine.axes[corrected].limits));
    double largest = std::abs(own.scale) * (farthest[i] + std::abs(own.scale_reference));
    if (i == kX) largest += std::abs(s.xy) * farthest[kY] + std::abs(s.xz) * farthest[kZ];
    if (i == kY) largest += std::abs(s.yz) * farthest[kZ];
    for (const CompensationTable& table : set.tables)
      if (table.axis_index() == i) largest += table.largest();
    entry = std::max(entry, shortest_for(largest, axis.limits));
    if (largest != 0 || own.backlash != 0 || own.lead != 0 || own.friction.amplitude != 0)
      empty_ = false;
  }
}

CompensationState::CompensationState(const CompensationRules& rules) : entered(rules.entry) {
  for (std::size_t i = 0; i < kAxisCount; ++i) turned[i] = SmoothedSign(rules.axes[i].transition);
}

Compensated compensated(const CompensationRules& rules, const AxisVector& position,
                        const AxisVector& velocity, CompensationState& state) {
  AxisVector q, v;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double lead = rules.axes[i].set.lead;
    const double a = state.begun ? (velocity[i] - state.planned_velocity[i]) / kCycle : 0;
    q[i] = position[i] + lead * (velocity[i] + 0.5 * lead * a);
    v[i] = velocity[i] + lead * a;
    follow_friction(rules.axes[i], state.begun ? state.velocity[i] : v[i], v[i], state.direction[i],
                    state.pulses[i]);
    state.turned[i].step(state.direction[i]);
  }
  state.entered.step(1);
  state.begun = true;
  state.planned_velocity = velocity;
  state.velocity = v;

  const KnownErrors known = errors_at(rules, q, v, state);
  const double w = state.entered.value(), w_rate = state.entered.rate();
  Compensated out;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const CompensationRules::OneAxis& axis = rules.axes[i];
    const CompensationState::Pulse& pulse = state.pulses[i];
    const double u = pulse.decaying - pulse.rising;
    out.correction[i] = -w * known.value[i];
    out.position[i] = q[i] + out.correction[i] + pulse.position;
    out.velocity[i] = v[i] - w * known.rate[i] - w_rate * known.value[i];
    if (axis.set.friction.amplitude != 0)
      out.velocity[i] += (u - axis.kv * pulse.position) / axis.velocity_ff;
    const double within = std::clamp(out.position[i], std::min(axis.lower, position[i]),
                                     std::max(axis.upper, position[i]));
    if (within != out.position[i]) out.velocity[i] = 0;
    out.position[i] = within;
  }
  return out;
}

}  // namespace vcnc
