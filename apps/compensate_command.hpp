// `vcnc compensate`: the NC unit's compensation set against the effects of a machine.
#pragma once

#include <string>
#include <vector>

namespace vcnc {

struct CompensateOptions {
  std::string machine;
  std::vector<std::string> assignments, injections;
  std::string out;  ///< machine file to write; empty: none
  bool measure = false;
};

/// Exit code of the program. Throws InputError.
int compensate_command(const CompensateOptions& options);

}  // namespace vcnc
