// The overtravel protection: a module of its own that sees only the bus.
//
//   NORMAL -> WARN     any component of the deflection beyond 80 % of its usable range
//   any    -> TRIPPED  beyond the usable range, the probe's overtravel signal, a faulty signal,
//   lost
//                      periods (the ball moved too fast to be counted: its reading means nothing
//                      any more), or a probe that falls silent for more than two cycles
// TRIPPED is latched: only the operator's reset opens it, and only once the cause is gone. It is
// told in every cycle (OvertravelState) and once as EMCY FF10h; drives stop and the spindle locks
// on it by themselves. The usable range depends on mounting and stylus mass:
// model/probe/contact.hpp.
#pragma once

#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "model/machine.hpp"
#include "model/probe/contact.hpp"

namespace vcnc {

inline constexpr std::uint16_t kOvertravelEmergency = 0xff10;

class OvertravelNode : public Node {
 public:
  explicit OvertravelNode(const Machine& machine);

  int id() const override { return kOvertravelNode; }
  std::string_view name() const override { return "overtravel"; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;

 private:
  OvertravelState::Cause judge(const ProbeSample& sample) const;

  ProbeParams probe_;
  UsableRange range_;
  OvertravelState state_;
  bool heard_ = false;
  int silent_cycles_ = 0;
};

}  // namespace vcnc
