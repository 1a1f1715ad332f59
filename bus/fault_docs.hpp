// The reference of faults, from the table in bus/fault.cpp: `vcnc faults`, docs/faults.md.
#pragma once

#include <string>

namespace vcnc {

std::string faults_markdown();

}  // namespace vcnc
