#include "model/safety/supply.hpp"

#include <algorithm>

namespace vcnc {

Supply::Supply(const SupplyParams& params) : params_(params), energy_(params.hold_up_energy) {}

double Supply::power(const SupplyLoad& load) const {
  return params_.electronics_power + load.drives * params_.drive_power +
         std::max(0.0, load.motion_power) / params_.efficiency;
}

void Supply::step(bool mains, const SupplyLoad& load, double dt) {
  if (mains) {
    away_ = 0;
    return;
  }
  away_ += dt;
  energy_ = std::max(0.0, energy_ - power(load) * dt);
  if (energy_ == 0) dark_ = true;
}

bool Supply::failing() const {
  constexpr double kRounding = 1e-9;
  return away_ > 0 && away_ >= params_.signal_delay - kRounding;
}

}  // namespace vcnc
