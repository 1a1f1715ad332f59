#include "model/safety/protection.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

Protection::Protection(const ProbeParams& probe) : probe_(probe), range_(usable_range(probe)) {}

Protection::Verdict Protection::judge(const ProtectionEvidence& seen) const {
  using enum ProtectionState;
  using Cause = ProtectionCause;
  if (!probe_.in_spindle) return {};
  if (!seen.sampled) {
    if (heard_ && silent_ > kSilentCycles) return {hard, Cause::silent};
    return {std::min(state_, warn), Cause::none};
  }
  if (seen.overtravel) return {hard, Cause::overtravel};
  if (seen.signal_fault || !seen.deflection.allFinite()) return {hard, Cause::signal};
  if (seen.slip) return {hard, Cause::slip};
  const double lateral = seen.deflection.head<2>().norm(), axial = std::abs(seen.deflection.z());
  const double k = probe_.spring_rate;
  if (lateral >= probe_.overtravel_lateral || axial >= probe_.overtravel_axial ||
      k * lateral >= probe_.overtravel_force_lateral || k * axial >= probe_.overtravel_force_axial)
    return {hard, Cause::limit};
  const double share = range_.share(seen.deflection);
  if (share > kRunawayShare) return {hard, Cause::runaway};
  if (share > 1) return {soft_stop, Cause::range};
  return {share > kWarnShare ? warn : normal, Cause::none};
}

void Protection::step(const ProtectionEvidence& seen, bool reset) {
  if (seen.sampled) {
    heard_ = true;
    silent_ = 0;
  } else {
    ++silent_;
  }
  const Verdict now = judge(seen);
  const bool cause_gone =
      now.state < ProtectionState::soft_stop && (seen.sampled || !probe_.in_spindle);
  if (latched() && !(reset && cause_gone)) {
    if (now.state <= state_) return;
  }
  state_ = now.state;
  cause_ = now.cause;
  if (seen.sampled) deflection_ = seen.deflection.norm();
}

const char* text_of(ProtectionCause cause) {
  switch (cause) {
    case ProtectionCause::range:
      return "deflection out of the usable range";
    case ProtectionCause::overtravel:
      return "the probe's own protection unit has switched";
    case ProtectionCause::signal:
      return "the probe's signals are faulty";
    case ProtectionCause::silent:
      return "the probe has fallen silent";
    case ProtectionCause::slip:
      return "the probe moved too fast to be counted, its reading is lost";
    case ProtectionCause::limit:
      return "deflection or force at the probe's mechanical limit";
    case ProtectionCause::runaway:
      return "the deflection goes on beyond the usable range";
    case ProtectionCause::none:
      break;
  }
  return "no cause";
}

double stopping_distance(double speed, double reaction_time, double deceleration) {
  return speed * reaction_time + speed * speed / (2 * deceleration);
}

double largest_probing_speed(const ProbeParams& probe, const Vec3& way, double reaction_time,
                             double deceleration) {
  const UsableRange range = usable_range(probe);
  const double k = probe.spring_rate;
  const double lateral_end = std::min(probe.overtravel_lateral, probe.overtravel_force_lateral / k);
  const double axial_end = std::min(probe.overtravel_axial, probe.overtravel_force_axial / k);
  const double x = std::max(range.positive.x(), range.negative.x());
  const double y = std::max(range.positive.y(), range.negative.y());
  const double z = std::max(range.positive.z(), range.negative.z());
  const double lateral_start = Protection::kRunawayShare * std::hypot(x, y);
  const double axial_start = Protection::kRunawayShare * z;
  const double lateral = way.head<2>().norm(), axial = std::abs(way.z());
  const double reserve = std::min(2 * (lateral_end - lateral_start) / (1 + lateral),
                                  2 * (axial_end - axial_start) / (1 + axial));
  // v t + v^2 / 2a = reserve
  const double at = deceleration * reaction_time;
  const double stopping = -at + std::sqrt(at * at + 2 * deceleration * std::max(reserve, 0.0));
  constexpr double kSampleTime = 100e-6;
  return std::min(stopping, probe.signal_period / (2 * kSampleTime));
}

}  // namespace vcnc
