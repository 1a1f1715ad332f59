#include "model/drive/friction.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

double Friction::step(const FrictionTerms& terms, double v, double v_free, double dt,
                      double inertia) {
  const double mobility = dt / inertia;
  double v1 = 0;
  if (terms.stiffness > 0 && terms.dry > 0) {
    const double shrink = 1 / (1 + terms.stiffness * std::abs(v) * dt / terms.dry);
    // F_f = at_rest + slope * v1
    const double at_rest =
        bristle_ * (terms.stiffness * shrink + terms.damping * (shrink - 1) / dt);
    const double slope = (terms.stiffness * dt + terms.damping) * shrink + terms.viscous;
    v1 = (v_free - mobility * at_rest) / (1 + mobility * slope);
    bristle_ = (bristle_ + dt * v1) * shrink;
  } else {
    const double left = std::max(std::abs(v_free) - mobility * terms.dry, 0.0);
    v1 = std::copysign(left / (1 + mobility * terms.viscous), v_free);
    bristle_ = 0;
  }
  force_ = (v_free - v1) / mobility;
  return v1;
}

}  // namespace vcnc
