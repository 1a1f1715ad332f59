#include "apps/virtual_machine.hpp"

#include "probe_sim/overtravel_node.hpp"
#include "probe_sim/probe_node.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace vcnc {

VirtualMachine::VirtualMachine(const Machine& machine, const PieceParams* piece, std::uint64_t seed,
                               const BusFaults& faults)
    : truth_(open_local_truth()) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    nodes_.push_back(std::make_unique<DriveNode>(axis, machine, seed, *truth_));
  nodes_.push_back(std::make_unique<SpindleNode>(machine));
  auto probe =
      std::make_unique<ProbeNode>(machine, piece ? make_piece(*piece) : nullptr, seed, *truth_);
  probe_ = probe.get();
  nodes_.push_back(std::move(probe));
  nodes_.push_back(std::make_unique<OvertravelNode>(machine));
  for (const auto& node : nodes_)
    faulted_.push_back(concerns(faults, node->name()) ? std::make_unique<FaultedNode>(*node, faults)
                                                      : nullptr);
}

const Node& VirtualMachine::module(int id) const {
  return *nodes_.at(static_cast<std::size_t>(id - 1));
}

std::vector<Node*> VirtualMachine::nodes() const {
  std::vector<Node*> all;
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    all.push_back(faulted_[i] ? faulted_[i].get() : nodes_[i].get());
  return all;
}

}  // namespace vcnc
