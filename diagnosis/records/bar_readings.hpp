// Readings of a ball bar and the arcs that its map says they were made on.
//
// An arc is where its readings are: one that begins or ends elsewhere than they do is a mistake in
// its time, sweep, radius or feed, and would shift the angle of every reading. No bar moves by more
// than 5 mm.
#pragma once

#include "diagnosis/records/map_columns.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/records/time_base.hpp"

namespace vcnc {

/// Throws MeasurementError where a bar reads more than its range: its unit is another one, or it
/// tells its whole length.
void check_bar_length(const MapColumns& columns, const ImportMap::Signal& signal,
                      const MeasuredColumn& column);

/// Adds the commands of the arcs and the readings, on the time base of these (bar_course.hpp), and
/// warnings. `column` is that of the map's only signal. Throws ConfigError, MeasurementError.
void add_bar_on_arcs(const MapColumns& columns, const MeasuredColumn& column, const TimeBase& base,
                     Record& record);

}  // namespace vcnc
