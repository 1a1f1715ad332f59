// Ctrl-C and SIGTERM: the first asks the run to end in order, the second ends the program at once.
#pragma once

#include <atomic>

namespace vcnc {

/// Where what was found until then is told.
inline constexpr const char* kStopping = "\nstopping, with what was found; again: at once\n";
/// Installs the handlers for SIGINT and SIGTERM; the second one ends the program. `says` is written
/// to standard error at the first one; a literal.
void catch_stop_signals(const char* says = "");

/// Set by the first signal.
const std::atomic<bool>& stop_requested();

}  // namespace vcnc
