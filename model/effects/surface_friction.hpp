#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct SurfaceFriction {
  using Port = TouchPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "surface_friction",
      .title = "Friction of ball on piece",
      .family = Family::probe,
      .brief = "the stylus ball drags on the surface while scanning",
      .equation = R"(|F_t| <= mu F_n, opposite to the sliding velocity
mu: coefficient [-])",
      .validity = "Coulomb; ruby on metal 0.05 .. 0.2.",
      .source =
          "own derivation on the contact of model/probe/contact.hpp; drag of the deflection by mu "
          "F_n/k",
      .signature =
          R"(The deflection tilts against the motion by mu times its normal part: the sideways component
changes sign with the scanning direction, the normal one hardly.)",
      .confusable = "cross_talk",
      .separate = "turns with the scanning direction",
      .showing = Showing::circle};

  double coefficient = 0;

  static SurfaceFriction nominal() { return {0.15}; }
  bool null() const { return coefficient == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("coefficient", p.coefficient, unit::none, Range{0, 1},
          "Coulomb friction of ball on piece");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.friction += coefficient;
  }
};

}  // namespace vcnc
