#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ChordError {
  using Port = PlanPort;
  static constexpr Place place = Place::nc;
  static constexpr EffectText text{
      .name = "chord_error",
      .title = "Chord error of arcs",
      .family = Family::nc,
      .brief = "the NC runs arcs as polygons",
      .equation = R"(n = ceil(|sweep| / (2 arccos(1 - d/R))) chords of equal angle;
largest distance from the arc: R (1 - cos(|sweep|/(2 n))) <= d
d: sagitta [m], R: radius of the arc [m])",
      .validity =
          R"(G2 and G3 only, helices too; at least three chords per turn. The corners of the polygon are
blended with the tolerance of G64 as any other, or stay within 0.5 um under G61: with sagittas
below that the blends are what is left of it.)",
      .source = "geometry; c^2/(8 R) for a chord c: Altintas, Manufacturing Automation, ch. 5",
      .signature =
          R"(Radial error between 0 and -d on circles, one wave per chord c = sqrt(8 R d), at the same places
in every lap; the speed dips at the corners. Not in the following error.)",
      .confusable = "pitch_periodic corner_cutting path_filter",
      .separate = "wavelength in the path, not in the position of an axis; only inwards",
      .showing = Showing::circle};

  double sagitta = 0;  ///< d [m]

  static ChordError nominal() { return {10e-6}; }
  bool null() const { return sagitta == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("sagitta_um", p.sagitta, unit::um, Range{0, 1000}, "height of the chords, 0 = true arcs");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.sagitta += sagitta;
  }
};

}  // namespace vcnc
