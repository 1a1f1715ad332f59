// Which samples of a record can be compared with a prediction at all.
//
// Not those that are missing in either, not force and twist of an axis that stands (stuck friction
// and the loop's integral are not predictable there) nor its position once it has settled, not
// readings of the probe about the moment of touching, which depends on where exactly the piece
// lies, not those of a ball that rests on the piece until its drag has turned over again, and not
// such as are rough while the ball slides slowly: the drag turns over, nobody can tell when.
#pragma once

#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

/// One flag per channel and sample; `declared` is what the declared machine would have measured,
/// `deflected` the same with readings that say where the ball is: none where its period slipped.
std::vector<std::vector<char>> comparable_samples(const Record& record,
                                                  const std::vector<ComparedChannel>& channels,
                                                  const SeriesOfChannels& measured,
                                                  const Prediction& declared,
                                                  const Prediction& deflected);

}  // namespace vcnc
