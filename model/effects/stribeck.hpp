#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Stribeck {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "stribeck",
      .title = "Stribeck friction (stiction)",
      .family = Family::friction,
      .brief = "more friction at rest than in motion, fading over a small speed",
      .equation = R"(F_f = sgn(v) (F_c + dF exp(-(v/v_s)^2))
dF: break-away force above sliding friction [N or N m], v_s: Stribeck velocity [m/s or rad/s])",
      .validity = "Added to coulomb. Exponent 2; published exponents lie between 0.5 and 2.",
      .source =
          "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083; feed drives: "
          "Altintas et al., CIRP Annals 60/2 (2011) 779",
      .signature =
          R"(A sharper quadrant glitch than Coulomb friction alone; stick-slip, saw teeth, at creep feed.
The force falls with the speed below v_s.)",
      .confusable = "coulomb presliding",
      .separate = "force at constant speeds around v_s; vanishes at higher feeds",
      .showing = Showing::circle};
  static constexpr bool dissipative = true;

  static constexpr double kFaded = 60;  ///< e^-60 is nothing beside any force

  double excess = 0;       ///< [N or N m]
  double velocity = 2e-3;  ///< [m/s or rad/s]

  static Stribeck nominal(bool rotary) {
    return {.excess = rotary ? 3.0 : 100.0, .velocity = rotary ? 0.02 : 2e-3};
  }
  bool null() const { return excess == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "excess_Nm" : "excess_N", p.excess, rotary ? unit::newton_m : unit::newton,
          Range{0, 1e5}, "break-away force above sliding friction");
    visit(rotary ? "velocity_deg_s" : "velocity_mm_s", p.velocity,
          rotary ? unit::deg_s : unit::mm_s, Range{1e-3, 1000},
          "speed over which the excess fades");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    using std::exp;
    const T x = context.velocity / velocity;
    if (x * x < kFaded) signal.dry += excess * exp(-x * x);
  }
};

}  // namespace vcnc
