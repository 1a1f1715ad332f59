// How much later a velocity was recorded than the position of its axis.
//
// A drive tells the speed of its motor, filtered and some cycles after the control has told where
// the axis is. Of a velocity that is late by tau
//
//   v - x' = -tau x''                       x: position, means of all over 10 ms
//
// so tau is the slope of a least squares fit. Only moments count at which the axis is faster than a
// tenth of its highest speed: where it turns over, its transmission winds up the other way, so that
// motor and position go apart by themselves.
#pragma once

#include <optional>

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// tau [s]; empty where there is no velocity or no position of the axis, or where they tell it to
/// no better than 0.2 ms (standard error).
std::optional<double> lateness_of_velocity(const Record& record, std::size_t axis);

}  // namespace vcnc
