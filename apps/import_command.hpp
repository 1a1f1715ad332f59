// `vcnc import`: a table of a real machine and its map become a record.
#pragma once

#include <string>

namespace vcnc {

struct ImportOptions {
  std::string table, map, out;
  bool keys = false;  ///< print the keys of a map instead
};

/// Throws InputError.
void import_command(const ImportOptions& options);

}  // namespace vcnc
