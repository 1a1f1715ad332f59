// The spindle drive on the bus: speed, orientation (M19) and the lock of the overtravel protection.
//
// A tripped overtravel module or the NC unit's lock bit brake the spindle and refuse every start;
// the lock is latched and opens only by the operator's reset once the module reads normal again.
// So does an overtravel module or an NC unit that falls silent for more than two cycles (EMCY
// 8130h, 8250h), and the loss of the NC unit's heartbeat. The reset tells EMCY 0000h.
//
// With a memory the latch survives the module: it is kept there in the cycle in which it closes,
// before any answer, and a module that is switched on with it closed refuses every start. As bytes:
// 1 version (1), 1 locked. When the bus has ended the module is as good as switched off and keeps
// nothing more.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bus/cia402.hpp"
#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "bus/node_memory.hpp"
#include "model/drive/spindle.hpp"
#include "model/machine.hpp"
#include "model/safety/reset_button.hpp"

namespace vcnc {

/// The latch as bytes, and back; nothing for bytes that are no latch.
std::vector<std::uint8_t> encode_spindle_lock(bool locked);
std::optional<bool> decode_spindle_lock(std::span<const std::uint8_t> bytes);

class SpindleNode : public Node {
 public:
  /// `memory` outlives the node; null: nothing is kept. Throws MemoryError.
  explicit SpindleNode(const Machine& machine, NodeMemory* memory = nullptr);

  int id() const override { return kSpindleNode; }
  std::string_view name() const override { return "drive spindle"; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;

  bool at_rest() const override { return drive_.standing(); }
  /// Nobody guards it any more.
  void leave_bus() override {
    locked_ = true;
    memory_ = nullptr;
  }

  DeviceProfile profile() const override { return profile_; }
  void declare(ObjectDictionary& objects) override;
  void nc_unit_lost(bool lost) override { nc_unit_lost_ = lost; }

  bool locked() const { return locked_; }
  /// Locked, or not in operation: no command makes it turn.
  bool cannot_turn() const { return locked_ || state_ != cia402::State::operation_enabled; }

 private:
  void lock_if_silent(Frames& out);
  void remember();

  SpindleParams params_;
  DeviceProfile profile_;
  SpindleDrive drive_;
  NodeMemory* memory_;
  GroupCommand command_;
  bool tripped_ = false;
  bool locked_ = false, kept_locked_ = false;  ///< now, in the memory
  bool commanded_ = false, guarded_ = false;   ///< a first message of the kind has come
  bool nc_unit_lost_ = false;
  std::uint16_t error_ = 0;  ///< code told and not yet reset
  std::uint16_t statusword_ = 0;
  SpindleCycle now_;
  ResetButton reset_;
  int cycles_without_command_ = 0, cycles_without_overtravel_ = 0;
  cia402::State state_ = cia402::State::not_ready;
};

}  // namespace vcnc
