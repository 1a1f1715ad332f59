// Forces and readings of a probe that were not updated for a while.
//
// A channel that hangs keeps one value to the last bit, and jumps when it goes on. So does, by
// itself, a signal that is coarse, limited, or at rest; and the reading of a ball that touches
// nothing, in a record without noise. Hence a run of equal values counts where
//   it lasts 50 ms and 20 samples at least, ten times as long as all others that could count;
//   reading     it ends in a jump of ten usual steps, three times what follows; other readings go
//               on meanwhile, or it is far from none (a fifth of the largest). The last run has no
//               end: there 95 % of all steps before must be none of zero
//   force       the speed of its axis changes by a fifth of the largest meanwhile, it is neither
//               the largest nor the least, and ends in such a jump, of three steps
#pragma once

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// Such samples become missing; a warning names their times.
void take_out_frozen(Record& record);

}  // namespace vcnc
