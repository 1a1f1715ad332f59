#include "model/safety/protection.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

namespace {

constexpr int kSamplesPerCycle = 10;  ///< of the probe module

}  // namespace

Protection::Protection(const ProbeParams& probe) : probe_(probe), range_(usable_range(probe)) {}

void Protection::restore(const ProtectionLatch& latch) {
  if (latch.state < ProtectionState::soft_stop) return;
  state_ = latch.state;
  cause_ = latch.cause;
  deflection_ = latch.deflection;
}

ProtectionLatch Protection::latch() const {
  if (!latched()) return {};
  return {state_, cause_, deflection_};
}

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
  if (seen.slip || jumps(seen)) return {hard, Cause::slip};
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

/// Whether the reading went further since the last sample than periods can be counted. A tick far
/// from the last one is spoiled and excuses nothing.
bool Protection::jumps(const ProtectionEvidence& seen) const {
  if (!seen.tick || !last_.tick) return false;
  const int cycles =
      std::clamp<int>(static_cast<std::uint16_t>(*seen.tick - *last_.tick), 1, kSilentCycles + 1);
  const double largest = probe_.signal_period / 2 * kSamplesPerCycle * cycles;
  return (seen.deflection - last_.deflection).cwiseAbs().maxCoeff() > largest;
}

void Protection::step(const ProtectionEvidence& seen, bool reset) {
  if (seen.sampled) {
    heard_ = true;
    silent_ = 0;
  } else {
    ++silent_;
  }
  const Verdict now = judge(seen);
  if (seen.sampled) last_ = seen;
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
      return "the probe moved or jumped too far to be counted, its reading is lost";
    case ProtectionCause::limit:
      return "deflection or force at the probe's mechanical limit";
    case ProtectionCause::runaway:
      return "the deflection goes on beyond the usable range";
    case ProtectionCause::none:
      break;
  }
  return "no cause";
}

}  // namespace vcnc
