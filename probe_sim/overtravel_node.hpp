// The overtravel protection: a module of its own that sees only the bus.
//
// Judges every sample of the probe by the state machine of model/safety/protection.hpp and tells
// its state in every cycle (OvertravelState), and once as EMCY FF10h when it latches. Drives stop
// on HARD and the spindle locks on SOFT_STOP and HARD by themselves, without the NC unit.
#pragma once

#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "model/machine.hpp"
#include "model/safety/protection.hpp"

namespace vcnc {

class OvertravelNode : public Node {
 public:
  explicit OvertravelNode(const Machine& machine);

  int id() const override { return kOvertravelNode; }
  std::string_view name() const override { return "overtravel"; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;

 private:
  Protection protection_;
};

}  // namespace vcnc
