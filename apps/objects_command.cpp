#include "apps/objects_command.hpp"

#include <fmt/format.h>

#include "apps/virtual_machine.hpp"
#include "bus/object_docs.hpp"
#include "configs/config.hpp"
#include "model/input_error.hpp"

namespace vcnc {

std::string objects_page() {
  const VirtualMachine modules(Machine{}, nullptr, 1);
  return objects_markdown({{"Axis drive", modules.device(drive_node(kX))},
                           {"Spindle drive", modules.device(kSpindleNode)},
                           {"Probe", modules.device(kProbeNode)},
                           {"Overtravel", modules.device(kOvertravelNode)}});
}

std::string data_sheet(const std::string& node, const std::string& machine) {
  const VirtualMachine modules(machine.empty() ? Machine{} : load_machine(machine), nullptr, 1);
  std::string names;
  for (int id = 1; id <= kOvertravelNode; ++id) {
    const CanopenDevice& device = modules.device(id);
    if (node == device.name() || node == std::to_string(id)) return electronic_data_sheet(device);
    names += fmt::format("{}{} ({})", id == 1 ? "" : ", ", device.name(), id);
  }
  throw InputError(fmt::format("vcnc eds {}: no such module; there are {}", node, names));
}

}  // namespace vcnc
