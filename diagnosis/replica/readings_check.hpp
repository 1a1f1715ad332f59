// Whether readings of a probe, and twists, can be those of the axes that a map says.
//
// Of a table nothing tells which column is which but the model: if one reads as another is
// predicted (correlation above 0.95) and neither as it should itself (below 0.7), or if one
// is its own prediction turned (below -0.95), no fault of a machine did that. Nor did one make all
// readings two, 25.4 or a thousand times as large (within 3 %, least squares through zero, of at
// least two readings that follow what is predicted), nor one of them 25.4 times or more. Where the
// tool is against the table is within a millimetre of what is predicted; where it goes no farther
// than that (the ball of an R-test is held), only this is checked.
#pragma once

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

/// Throws MeasurementError naming the columns. `predicted` is what the declared machine would have
/// measured, one series per channel.
void check_readings(const Record& record, const std::vector<ComparedChannel>& channels,
                    const Prediction& predicted);

}  // namespace vcnc
