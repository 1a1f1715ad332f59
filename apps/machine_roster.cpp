#include "apps/machine_roster.hpp"

#include "bus/messages.hpp"
#include "model/axes.hpp"

namespace vcnc {

namespace {

RosterEntry entry(int id, std::string name, std::uint32_t device_type, std::uint32_t product_code) {
  return {.id = id,
          .name = std::move(name),
          .token = false,
          .device_type = device_type,
          .product_code = product_code};
}

}  // namespace

Roster machine_roster(const BusFaults& faults) {
  Roster roster;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    roster.push_back(entry(drive_node(axis), "drive " + std::string(kAxisNames[axis]), kServoDrive,
                           kAxisDriveProduct));
  roster.push_back(entry(kSpindleNode, "drive spindle", kSpindleDrive, kSpindleDriveProduct));
  roster.push_back(entry(kProbeNode, "probe", kNoProfile, kProbeProduct));
  roster.push_back(entry(kOvertravelNode, "overtravel", kNoProfile, kOvertravelProduct));
  for (RosterEntry& entry : roster) entry.token = concerns(faults, entry.name);
  return roster;
}

}  // namespace vcnc
