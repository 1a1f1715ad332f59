// One axis on the bench: a drive with some effects, and simple motions.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "model/drive/axis_drive.hpp"

namespace vcnc::axis_bench {

inline constexpr double kCycleTime = kDriveLoopSteps * kDriveLoopTime;

/// A machine of which one axis has these effects and measures on its motor or load side.
template <class... Effect>
Machine machine_with(std::size_t axis, ServoParams::Feedback feedback, const Effect&... effect) {
  Machine machine;
  machine.axes[axis].servo.feedback = feedback;
  ((machine.effects.axis[axis].get<Effect>() = effect), ...);
  return machine;
}
/// Measuring on the load side.
template <class... Effect>
Machine machine_with(std::size_t axis, const Effect&... effect) {
  return machine_with(axis, ServoParams::Feedback::load, effect...);
}

/// The state of an axis at the end of a cycle.
struct Reading {
  double t = 0, position = 0;  ///< of the tool centre
  double force = 0;            ///< of the drive [N or N m]
  double second = 0;           ///< load side less motor side
};

class AxisBench {
 public:
  explicit AxisBench(const Machine& machine, std::size_t axis)
      : drive_(machine, axis, 1),
        limit_(machine.axes[axis].mechanics.force_limit),
        position_(machine.axes[axis].limits.start) {}

  /// Goes on for a time with constant acceleration: exactly what the drive interpolates.
  Reading go(double time, double acceleration = 0) {
    const long cycles = std::lround(time / kCycleTime);
    Reading reading;
    for (long k = 0; k < cycles; ++k) reading = cycle(acceleration);
    return reading;
  }
  /// A step of the commanded velocity, then a time at that speed.
  Reading at_speed(double velocity, double time) {
    velocity_ = velocity;
    return go(time);
  }
  Reading cycle(double acceleration = 0) {
    position_ += kCycleTime * (velocity_ + 0.5 * kCycleTime * acceleration);
    velocity_ += kCycleTime * acceleration;
    return follow({position_, velocity_});
  }
  Reading follow(const AxisSetpoint& target) {
    last_ = drive_.follow(target);
    ++cycles_;
    return {static_cast<double>(cycles_) * kCycleTime, last_.truth.back(), last_.force * limit_,
            last_.second};
  }

  double commanded() const { return position_; }
  const AxisCycle& last() const { return last_; }

 private:
  AxisDrive drive_;
  double limit_;
  double position_, velocity_ = 0;
  long cycles_ = 0;
  AxisCycle last_;
};

/// What a displacement effect does while the axis swings by `amplitude` with `frequency` about its
/// start: the axis with it against the axis without. It does not touch the loops, so the difference
/// is all its own.
struct Displaced {
  double t = 0, scale = 0, displacement = 0;
};
template <class... Effect>
std::vector<Displaced> swing(std::size_t axis, double amplitude, double frequency, double time,
                             const Effect&... effect) {
  AxisBench with(machine_with(axis, effect...), axis), without(machine_with(axis), axis);
  std::vector<Displaced> result;
  const double w = 2 * kPi * frequency;
  const long cycles = std::lround(time / kCycleTime);
  for (long k = 1; k <= cycles; ++k) {
    const double phi = w * kCycleTime * static_cast<double>(k);
    const AxisSetpoint target{amplitude * std::sin(phi), amplitude * w * std::cos(phi)};
    with.follow(target);
    without.follow(target);
    for (std::size_t i = 0; i < kDriveLoopSteps; ++i) {
      const auto step = static_cast<double>((k - 1) * kDriveLoopSteps + static_cast<long>(i) + 1);
      result.push_back({step * kDriveLoopTime, without.last().truth[i],
                        with.last().truth[i] - without.last().truth[i]});
    }
  }
  return result;
}

}  // namespace vcnc::axis_bench
