#include "model/drive/friction.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

template <class Real>
Real FrictionOf<Real>::step(const FrictionPort::Signal<Real>& terms, Real v, Real v_free, double dt,
                            Real inertia) {
  using std::abs, std::copysign, std::max;
  const Real mobility = dt / inertia;
  const auto dry_and_stiff = choose(terms.dry > Real(0), terms.stiffness, Real(0));
  const auto bristly = dry_and_stiff > Real(0);
  Real v1{}, bristle{};
  if (any(bristly)) {
    const Real shrink = 1.0 / (1.0 + terms.stiffness * abs(v) * dt / terms.dry);
    const Real centre = terms.skew / terms.stiffness, bent = bristle_ - centre;
    // F_f = at_rest + slope * v1
    const Real at_rest =
        bent * (terms.stiffness * shrink + terms.damping * (shrink - 1.0) / dt) + terms.skew;
    const Real slope = (terms.stiffness * dt + terms.damping) * shrink + terms.viscous;
    v1 = (v_free - mobility * at_rest) / (1.0 + mobility * slope);
    bristle = (bent + dt * v1) * shrink + centre;
  }
  if (!all(bristly)) {
    const Real level = terms.dry + copysign(Real(1), v_free) * terms.skew;
    const Real left = max(abs(v_free) - mobility * level, Real(0));
    v1 = choose(bristly, v1, copysign(left / (1.0 + mobility * terms.viscous), v_free));
    bristle = choose(bristly, bristle, Real(0));
  }
  bristle_ = bristle;
  force_ = (v_free - v1) / mobility;
  return v1;
}

template class FrictionOf<double>;
template class FrictionOf<Lanes>;

}  // namespace vcnc
