// A recording of vcnc as a record.
//
// Commands, positions, twist, force (share of the declared limit, in N or N m), deflection and the
// raw signals of the probe, from tick 0 on. Rows that were lost are missing. From the first alarm
// that stops the machine on nothing is taken: the drives then move on ramps of their own.
#pragma once

#include "analysis/recording.hpp"
#include "diagnosis/records/record.hpp"

namespace vcnc {

/// Throws RecordingError where nothing is left, ConfigError where its machine cannot be read.
Record record_from(const RecordingReader& recording);

/// The same of rows that are at hand.
Record record_from(const RunBegin& begin, const std::vector<TelemetryRow>& rows,
                   const std::vector<Alarm>& alarms);

}  // namespace vcnc
