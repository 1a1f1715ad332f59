// Guideway friction on a moving mass: static Stribeck law, or LuGre when pre-sliding is given.
//
//   Stribeck  F_f = sgn(v) g(v) + B v,  |F_f| <= Fs at rest
//             g(v) = Fc + (Fs - Fc) exp(-(v/v_s)^2)
//   LuGre     z' = v - sigma0 |v| z / g(v),   F_f = sigma0 z + sigma1 z' + B v
//
// Both are taken implicitly in the velocity update J (v1 - v0) = dt (F - F_f), so that no step size
// makes them unstable and the static law never reverses the motion within a step nor adds kinetic
// energy:
//   Stribeck  v1 = shrink(v_free, dt g(v0) / J) / (1 + dt B / J)
//             v_free is the velocity without friction, shrink(v, d) = sgn(v) max(|v| - d, 0);
//             it sticks exactly: v1 = 0 while |F| <= Fs
//   LuGre     z1 = (z0 + dt v1) / (1 + sigma0 |v0| dt / g(v0)); F_f is then linear in v1 and
//             solved for it
//
// Units: N, m, s or N m, rad, s. Fs counts where it exceeds Fc. Valid for friction that does not
// depend on load and position.
// Source: Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995) 419; Armstrong-Helouvry et
// al., Automatica 30 (1994) 1083.
#pragma once

#include "model/machine.hpp"

namespace vcnc {

class Friction {
 public:
  explicit Friction(const FrictionParams& params);

  /// Velocity at the end of a step from `v`, when without friction it would be `v_free`.
  double step(double v, double v_free, double dt, double inertia);

  /// Friction force over the last step, positive against positive motion.
  double force() const { return force_; }
  /// Level of dry friction g(v).
  double level(double v) const;

 private:
  double coulomb_, excess_, inverse_stribeck_, viscous_;
  double stiffness_, damping_;  ///< sigma0, sigma1; stiffness 0: static law
  double bristle_ = 0;          ///< z
  double force_ = 0;
};

}  // namespace vcnc
