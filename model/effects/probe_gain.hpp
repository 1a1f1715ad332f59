#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ProbeGain {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "probe_gain",
      .title = "Gain of the probe",
      .family = Family::probe,
      .brief = "the probe reads its deflection in too large or too small a measure",
      .equation = R"(x_sensed = (1 + g) x
x: deflection of one channel [m], g: gain error of that channel [-])",
      .validity = "Linear, one gain per channel; see cross_talk for the rest of the matrix.",
      .source = "diagonal of the probe matrix: ISO 230-10, ISO 10360-5 (scanning probes)",
      .signature =
          R"(Error g times the deflection, along the channel: with a constant predeflection a
constant along the normal, with unequal x and y two periods per turn of the normal.)",
      .confusable = "tip_radius scale_error stylus_bending pivot_length",
      .separate = "in proportion to the deflection: the same piece at two predeflections",
      .showing = Showing::circle};

  Vec3 gain = Vec3::Zero();  ///< per channel

  static ProbeGain nominal() { return {Vec3(0.01, 0.005, -0.005)}; }
  bool null() const { return gain.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("gain_percent", p.gain, Unit{"percent", 0.01}, Range{-50, 50},
          "gain error of x, y, z in the probe frame");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    for (int i = 0; i < 3; ++i) signal.deflection[i] *= T(1 + gain[i]);
  }
};

}  // namespace vcnc
