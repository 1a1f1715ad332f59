// The laps of a record that its map tells, by times or by a column.
//
// Laps of one condition repeat a motion: axes go the same way in them (same_way() in
// stretches.hpp) and they last as long, within 2 % and two samples. Where the map says that laps of
// another motion do, it is refused; where it says of none which repeats which (a lap_column alone),
// and of a lap that was broken off, that is a motion of its own, with a warning.
#pragma once

#include "diagnosis/records/map_columns.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/records/time_base.hpp"

namespace vcnc {

/// Adds the stretches, and warnings. Throws ConfigError: a lap that reaches beyond the run, is too
/// short, or does another motion.
void add_told_laps(const MapColumns& columns, const TimeBase& base, Record& record);

}  // namespace vcnc
