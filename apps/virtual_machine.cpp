#include "apps/virtual_machine.hpp"

#include "probe_sim/overtravel_node.hpp"
#include "probe_sim/probe_node.hpp"
#include "servo_sim/drive_node.hpp"
#include "servo_sim/spindle_node.hpp"

namespace vcnc {

VirtualMachine::VirtualMachine(const Machine& machine, const PieceParams* piece, std::uint64_t seed)
    : truth_(open_local_truth()) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    nodes_.push_back(std::make_unique<DriveNode>(axis, machine, seed, *truth_));
  nodes_.push_back(std::make_unique<SpindleNode>(machine));
  nodes_.push_back(
      std::make_unique<ProbeNode>(machine, piece ? make_piece(*piece) : nullptr, seed, *truth_));
  nodes_.push_back(std::make_unique<OvertravelNode>(machine));
}

std::vector<Node*> VirtualMachine::nodes() const {
  std::vector<Node*> all;
  for (const auto& node : nodes_) all.push_back(node.get());
  return all;
}

}  // namespace vcnc
