#include "apps/virtual_machine.hpp"

#include "probe_sim/overtravel_node.hpp"
#include "probe_sim/probe_node.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace vcnc {

VirtualMachine::VirtualMachine(const Machine& machine, const PieceParams* piece, std::uint64_t seed,
                               const BusFaults& faults, const ModuleMemories& memories)
    : truth_(open_local_truth()) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    nodes_.push_back(std::make_unique<DriveNode>(axis, machine, seed, *truth_));
  nodes_.push_back(std::make_unique<SpindleNode>(machine, memories.spindle));
  auto probe =
      std::make_unique<ProbeNode>(machine, piece ? make_piece(*piece) : nullptr, seed, *truth_);
  probe_ = probe.get();
  nodes_.push_back(std::move(probe));
  nodes_.push_back(std::make_unique<OvertravelNode>(machine, memories.overtravel));
  for (const auto& node : nodes_) devices_.push_back(std::make_unique<CanopenDevice>(*node));
  for (const auto& device : devices_)
    faulted_.push_back(concerns(faults, device->name())
                           ? std::make_unique<FaultedNode>(*device, faults)
                           : nullptr);
}

const Node& VirtualMachine::module(int id) const {
  return *nodes_.at(static_cast<std::size_t>(id - 1));
}

Node& VirtualMachine::module(int id) { return *nodes_.at(static_cast<std::size_t>(id - 1)); }

std::vector<std::string> VirtualMachine::struck() const {
  std::vector<std::string> all;
  for (const auto& node : faulted_)
    if (node)
      for (std::string& text : node->struck()) all.push_back(std::move(text));
  return all;
}

std::vector<Node*> VirtualMachine::nodes() const {
  std::vector<Node*> all;
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    all.push_back(faulted_[i] ? static_cast<Node*>(faulted_[i].get()) : devices_[i].get());
  return all;
}

}  // namespace vcnc
