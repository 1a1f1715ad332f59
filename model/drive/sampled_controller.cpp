#include "model/drive/sampled_controller.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

SampledController::SampledController(double velocity_gain, double inertia, double dead_time,
                                     double position)
    : velocity_gain_(velocity_gain),
      inertia_(inertia),
      measured_1_(position),
      measured_2_(position) {
  const double cycles = std::min(dead_time, kLongestDeadTime) / kPeriod;
  whole_ = static_cast<std::size_t>(cycles);
  rest_ = (cycles - static_cast<double>(whole_)) * kPeriod;
}

void SampledController::sample(const ServoPort::Signal<double>& gains, double position,
                               double velocity, double measured, double added) {
  const double v = (measured - measured_2_) / (2 * kPeriod);
  const double v_ref = gains.kv * (position - measured) + gains.velocity_ff * velocity;
  const double a_c = (velocity - velocity_1_) / kPeriod;
  const double force =
      velocity_gain_ * (v_ref - v) + gains.acceleration_ff * inertia_ * a_c + added;
  newest_ = (newest_ + 1) % kKept;
  demand_[newest_] = std::clamp(force, -gains.force_limit, gains.force_limit);
  measured_2_ = measured_1_;
  measured_1_ = measured;
  velocity_1_ = velocity;
}

double SampledController::force(double begin, double dt) const {
  const auto demanded = [this](std::size_t ago) {
    return demand_[(newest_ + kKept - ago) % kKept];
  };
  const double newer = std::clamp((begin + dt - rest_) / dt, 0.0, 1.0);
  return newer * demanded(whole_) + (1 - newer) * demanded(whole_ + 1);
}

}  // namespace vcnc
