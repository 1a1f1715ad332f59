#include "model/drive/friction.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {

template <class Real>
Real FrictionOf<Real>::step(const FrictionPort::Signal<Real>& terms, Real v, Real v_free, double dt,
                            Real mobility) {
  using std::abs, std::copysign, std::max;
  const auto stiffness = choose(terms.dry > Real(0), terms.stiffness, Real(0));
  const auto bristly = stiffness > Real(0);
  Real v1{}, bristle{};
  if (any(bristly)) {
    const Real speed = abs(v), slid = speed * dt;
    const Real whole = terms.dry + stiffness * slid;
    const Real freely = whole * (v_free - mobility * terms.skew);
    const Real bent = stiffness * bristle_ - terms.skew;
    const Real held = mobility * bent * (terms.dry - terms.damping * speed);
    const Real slope = (stiffness * dt + terms.damping) * terms.dry;
    v1 = (freely - held) / (whole * (1.0 + mobility * terms.viscous) + mobility * slope);
    bristle = ((bristle_ + dt * v1) * terms.dry + terms.skew * slid) / whole;
  }
  if (!all(bristly)) {
    const Real level = terms.dry + copysign(Real(1), v_free) * terms.skew;
    const Real left = max(abs(v_free) - mobility * level, Real(0));
    v1 = choose(bristly, v1, copysign(left / (1.0 + mobility * terms.viscous), v_free));
    bristle = choose(bristly, bristle, Real(0));
  }
  bristle_ = bristle;
  taken_ = v_free - v1;
  mobility_ = mobility;
  return v1;
}

template class FrictionOf<double>;
template class FrictionOf<Lanes>;

}  // namespace vcnc
