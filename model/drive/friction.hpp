// Friction on a moving mass: dry friction of a level g, viscous friction B, and bristles where a
// stiffness is given. What g, B and the bristles are, the friction effects say (model/effects/).
//
//   without bristles  F_f = w + sgn(v) g + B v,  |F_f - w| <= g at rest
//   with bristles     z' = v - sigma0 |v| (z - w / sigma0) / g
//                     F_f = sigma0 z + sigma1 z' + B v                              (LuGre, w = 0)
//
// w, |w| <= g, skews it: sliding takes w + g one way and w - g the other. Of the bristles it is the
// middle between both, so that they are as stiff at either reversal, as elements of Maxwell's that
// slide at w + g and w - g are. A level g(sgn v) in z' would make them stiffer at one of them.
//
// Both are taken implicitly in the velocity update J (v1 - v0) = dt (F - F_f), so that no step size
// makes them unstable and dry friction never reverses the motion within a step nor adds kinetic
// energy:
//   without  v1 = shrink(v_free, dt (g + sgn(v_free) w) / J) / (1 + dt B / J)
//            v_free is the velocity without friction, shrink(v, d) = sgn(v) max(|v| - d, 0);
//            it sticks exactly: v1 = 0 while |F - w| <= g
//   with     z1 = ((z0 + dt v1) g + w |v0| dt) / D,  D = g + sigma0 |v0| dt;  F_f is then linear
//            in v1 and solved for it, m = dt / J:
//            v1 = (D (v_free - m w) - m (sigma0 z0 - w) (g - sigma1 |v0|))
//                 / (D (1 + m B) + m (sigma0 dt + sigma1) g)
//
// Units: N, m, s or N m, rad, s. g is taken at the velocity v0 of the step's begin.
// Source: Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995) 419; Armstrong-Helouvry et
// al., Automatica 30 (1994) 1083.
#pragma once

#include "model/drive/lanes.hpp"
#include "model/effects/ports.hpp"

namespace vcnc {

using FrictionTerms = FrictionPort::Signal<double>;

/// Real: double, or Lanes for several axes at a time.
template <class Real>
class FrictionOf {
 public:
  /// Velocity at the end of a step of `dt` from `v`, when without friction it would be `v_free`;
  /// mobility: dt / J.
  Real step(const FrictionPort::Signal<Real>& terms, Real v, Real v_free, double dt, Real mobility);

  /// Friction force over the last step, positive against positive motion.
  Real force() const { return taken_ / mobility_; }

 private:
  Real bristle_{};    ///< z
  Real taken_{};      ///< velocity, over the last step
  Real mobility_{1};  ///< in the last step
};

using Friction = FrictionOf<double>;

}  // namespace vcnc
