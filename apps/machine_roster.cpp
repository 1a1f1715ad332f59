#include "apps/machine_roster.hpp"

#include "bus/messages.hpp"
#include "model/axes.hpp"

namespace vcnc {

Roster machine_roster(const BusFaults& faults) {
  Roster roster;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    roster.push_back({drive_node(axis), "drive " + std::string(kAxisNames[axis])});
  roster.push_back({kSpindleNode, "drive spindle"});
  roster.push_back({kProbeNode, "probe"});
  roster.push_back({kOvertravelNode, "overtravel"});
  for (RosterEntry& entry : roster) entry.token = concerns(faults, entry.name);
  return roster;
}

}  // namespace vcnc
