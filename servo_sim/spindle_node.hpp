// The spindle drive on the bus: speed, orientation (M19) and the lock of the overtravel protection.
//
// A tripped overtravel module or the NC unit's lock bit brake the spindle and refuse every start;
// the lock is latched and opens only by the operator's reset once the module reads normal again.
// So does an overtravel module or an NC unit that falls silent for more than two cycles (EMCY
// 8130h, 8250h).
#pragma once

#include "bus/cia402.hpp"
#include "bus/messages.hpp"
#include "bus/node.hpp"
#include "model/drive/spindle.hpp"
#include "model/machine.hpp"

namespace vcnc {

class SpindleNode : public Node {
 public:
  explicit SpindleNode(const Machine& machine);

  int id() const override { return kSpindleNode; }
  std::string_view name() const override { return "drive spindle"; }
  bool accepts(std::uint16_t cob_id) const override;
  void step(Tick k, std::span<const Frame> inputs, Frames& out) override;

  bool at_rest() const override { return drive_.standing(); }

  bool locked() const { return locked_; }

 private:
  void lock_if_silent(Frames& out);

  SpindleDrive drive_;
  GroupCommand command_;
  bool tripped_ = false;
  bool locked_ = false;
  bool commanded_ = false, guarded_ = false;  ///< a first message of the kind has come
  int cycles_without_command_ = 0, cycles_without_overtravel_ = 0;
  cia402::State state_ = cia402::State::not_ready;
};

}  // namespace vcnc
