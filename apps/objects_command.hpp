// `vcnc objects` and `vcnc eds`: the object dictionaries of the modules.
#pragma once

#include <string>

namespace vcnc {

/// The page docs/objects.md, of the modules of a machine file without entries.
std::string objects_page();

/// The electronic data sheet of a module, by name ("drive X") or node id. `machine`: its file;
/// empty: one without entries. Throws InputError for a module that does not exist.
std::string data_sheet(const std::string& node, const std::string& machine);

}  // namespace vcnc
