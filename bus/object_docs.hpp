// Object dictionaries for people and for tools of others.
#pragma once

#include <string>
#include <vector>

#include "bus/canopen_device.hpp"

namespace vcnc {

/// A kind of module on the page: its name and one device that stands for all.
struct DocumentedDevice {
  std::string kind;
  const CanopenDevice& device;
};

/// The page docs/objects.md: what every module has, what each kind has besides, and every EMCY
/// code.
std::string objects_markdown(const std::vector<DocumentedDevice>& devices);

/// The electronic data sheet of one module (CiA 306, INI form), with its present values as
/// defaults.
std::string electronic_data_sheet(const CanopenDevice& device);

}  // namespace vcnc
