// The modules of the machine as objects, for running it in one process.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bus/fault.hpp"
#include "bus/node.hpp"
#include "bus/truth.hpp"
#include "model/machine.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

class ProbeNode;

/// All modules but the NC unit.
class VirtualMachine {
 public:
  /// `faults`: those of the host are passed over.
  VirtualMachine(const Machine& machine, const PieceParams* piece, std::uint64_t seed,
                 const BusFaults& faults = {});

  /// In roster order, with their faults; valid as long as this object.
  std::vector<Node*> nodes() const;
  /// The module itself, inside of its faults.
  const Node& module(int id) const;
  /// For observers of the true deflection.
  const ProbeNode& probe() const { return *probe_; }

 private:
  std::unique_ptr<TruthPort> truth_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<std::unique_ptr<Node>> faulted_;  ///< null where a node has none
  const ProbeNode* probe_ = nullptr;            ///< one of nodes_
};

}  // namespace vcnc
