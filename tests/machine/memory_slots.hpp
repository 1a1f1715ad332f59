// A module's memory that lives in this process.
#pragma once

#include <array>
#include <vector>

#include "bus/memory_slot.hpp"
#include "bus/node_memory.hpp"

namespace vcnc {

/// Two slots as bytes, written in turn; keeps every state that was saved.
class SlotsInMemory : public NodeMemory {
 public:
  std::vector<std::uint8_t> load() override {
    const SlotChoice choice = newest_slot(slots[0], slots[1]);
    if (!choice.newest) throw MemoryError("both slots are damaged");
    return choice.newest->state;
  }
  void save(std::span<const std::uint8_t> state) override {
    const SlotChoice choice = newest_slot(slots[0], slots[1]);
    const std::vector<std::uint8_t> copy(state.begin(), state.end());
    slots[choice.write_to] = encode_slot({choice.newest->sequence + 1, copy});
    saved.push_back(copy);
  }

  std::array<std::vector<std::uint8_t>, 2> slots{encode_slot({0, {}}), encode_slot({1, {}})};
  std::vector<std::vector<std::uint8_t>> saved;
};

}  // namespace vcnc
