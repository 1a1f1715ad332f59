// `vcnc effects`: the library of effects on the terminal.
#pragma once

#include <string>

namespace vcnc {

struct EffectsOptions {
  bool json = false, markdown = false;
  std::string show;  ///< name of one effect; empty: all of them
};

/// Prints what was asked for. Throws InputError for an unknown name.
void effects_command(const EffectsOptions& options);

}  // namespace vcnc
