// Memory of a command that makes and forgets series of samples by the thousand.
#pragma once

namespace vcnc {

/// What is freed is kept for the next series, and threads that live for milliseconds share it, as
/// giving it back and clearing it again took 6 % of a diagnosis. Before any thread begins.
void keep_memory();

}  // namespace vcnc
