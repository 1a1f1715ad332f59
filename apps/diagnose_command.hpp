// `vcnc diagnose`: why a measured machine is not as declared.
#pragma once

#include <string>
#include <vector>

namespace vcnc {

struct DiagnoseOptions {
  std::string run;                    ///< folder of a run, recording, record, or table with `map`
  std::string map;                    ///< what the columns of tables are
  std::string model;                  ///< machine file; empty: the one the run names
  std::string reference;              ///< a healthy run of the same program
  std::vector<std::string> tests;     ///< runs that are only predicted
  std::string out;                    ///< folder for diagnosis.json, found.toml and report.html
  std::vector<std::string> suspects;  ///< all that is sought; none: everything
  std::vector<std::string> without;   ///< effects to be taken out of the library
  std::string compare;                ///< machine file: no diagnosis, only before and after
};

/// Exit code of the program. Throws InputError.
int diagnose_command(const DiagnoseOptions& options);

}  // namespace vcnc
