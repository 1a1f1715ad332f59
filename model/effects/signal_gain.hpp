#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct SignalGain {
  using Port = AnaloguePort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "signal_gain",
      .title = "Unequal amplitudes of sine and cosine",
      .family = Family::acquisition,
      .brief = "the sine signal is larger than the cosine",
      .equation = R"(w = (1 + g) R sin(phi)
g: gain error [-], phi = 2 pi x / period, R: amplitude)",
      .validity = "Constant over time; one channel each.",
      .source = "Heydemann, Applied Optics 20 (1981) 3382",
      .signature =
          R"(Error of the reading of period/2pi (g/2) sin(2 phi): two periods per signal period.)",
      .confusable = "signal_phase signal_harmonics",
      .separate = "over the deflection in periods: sin 2 phi",
      .showing = Showing::circle};

  Vec3 gain = Vec3::Zero();  ///< per channel

  static SignalGain nominal() { return {Vec3::Constant(0.05)}; }
  bool null() const { return gain.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("gain_percent", p.gain, Unit{"percent", 0.01}, Range{-50, 50},
          "amplitude of sin against cos for x, y, z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.sine *= 1 + gain[context.channel];
  }
};

}  // namespace vcnc
