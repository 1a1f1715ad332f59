// `vcnc commission`: fits a declared machine to a healthy run.
#pragma once

#include <string>

namespace vcnc {

struct CommissionOptions {
  std::string run, map, model;
  std::string out;  ///< machine file to write
};

/// Exit code of the program. Throws InputError.
int commission_command(const CommissionOptions& options);

}  // namespace vcnc
