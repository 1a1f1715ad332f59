// The motion that a record's machine was told to make: position and velocity of every axis at every
// sample, as the drives need them, and the forces on it that are known.
//
// A sample that is missing is bridged by a straight line (and said so), because a drive was told
// something. Velocity: derivative of the cubic spline (natural ends) through the positions; its
// error is h^2/24 of a jump of the jerk between two samples and of order h^4 elsewhere. Source:
// de Boor, A Practical Guide to Splines, 1978, ch. IV.
//
// An axis without a command, but with a position and a twist or a force, is *followed*: its drive
// is told to go where it was measured. What is noise there would be force of the prediction, which
// a smaller inertia makes less of; so the path is smoothed by cubics over a few samples to either
// side, three times, as far as the noise of its acceleration needs it, 12 ms at most (what is
// faster than some 60 Hz is lost then). Source: Savitzky and Golay, Analytical Chemistry 36 (1964)
// 1627. Where there are readings of a probe, no axis is followed: the pose is known better from the
// positions themselves.
#pragma once

#include <vector>

#include "diagnosis/records/record.hpp"
#include "model/axes.hpp"
#include "model/drive/axis_drive.hpp"

namespace vcnc {

/// A force on the load of an axis of which only a healthy run of the same motion tells
/// (healthy/unknown_force.hpp), and how fast the healthy machine was.
struct UnknownForce {
  std::vector<double> slow;      ///< means over 0.1 s, one per sample [N or N m]; empty: none
  std::vector<double> quick;     ///< the rest: where friction turns over, not as it is declared
  std::vector<double> velocity;  ///< as measured; empty: the force is taken as it comes
  /// Declared, of the machine that it was taken from [N or N m]; 0: it is no part of that.
  double dry_friction = 0;
};

struct CommandedMotion {
  /// What is known of one axis.
  enum class Told {
    nothing,   ///< it stands where the declared machine starts
    position,  ///< no command, but where it was measured: it is taken to be there
    command
  };
  PerAxis<Told> told{};
  PerAxis<bool> followed{};  ///< told is command, but made from where it was measured
  PerAxis<std::vector<double>> position, velocity;  ///< one per sample; empty where nothing is told
  PerAxis<std::vector<KnownForce>> force;           ///< one per sample; empty: none
  PerAxis<UnknownForce> unknown;
  std::vector<char> known;  ///< false: bridged, soon after, or a begin in motion

  AxisVector start(const AxisVector& declared) const;
};

CommandedMotion commanded_motion(const Record& record);

/// The record with a command wherever one is missing, on a straight line. Its replica still knows
/// that it was missing, and predicts nothing there.
Record with_bridged_commands(Record record);

/// Whether the drive of an axis is told to go where it was measured.
bool is_followed(const Record& record, std::size_t axis);

/// Derivative of the natural cubic spline through equidistant values.
std::vector<double> spline_derivative(const std::vector<double>& value, double period);

}  // namespace vcnc
