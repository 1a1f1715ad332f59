#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct GreaseDrag {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "grease_drag",
      .title = "Drag of grease films",
      .family = Family::friction,
      .brief = "friction that builds up over a small speed and then stays: sheared grease films",
      .equation = R"(F_f = F_g tanh(|v| / v_g) sgn(v)
F_g: drag of the films at their limiting shear stress [N or N m],
v_g: speed at which they come near it [m/s or rad/s])",
      .validity =
          R"(Films of constant thickness and temperature. Near rest it is viscous with F_g / v_g and holds
nothing; above 2 v_g it cannot be told from coulomb. Counts as dry friction for the effects that
change dry friction.)",
      .source =
          R"(limiting shear stress of lubricants, tau = tau_L tanh(eta gamma' / tau_L): Gecim, Winer, J.
Lubrication Technology 102 (1980) 213; rounded Coulomb friction in the survey of
Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083)",
      .signature =
          R"(Drive force that rises steeply up to 2 v_g and no further: the quadrant glitch of the same
coulomb level without its edge, friction that fades as the axis slows down.)",
      .confusable = "coulomb stribeck nonlinear_viscous viscous",
      .separate =
          "force at constant speeds around v_g: it rises where stribeck falls, and ends rising "
          "where "
          "nonlinear_viscous does not",
      .showing = Showing::circle_feeds};
  static constexpr bool dissipative = true;

  double level = 0;        ///< F_g [N or N m]
  double velocity = 5e-3;  ///< v_g [m/s or rad/s]

  static GreaseDrag nominal(bool rotary) {
    return {.level = rotary ? 5.0 : 200.0, .velocity = rotary ? 0.05 : 5e-3};
  }
  bool null() const { return level == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "level_Nm" : "level_N", p.level, rotary ? unit::newton_m : unit::newton,
          Range{0, 1e5}, "drag at the limiting shear stress");
    visit(rotary ? "velocity_deg_s" : "velocity_mm_s", p.velocity,
          rotary ? unit::deg_s : unit::mm_s, Range{1e-3, 1000}, "speed over which it builds up");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    using std::abs;
    using std::tanh;
    signal.dry += level * tanh(abs(context.velocity) / velocity);
  }
};

}  // namespace vcnc
