// Whether readings of a probe were taken when their time stamps say.
//
// A record is held against its own positions: with the axes where they were measured, the declared
// machine says when the ball is pushed. What is measured is fitted, in speeds (means over 10 ms),
//
//   dy/dt(t) = sum_i g_i dp_i/dt(t - T) + d/dt sum_a (b_a v_a + c_a v_a / |v_a|) + d/dt e v / |v|
//   |p|
//
// p the predicted readings, v the speeds of the axes. g are gains and cross-talk; b what goes along
// with a speed (lags and compliances), c play and friction, e a ball that drags: on a circle they
// look like a time, and are none. T is what leaves least, of -200 to 200 ms. Readings are late
// where T lies beyond the 5 ms of sample_latency, leaves a twenty-fifth of what any time up to that
// leaves, and both halves of the run say so (a clock that goes slow is later in the second).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

/// How late the readings of `signal` are [s], negative: early; nothing: no time is certain, or it
/// is one that an effect explains. `predicted` holds all readings with the axes where they were.
std::optional<double> lateness_of(const MeasuredSignal& signal, const Record& record,
                                  const std::vector<std::vector<double>>& predicted);

/// Throws MeasurementError naming the columns and how late they are. Where positions are not
/// recorded the commands stand for them, and it is a warning, as a drive may be late itself.
std::vector<std::string> check_reading_times(const Record& record, const Machine& declared,
                                             const std::optional<PieceParams>& piece);

}  // namespace vcnc
