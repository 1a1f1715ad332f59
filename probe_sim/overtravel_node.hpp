// The overtravel protection: a module of its own that sees only the bus.
//
// Judges every sample of the probe by the state machine of model/safety/protection.hpp and tells
// its state in every cycle (OvertravelState), and once as EMCY FF10h when it latches. Drives stop
// on HARD and the spindle locks on SOFT_STOP and HARD by themselves, without the NC unit. The
// operator's reset tells EMCY 0000h. Thresholds, state, cause and deflection are objects 2100h.. .
//
// With a memory the latch survives the module: it is kept there in the cycle in which it closes,
// and a module that is switched on begins with it, so that no program starts. As bytes: 1 version
// (1), 1 state, 1 cause, 8 deflection (IEEE 754, little-endian).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/node_memory.hpp"
#include "model/machine.hpp"
#include "model/safety/protection.hpp"
#include "model/safety/reset_button.hpp"

namespace vcnc {

/// A latch as bytes, and back; nothing for bytes that are no latch.
std::vector<std::uint8_t> encode_protection_latch(const ProtectionLatch& latch);
std::optional<ProtectionLatch> decode_protection_latch(std::span<const std::uint8_t> bytes);

class OvertravelNode : public Node {
 public:
  /// `memory` outlives the node; null: nothing is kept. Throws MemoryError.
  explicit OvertravelNode(const Machine& machine, NodeMemory* memory = nullptr);

  int id() const override { return kOvertravelNode; }
  std::string_view name() const override { return "overtravel"; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;
  void leave_bus() override { memory_ = nullptr; }
  DeviceProfile profile() const override { return profile_; }
  void declare(ObjectDictionary& objects) override;

  const Protection& protection() const { return protection_; }

 private:
  void remember();

  ProbeParams probe_;
  DeviceProfile profile_;
  Protection protection_;
  ResetButton reset_;
  NodeMemory* memory_;
  ProtectionLatch kept_;  ///< in the memory
};

}  // namespace vcnc
