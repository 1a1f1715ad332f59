#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct NonlinearViscous {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "nonlinear_viscous",
      .title = "Non-linear viscous friction",
      .family = Family::friction,
      .brief = "friction that grows with a power of the speed: oil films, churning, seals",
      .equation = R"(F_f = F_1 (|v| / v_1)^n sgn(v) = c |v|^n sgn(v),   c = F_1 / v_1^n
F_1: friction [N or N m] at v_1 = 100 mm/s or 100 deg/s, n: exponent)",
      .validity =
          R"(Below 10 um/s or 10 urad/s linear in v, so that for n < 1 the axis can start. Isothermal: oil
that warms is friction_fade. n = 1 is viscous, n -> 0 coulomb, n = 2 churning and fans.)",
      .source =
          "power law: own choice for the curvature of measured friction over speed; surveyed by "
          "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
      .signature =
          R"(Curvature of the drive force over the speed: convex for n > 1, concave for n < 1. In the
position only while the speed changes, as with viscous friction: an error that scales as
v^(n-1) a.)",
      .confusable = "viscous stribeck coulomb",
      .separate =
          "force at six or more constant speeds over two decades: the slope of log(F - F_c) over "
          "log v is n; stribeck falls with the speed, this never does",
      .showing = Showing::circle_feeds};
  static constexpr bool dissipative = true;

  double force = 0;       ///< at the reference speed [N or N m]
  double exponent = 0.5;  ///< n

  static NonlinearViscous nominal(bool rotary) {
    return {.force = rotary ? 5.0 : 200.0, .exponent = 0.5};
  }
  bool null() const { return force == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "torque_Nm" : "force_N", p.force, rotary ? unit::newton_m : unit::newton,
          Range{0, 1e5}, rotary ? "friction at 100 deg/s" : "friction at 100 mm/s");
    visit("exponent", p.exponent, unit::none, Range{0.3, 3}, "power of the speed, 1 = viscous");
  }

  static constexpr double reference_speed(bool rotary) { return rotary ? 100 * kDegree : 0.1; }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, const Seat& seat) const {
    using std::abs;
    using std::pow;
    constexpr double kLinearBelow = 1e-5;  // [m/s or rad/s]
    const double v_1 = reference_speed(seat.rotary);
    T speed = abs(context.velocity);
    if (speed < kLinearBelow) speed = T(kLinearBelow);
    const T ratio = speed / v_1;
    signal.viscous += force / v_1 * pow(ratio, exponent - 1);
  }
};

}  // namespace vcnc
