// The spindle drive: ramp-limited speed, and orientation to an angle (M19).
//
//   speed        omega' = +-alpha towards the commanded speed, alpha the spindle's acceleration;
//                the commanded speed is clamped to max_speed
//   orientation  to the next occurrence of the target that can be reached in the direction of
//                turning (the shorter way from rest): omega = sqrt(2 * 0.8 alpha * distance), the
//                speed from which 0.8 alpha just stops there; near the end it changes over to
//                omega = kOrientGain * distance, so that the approach ends smoothly
//
// Valid for an inverter-fed spindle whose torque allows alpha [rad/s^2] at every speed [rad/s]. Not
// modelled: field weakening, load torque, run-out. A speed beyond max_speed is clamped, and the
// result says so. Source: time-optimal braking curve with a linear end zone.
#pragma once

#include "model/machine.hpp"

namespace vcnc {

enum class SpindleMode { off, clockwise, counter_clockwise, orient };

/// What one cycle of the spindle brought about.
struct SpindleCycle {
  double angle = 0;       ///< at the end of the cycle, in [0, 2 pi) [rad]
  double speed = 0;       ///< at the end of the cycle; clockwise (M3) is positive [rad/s]
  bool at_speed = true;   ///< the commanded speed is reached (off: standing; orient: oriented)
  bool oriented = false;  ///< orient: standing at the target angle
  bool limited = false;   ///< the commanded speed exceeds max_speed
};

class SpindleDrive {
 public:
  explicit SpindleDrive(const SpindleParams& params);

  /// One bus cycle of 1 ms. `speed` [rad/s] is a magnitude and counts for the two turning modes.
  SpindleCycle step(SpindleMode mode, double speed);

  bool standing() const { return speed_ == 0; }

 private:
  double toward_angle() const;

  SpindleParams params_;
  double angle_ = 0;  ///< [0, 2 pi)
  double speed_ = 0;
};

}  // namespace vcnc
