#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct TipLobing {
  using Port = TouchPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "tip_lobing",
      .title = "Lobing of the stylus ball",
      .family = Family::probe,
      .brief = "the ball is not round, or the probe not equally stiff around its axis",
      .equation = R"(r = r_0 + A rho^n cos(n (theta - psi))
r_0: declared radius [m], A: amplitude [m], n: lobes, psi: direction of a lobe [rad]; theta, rho:
direction and length of the surface normal in the probe's xy plane (from the piece to the ball).)",
      .validity =
          R"(One sectoral spherical harmonic: A cos(n theta) on the equator, fading towards the pole
of the ball. The normal is that of 100 us before. Three lobes are typical of
three-legged suspensions.)",
      .source = "own definition; pre-travel lobing of probes: ISO 230-10 (probing systems)",
      .signature =
          R"(In a ring: A cos(n (theta - psi)), the same in both senses, at every feed and radius.
Turns with the probe.)",
      .confusable = "straightness squareness scale_error stylus_bending cross_talk",
      .separate =
          "turns with the probe (spindle orientation, C of a head); independent of the radius",
      .showing = Showing::circle};

  double amplitude = 0;  ///< [m]
  int lobes = 3;
  double phase = 0;  ///< [rad]

  static TipLobing nominal() { return {.amplitude = 1e-6}; }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("amplitude_um", p.amplitude, unit::um, Range{-300, 300}, "of the radius");
    visit("lobes", p.lobes, Range{2, 12}, "periods around the probe's axis");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360},
          "direction of a lobe, from x of the probe");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    // Real part of (n_x + i n_y)^n exp(-i n psi).
    const double c = std::cos(lobes * phase), s = std::sin(lobes * phase);
    T re = T(c), im = T(-s);
    for (int i = 0; i < lobes; ++i) {
      const T next = re * context.normal_T.x() - im * context.normal_T.y();
      im = re * context.normal_T.y() + im * context.normal_T.x();
      re = next;
    }
    // Before the first contact there is no normal, and the ball is round.
    signal.radius += amplitude * re;
  }
};

}  // namespace vcnc
