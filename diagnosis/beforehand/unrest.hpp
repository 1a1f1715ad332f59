// How restless the drive of an axis is: what its signals do that nobody asked for.
//
//   in motion   what laps of one condition differ by while the axis is told to move, RMS
//   at rest     what is left less its moving mean over 21 ms while the axis has been told to stand
//               for 0.1 s, RMS: a drive that hunts within a gap does so for as long as it stands
//
// Both of what a signal is off the declared machine: laps begin anywhere within a sample, so that
// the signals themselves differ by that. Without moments that other laps do not share
// (lap_events.hpp).
//
// What is off itself differs between laps by as much as it changes within a sample: a following
// error of 40 um, one wave per lap of 3.5 s, by 36 nm where a lap begins half a millisecond later.
// So what is less than a tenth of what is off is no unrest, but part of that.
//
// Validity: an axis of which the position or the force is recorded; a vibration faster than half
// the rate of the record shows by its strength only.
#pragma once

#include <optional>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"

namespace vcnc {

struct Unrest {
  ComparedChannel channel;
  bool at_rest = false;
  std::optional<double> rms;  ///< [SI]; none where it is not known
  double off = 0;             ///< all that the signal is off while the axis moves, RMS [SI]
};

/// Whether a vibration of that RMS may be no more than what is off, seen from another lap.
bool is_part_of_what_is_off(double rms, double off);

/// What was noise when the machine was healthy.
struct HealthyNoise {
  std::vector<NoiseLine> lines;
  std::vector<Unrest> unrest;
};

/// Whether it is the position or the force of an axis.
bool is_of_drive(const ComparedChannel& channel, std::size_t axis);

/// Of every position and force of a record.
std::vector<Unrest> unrest_of(const Evidence& evidence);
/// Of a healthy run; no signal is quieter than its noise, which is that of the replica at least.
HealthyNoise healthy_noise(const Evidence& evidence);
/// The same of a prediction, which has no noise.
std::vector<Unrest> unrest_of(const Evidence& evidence, const Prediction& prediction);

/// What the means of laps of one condition differ by in a channel less a prediction, RMS over the
/// conditions of the largest less the smallest [SI]; none where nothing is repeated. A piece that
/// slips in its clamps, or drifts, does that.
std::optional<double> shift_between_laps(const Evidence& evidence, const Prediction& prediction,
                                         std::size_t channel);

}  // namespace vcnc
