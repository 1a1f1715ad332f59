#include "probe_sim/overtravel_node.hpp"

namespace vcnc {

namespace {

constexpr double kWarnShare = 0.8;  ///< of the usable range
constexpr int kSilentCyclesAllowed = 2;

Vec3 vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

OvertravelNode::OvertravelNode(const Machine& machine)
    : probe_(machine.probe), range_(usable_range(machine.probe)) {}

bool OvertravelNode::accepts(std::uint16_t cob_id) const {
  return cob_id == kStatusBase + kProbeNode || cob_id == kCommandId;
}

OvertravelState::Cause OvertravelNode::judge(const ProbeSample& sample) const {
  if (sample.flags & ProbeSample::kOvertravel) return OvertravelState::Cause::overtravel;
  if (sample.flags & ProbeSample::kSignalFault) return OvertravelState::Cause::signal;
  if (sample.flags & ProbeSample::kSlip) return OvertravelState::Cause::slip;
  return range_.contains(vec(sample.deflection)) ? OvertravelState::Cause::none
                                                 : OvertravelState::Cause::range;
}

void OvertravelNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  ++silent_cycles_;
  bool reset = false;
  std::optional<ProbeSample> sample;
  for (const Frame& frame : inputs) {
    if (auto heard = decode_probe_sample(frame)) sample = heard;
    if (const auto command = decode_group_command(frame))
      reset = (command->flags & kResetLatch) != 0;
  }

  auto cause = OvertravelState::Cause::none;
  if (sample) {
    heard_ = true;
    silent_cycles_ = 0;
    cause = judge(*sample);
  } else if (heard_ && silent_cycles_ > kSilentCyclesAllowed) {
    cause = OvertravelState::Cause::silent;
  }
  if (!probe_.in_spindle) cause = OvertravelState::Cause::none;

  const bool was_tripped = state_.state == OvertravelState::State::tripped;
  if (was_tripped && reset && cause == OvertravelState::Cause::none) state_ = {};
  if (cause != OvertravelState::Cause::none && !was_tripped)
    state_ = {.state = OvertravelState::State::tripped,
              .cause = cause,
              .deflection = sample ? vec(sample->deflection).norm() : state_.deflection};
  if (state_.state != OvertravelState::State::tripped && sample) {
    const Vec3 deflection = vec(sample->deflection);
    const bool warn = probe_.in_spindle && range_.share(deflection) > kWarnShare;
    state_.state = warn ? OvertravelState::State::warn : OvertravelState::State::normal;
    state_.deflection = deflection.norm();
  }

  state_.tick = low16(k);
  out.push_back(encode(state_));
  if (!was_tripped && state_.state == OvertravelState::State::tripped)
    out.push_back(encode(Emergency{.node = id(),
                                   .code = kOvertravelEmergency,
                                   .error_register = 0x81,
                                   .detail = {static_cast<std::uint8_t>(state_.cause)}}));
}

}  // namespace vcnc
