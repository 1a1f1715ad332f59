#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct TipRadius {
  using Port = TouchPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "tip_radius",
      .title = "Radius of the stylus ball",
      .family = Family::probe,
      .brief = "the ball is larger than its declared radius",
      .equation = R"(r = r_0 + dr
r_0: declared radius [m], dr: error [m]; the deflection along the surface normal grows by dr.)",
      .validity = "Constant, the same in all directions; wear of one spot is tip_lobing.",
      .source = "own derivation: a ball touches where the distance of its centre is its radius",
      .signature =
          R"(A constant dr along every normal: a bore looks smaller, a boss larger by dr. The same at
every feed and every deflection.)",
      .confusable = "scale_error probe_gain",
      .separate =
          "does not grow with the deflection (probe_gain) or with the size of the piece "
          "(scale_error); changes its sign between bore and boss",
      .showing = Showing::circle};

  double larger = 0;  ///< [m]

  static TipRadius nominal() { return {5e-6}; }
  bool null() const { return larger == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("larger_um", p.larger, unit::um, Range{-500, 500}, "true against declared radius");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.radius += larger;
  }
};

}  // namespace vcnc
