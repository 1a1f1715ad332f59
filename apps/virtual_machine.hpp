// The modules of the machine as objects, for running it in one process.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bus/node.hpp"
#include "bus/truth.hpp"
#include "model/machine.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

/// All modules but the NC unit.
class VirtualMachine {
 public:
  VirtualMachine(const Machine& machine, const PieceParams* piece, std::uint64_t seed);

  /// In roster order; valid as long as this object.
  std::vector<Node*> nodes() const;

 private:
  std::unique_ptr<TruthPort> truth_;
  std::vector<std::unique_ptr<Node>> nodes_;
};

}  // namespace vcnc
