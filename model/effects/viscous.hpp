#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Viscous {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr bool constant = true;
  static constexpr EffectText text{
      .name = "viscous",
      .title = "Viscous friction",
      .family = Family::friction,
      .brief = "friction in proportion to the speed: oil, seals, the motor's own damping",
      .equation = R"(F_f = B v
B: coefficient [N s/m or N m s/rad])",
      .validity = "Linear; for curvature over the speed see nonlinear_viscous.",
      .source = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
      .signature =
          R"(Drive force in proportion to the speed. In the position only where it changes faster than the
velocity loop's integral follows: a lag of Ti B a / (Kp Kv) while accelerating.)",
      .confusable = "nonlinear_viscous acceleration_ff_error",
      .separate = "the force at several constant speeds: a straight line through F_c",
      .showing = Showing::line};
  static constexpr bool dissipative = true;

  double coefficient = 0;  ///< [N s/m or N m s/rad]

  static Viscous nominal(bool rotary) { return {rotary ? 5.0 : 2000.0}; }
  bool null() const { return coefficient == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "coefficient_Nms_per_rad" : "coefficient_Ns_per_m", p.coefficient,
          rotary ? unit::nm_s_per_rad : unit::n_s_per_m, Range{0, 1e6}, "viscous friction");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.viscous += coefficient;
  }
};

}  // namespace vcnc
