// What a machine is off a record in the signals of its drives, as a mean over the laps.
#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

/// Without readings of a probe, which take most of the time and tell nothing of drives.
Record of_drives(Record record);

/// Axes whose command, position and force are known, and no force beside that of the drive.
std::vector<std::size_t> axes_with_forces(const Record& record, const Replica& replica);

/// y - yhat per channel, every sample the mean over the laps that do the same; NaN outside them.
SeriesOfChannels off_in_laps(const Record& record, const std::vector<ComparedChannel>& channels,
                             const Prediction& predicted);

/// Its index; the channel must be there.
std::size_t channel_of(const std::vector<ComparedChannel>& channels, SignalKind kind,
                       std::size_t axis);

}  // namespace vcnc
