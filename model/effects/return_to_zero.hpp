#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ReturnToZero {
  using Port = TouchPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "return_to_zero",
      .title = "Return to zero",
      .family = Family::probe,
      .brief = "friction in the probe's suspension: the free ball rests anywhere within a band",
      .equation = R"(|F_h| <= k h, opposite to the motion of the suspension
h: half width [m], k: spring rate of the probe [N/m])",
      .validity =
          "Coulomb friction of the guides; no lost motion in lasting contact, where the surface "
          "decides.",
      .source =
          "own derivation; order of size: scanning probes return within 1 um (typical) of zero "
          "after 0.5 mm",
      .signature = "A free probe does not read zero after a deflection, by up to h.",
      .confusable = "probe_drift",
      .separate = "steps at contacts, not with time",
      .showing = Showing::s_piece};

  double half_width = 0;  ///< [m]

  static ReturnToZero nominal() { return {1e-6}; }
  bool null() const { return half_width == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("half_width_um", p.half_width, unit::um, Range{0, 50}, "hysteresis of the suspension");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.return_to_zero += half_width;
  }
};

}  // namespace vcnc
