// Ctrl-C and SIGTERM: the first asks the run to end in order, the second ends the program at once.
#pragma once

#include <atomic>

namespace vcnc {

/// Installs the handlers for SIGINT and SIGTERM.
void catch_stop_signals();

/// Set by the first signal.
const std::atomic<bool>& stop_requested();

}  // namespace vcnc
