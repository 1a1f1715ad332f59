// What a machine begins with when it is not switched on for the first time.
#pragma once

#include <span>

#include "bus/node_memory.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// What the modules of a machine keep; null: nothing.
struct ModuleMemories {
  NodeMemory* spindle = nullptr;
  NodeMemory* overtravel = nullptr;
};

/// The machine with its axes standing elsewhere [m, rad] than its file says; empty: there.
inline Machine switched_on_at(Machine machine, std::span<const double> positions) {
  for (std::size_t i = 0; i < positions.size() && i < kAxisCount; ++i)
    machine.axes[i].limits.start = positions[i];
  return machine;
}

}  // namespace vcnc
