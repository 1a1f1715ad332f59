// A record less what a healthy run of the same program has besides its declared machine.
//
//   y := y_now - mean over laps of (y_ref - yhat_ref(healthy)), or of the lap that came as late
//
// so that what the model gets wrong about the healthy machine cancels to first order. `healthy` is
// the declared machine with the piece where it was clamped for the healthy run, which is fitted
// first: what a change does to a reading depends on where the ball touches. Laps are matched by
// condition; samples without a partner become missing, and so do readings of the probe where the
// healthy machine is off the healthy run by 20 times their roughness, as in the moment of touching
// or while the drag on the ball turns over: there the model does not tell what a change does
// either. The noise of the reference stays in: variances grow by 1 + 1/n for n laps. Where laps
// differ in the same way in both runs (a lap that begins between samples, grease that is spread),
// each is held against the healthy one that came as late: their noise is then in what laps differ
// by.
//
// With its forces, the healthy run first tells the lags of its loops (controller_lags.hpp), then a
// force that no model of its friction has (unknown_force.hpp).
#pragma once

#include <utility>
#include <vector>

#include "diagnosis/beforehand/unrest.hpp"
#include "diagnosis/evidence/lap_events.hpp"
#include "diagnosis/healthy/unknown_force.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/axes.hpp"
#include "model/machine.hpp"

namespace vcnc {

struct DifferentialRecord {
  Record record;
  std::vector<std::pair<ComparedChannel, double>> noise_scale{};  ///< of standard deviations
  /// RMS of what a signal is off yhat in the healthy run, of what may be otherwise another day:
  /// readings of the probe, and where a force is unknown what is left of it in the drive's signals.
  std::vector<std::pair<ComparedChannel, double>> off{};
  /// What the healthy run is off its machine, as it was taken off each reading of the probe.
  std::vector<std::pair<ComparedChannel, std::vector<double>>> taken_off{};
  HealthyNoise noise{};
  ForceOfAxes unknown{};  ///< as in the healthy run
  Machine healthy;        ///< what the record is held against instead of the declared machine

  double off_in(const ComparedChannel& channel) const;  ///< 0: nothing is known
  /// `taken_off` of every channel; of those that are no readings empty.
  SeriesOfChannels taken_off_of(const std::vector<ComparedChannel>& channels) const;
  /// Of every channel, as Evidence takes them; empty for no difference.
  std::vector<double> noise_scales(const std::vector<ComparedChannel>& channels) const;
};

/// A healthy run and the declared machine with the piece where it was clamped for that.
struct HealthyRun {
  Record record;
  Machine machine;
  HealthyNoise noise;
  std::vector<LapEvent> events;  ///< what was not the same in all laps
  std::vector<ComparedChannel> channels;
  Prediction predicted;   ///< of `machine`
  ForceOfAxes unknown{};  ///< that the replica was given
};
HealthyRun healthy_run(const Record& record, Replica& replica, const Machine& declared);
/// The same with the forces that only this run tells (unknown_force.hpp), which its replica is
/// given and every replica that is held against it must be, as less_healthy() has them.
HealthyRun healthy_run_with_forces(const Record& record, MachineReplica& replica,
                                   const Machine& declared);

/// Whether every motion of a run has a partner in the healthy one; never where none is known.
bool same_program(const Record& now, const Record& healthy);

/// Throws MeasurementError where a healthy run cannot be held against this one: it does none of its
/// motions, has no signal in common, is of another kinematics, or knows other forces of the test.
void check_comparable(const Record& now, const Record& healthy);

/// Throws as check_comparable().
DifferentialRecord less_healthy(const Record& now, const HealthyRun& healthy);

}  // namespace vcnc
