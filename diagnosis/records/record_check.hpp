// Whether the signals of a record can be what its map says they are.
//
// Everything here compares a record with itself and with the declared machine; nothing is put
// right. What cannot be (a velocity that is another column's, positions a thousand times too large
// for the travel, a command that belongs to another axis) is refused with the factor or the columns
// that would explain it; what is only suspicious becomes a warning of the record.
//
//   velocity    regression of the velocity signal on the derivative of the position: the slope must
//               be 1 within 10 %, the correlation above 0.7; 0.5 ms after it at most
//               (late_velocity.hpp)
//   command     correlation of the position's steps with those of every axis' command; the slope of
//               what it is ahead over the command's velocity: 2 ms at most
//               a position that stays while its command goes on, or that is the command itself:
//               residual of the regression below 1e-9 of its span
//   twist       its span against that of the position: half at most; what it is behind as a part of
//               the velocity: 0.2 ms at most
//   force       least squares F = M a + B v + C sgn(v) + D (band-limited): M against the declared
//               mass, the share that is explained, the sign; five times the declared limit at most;
//               6 ms late or early at most, where another time leaves a quarter of it
//   range       positions against the declared travel, speeds against the declared limit
//   frozen      forces and readings that were not updated (frozen_check.hpp): they become missing
//   values      constant, saturated (equal extremes in a row), quantised (step of the values),
//               missing samples, single ones far off both neighbours
#pragma once

#include <string>
#include <vector>

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// Adds warnings and the resolutions of the signals to `record`. Throws MeasurementError where a
/// signal cannot be what it is said to be. `declared` may be null.
void check_record(Record& record, const Machine* declared);

/// What of that needs a machine, where the record was made without one or for another: ranges,
/// speeds, forces and inertias. Warnings that the record has already are not repeated.
void check_against(Record& record, const Machine& declared);

/// Whether one series is the other, but for a factor and an offset, as nothing that was measured
/// is.
bool is_copy(const std::vector<double>& value, const std::vector<double>& of);

/// The usual mistake that makes a factor of this size, to be added to a message; empty: none does.
std::string usual_mistake(double factor);

/// The step that all differences are multiples of; 0: none was found.
double resolution_of(const std::vector<double>& value);

}  // namespace vcnc
