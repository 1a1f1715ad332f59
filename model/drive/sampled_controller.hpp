// Position controller that samples once per bus cycle (T), as laboratory and older axes have it:
// proportional in position and velocity, velocity differenced from the measured position.
//
//   v(k) = (x_f(k) - x_f(k-1)) / T,   x_f(k) = (x_m(k) + x_m(k-1)) / 2
//   u(k) = Kp (Kv (x_c(k) - x_m(k)) + kvff v_c(k) - v(k)) + kaff J (v_c(k) - v_c(k-1)) / T + F_a(k)
//   |u| <= F_max;  F_a: what somebody adds to the demand
// The force is u(k) from k T + d on, until u(k+1) takes over: a hold of one cycle after a dead time
// d. What a drive reports as its force is the demand u(k).
//
// A dead time that ends within a plant step acts on that step by its share of it, so that impulses
// are exact and d may take any value.
//
// Units: N, m, s or N m, rad, s. Valid for slow loops: d, half a cycle of hold and half a cycle of
// averaging are lags in the velocity loop, whose crossover Kp / J should stay below
// 1 / (d + T). There is no integrator: a constant load F leaves a lag of F / (Kp Kv).
// Source: controller of the EMPS benchmark, Janot, Gautier, Brunot, Data Set and Reference Models
// of EMPS, Workshop on Nonlinear System Identification Benchmarks (2019).
#pragma once

#include <array>

#include "model/effects/ports.hpp"

namespace vcnc {

class SampledController {
 public:
  static constexpr double kPeriod = 1e-3;            ///< of the bus cycle [s]
  static constexpr double kLongestDeadTime = 20e-3;  ///< [s]

  /// `inertia`: what acceleration feed-forward takes the axis to have; at rest at `position`.
  SampledController(double velocity_gain, double inertia, double dead_time, double position);

  /// Sample k: what is commanded, measured and added to the demand, at the end of a cycle.
  void sample(const ServoPort::Signal<double>& gains, double position, double velocity,
              double measured, double added = 0);
  /// u of the last sample.
  double demand() const { return demand_[newest_]; }
  /// Mean force from `begin` to `begin + dt` [s] after the last sample, within one cycle.
  double force(double begin, double dt) const;

 private:
  // One more than the longest dead time, in cycles of 1 ms, and the newest.
  static constexpr std::size_t kKept = 22;

  double velocity_gain_, inertia_;
  std::size_t whole_;               ///< cycles of dead time
  double rest_;                     ///< of it beyond them [s]
  double measured_1_, measured_2_;  ///< one and two samples ago
  double velocity_1_ = 0;           ///< commanded, one sample ago
  std::array<double, kKept> demand_{};
  std::size_t newest_ = 0;
};

}  // namespace vcnc
