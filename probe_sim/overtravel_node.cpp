#include "probe_sim/overtravel_node.hpp"

namespace vcnc {

OvertravelNode::OvertravelNode(const Machine& machine) : protection_(machine.probe) {}

bool OvertravelNode::accepts(std::uint16_t cob_id) const {
  return cob_id == kStatusBase + kProbeNode || cob_id == kCommandId;
}

void OvertravelNode::step(Tick k, std::span<const Frame> inputs, Frames& out) {
  ProtectionEvidence seen;
  bool reset = false;
  for (const Frame& frame : inputs) {
    if (const auto sample = decode_probe_sample(frame); sample && is_finite(*sample))
      seen = {.sampled = true,
              .deflection = Vec3(sample->deflection.data()),
              .overtravel = (sample->flags & ProbeSample::kOvertravel) != 0,
              .signal_fault = (sample->flags & ProbeSample::kSignalFault) != 0,
              .slip = (sample->flags & ProbeSample::kSlip) != 0};
    if (const auto command = decode_group_command(frame))
      reset = (command->flags & kResetLatch) != 0;
  }
  const ProtectionState before = protection_.state();
  protection_.step(seen, reset);

  const OvertravelState state{.tick = low16(k),
                              .state = static_cast<OvertravelState::State>(protection_.state()),
                              .cause = static_cast<OvertravelState::Cause>(protection_.cause()),
                              .deflection = protection_.deflection()};
  out.push_back(encode(state));
  if (protection_.latched() && protection_.state() > before)
    out.push_back(encode(Emergency{.node = id(),
                                   .code = kOvertravelEmergency,
                                   .error_register = 0x81,
                                   .detail = {static_cast<std::uint8_t>(state.cause)}}));
}

}  // namespace vcnc
