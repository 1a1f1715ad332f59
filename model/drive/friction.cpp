#include "model/drive/friction.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

Friction::Friction(const FrictionParams& params)
    : coulomb_(params.coulomb),
      excess_(std::max(params.breakaway - params.coulomb, 0.0)),
      inverse_stribeck_(1 / params.stribeck_velocity),
      viscous_(params.viscous),
      stiffness_(coulomb_ + excess_ > 0 ? params.presliding_stiffness : 0),
      damping_(params.presliding_damping) {}

double Friction::level(double v) const {
  if (excess_ == 0) return coulomb_;
  const double x = v * inverse_stribeck_;
  return coulomb_ + excess_ * std::exp(-x * x);
}

double Friction::step(double v, double v_free, double dt, double inertia) {
  const double mobility = dt / inertia;
  double v1 = 0;
  if (stiffness_ > 0) {
    const double shrink = 1 / (1 + stiffness_ * std::abs(v) * dt / level(v));
    // F_f = at_rest + slope * v1
    const double at_rest = bristle_ * (stiffness_ * shrink + damping_ * (shrink - 1) / dt);
    const double slope = (stiffness_ * dt + damping_) * shrink + viscous_;
    v1 = (v_free - mobility * at_rest) / (1 + mobility * slope);
    bristle_ = (bristle_ + dt * v1) * shrink;
  } else {
    const double left = std::max(std::abs(v_free) - mobility * level(v), 0.0);
    v1 = std::copysign(left / (1 + mobility * viscous_), v_free);
  }
  force_ = (v_free - v1) / mobility;
  return v1;
}

}  // namespace vcnc
