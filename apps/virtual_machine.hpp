// The modules of the machine as objects, for running it in one process.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "apps/switch_on.hpp"
#include "bus/canopen_device.hpp"
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
  /// `faults`: those of the host are passed over. `memories` outlive this object.
  VirtualMachine(const Machine& machine, const PieceParams* piece, std::uint64_t seed,
                 const BusFaults& faults = {}, const ModuleMemories& memories = {});

  /// In roster order, with their faults; valid as long as this object.
  std::vector<Node*> nodes() const;
  /// The module itself, inside of its faults.
  const Node& module(int id) const;
  /// The module as the bus sees it, inside of its faults.
  CanopenDevice& device(int id) const { return *devices_.at(static_cast<std::size_t>(id - 1)); }
  Node& module(int id);
  /// Faults of the modules that have had an effect so far.
  std::vector<std::string> struck() const;
  /// For observers of the true deflection.
  const ProbeNode& probe() const { return *probe_; }

 private:
  std::unique_ptr<TruthPort> truth_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<std::unique_ptr<CanopenDevice>> devices_;
  std::vector<std::unique_ptr<FaultedNode>> faulted_;  ///< null where a node has none
  const ProbeNode* probe_ = nullptr;                   ///< one of nodes_
};

}  // namespace vcnc
