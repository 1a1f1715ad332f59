// What an axis does in one lap and not in another.
//
// An axis that stops in its friction stays where it is, or breaks away once more, and the rounding
// of its encoder decides which. No model can tell, so that such a moment is neither compared nor
// counted as noise of the laps: it is where position, twist or force of an axis differ between the
// laps of a condition by 40 times what they do elsewhere, until it has faded to 4 times. If that is
// more than a fiftieth of the laps, it is no event but what the laps are like.
//
// Where all laps but one agree, to those 4 times or a tenth of what the one is off, it is left out
// alone, up to a tenth of all: the first lap still has what came before it.
#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/evidence/partition.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

struct LapEvent {
  std::size_t axis = 0;
  std::size_t begin = 0, end = 0;  ///< samples [begin, end) of one lap
};

/// Of every lap of the condition that has one, or of the one lap, with 50 ms before and after, in
/// the order of axes and time; `difference`: measured less predicted, NaN where that is not
/// compared.
std::vector<LapEvent> lap_events(const Partition& partition, double period,
                                 const std::vector<ComparedChannel>& channels,
                                 const SeriesOfChannels& difference);

}  // namespace vcnc
