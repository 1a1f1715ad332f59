// What two runs truly were, where the user asks for it: keys of the machine file that differ, with
// all effects and deviations, and faults. The analysis never sees these files.
#pragma once

#include <string>

namespace vcnc {

/// `a` and `b` are folders of runs. Throws InputError naming the one that is none.
std::string reveal(const std::string& a, const std::string& b);

}  // namespace vcnc
