#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct SignalOffset {
  using Port = AnaloguePort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "signal_offset",
      .title = "Offsets of sine and cosine",
      .family = Family::acquisition,
      .brief = "sine and cosine do not swing about zero",
      .equation = R"(u = R cos(phi) + p R,   w = R sin(phi) + q R
p, q: offsets as shares of the amplitude R, phi = 2 pi x / period)",
      .validity = "Constant over time; one channel each.",
      .source = "Heydemann, Applied Optics 20 (1981) 3382",
      .signature =
          R"(Error of the reading of period/2pi (q cos(phi) - p sin(phi)): one period per signal period.)",
      .confusable = "signal_harmonics pitch_periodic",
      .separate = "one period per signal period of the deflection, not of the position",
      .showing = Showing::circle};

  Vec3 cosine = Vec3::Zero();  ///< per channel, share of the amplitude
  Vec3 sine = Vec3::Zero();

  static SignalOffset nominal() {
    return {.cosine = Vec3::Constant(0.03), .sine = Vec3::Constant(-0.02)};
  }
  bool null() const { return cosine.isZero(0) && sine.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("cosine_percent", p.cosine, Unit{"percent", 0.01}, Range{-50, 50},
          "offset of cos, of its amplitude, for x, y, z");
    visit("sine_percent", p.sine, Unit{"percent", 0.01}, Range{-50, 50},
          "offset of sin, of its amplitude, for x, y, z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.cosine += context.amplitude * cosine[context.channel];
    signal.sine += context.amplitude * sine[context.channel];
  }
};

}  // namespace vcnc
