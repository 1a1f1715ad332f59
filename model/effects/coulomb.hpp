#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Coulomb {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr bool constant = true;
  static constexpr EffectText text{
      .name = "coulomb",
      .title = "Coulomb friction",
      .family = Family::friction,
      .brief = "dry friction of the guideways, the same at every speed",
      .equation = R"(F_f = F_c sgn(v),  |F_f| <= F_c at rest
F_c: level [N or N m])",
      .validity =
          "Independent of load, position and temperature; sticks exactly "
          "(model/drive/friction.hpp).",
      .source = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
      .signature =
          R"(Drive force jumps by 2 F_c at each reversal; the axis stands still until the loop has built it
up: a quadrant glitch just after the reversal, up to 2 F_c / (J w_v Kv), fading with Ti.)",
      .confusable = "stribeck presliding velocity_gain_error",
      .separate = "the level of the force at several speeds: constant",
      .showing = Showing::circle};
  static constexpr bool dissipative = true;

  double level = 0;  ///< [N or N m]

  static Coulomb nominal(bool rotary) { return {rotary ? 5.0 : 250.0}; }
  bool null() const { return level == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "level_Nm" : "level_N", p.level, rotary ? unit::newton_m : unit::newton,
          Range{0, 1e5}, "sliding friction");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.dry += level;
  }
};

}  // namespace vcnc
