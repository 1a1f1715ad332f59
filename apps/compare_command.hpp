// `vcnc compare`: two runs side by side.
#pragma once

#include <string>

namespace vcnc {

struct CompareOptions {
  std::string a, b;     ///< recordings or folders of runs
  bool reveal = false;  ///< also what the runs truly were
  std::string out;      ///< folder for compare.html; empty: none
};

/// Exit code of the program. Throws InputError where there is nothing to compare.
int compare_command(const CompareOptions& options);

}  // namespace vcnc
