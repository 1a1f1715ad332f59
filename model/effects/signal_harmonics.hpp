#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct SignalHarmonics {
  using Port = AnaloguePort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "signal_harmonics",
      .title = "Harmonics of the probe's signals",
      .family = Family::acquisition,
      .brief = "the signals of the scale are not pure sines",
      .equation =
          R"(u = R f(phi),  w = R f(phi - pi/2),   f = cos(phi) + h2 cos(2 phi) + h3 cos(3 phi)
h2, h3: shares of the amplitude R [-], phi = 2 pi x / period; both detectors see the same waveform a
quarter of a period apart:  w = R (sin(phi) - h2 cos(2 phi) - h3 sin(3 phi)).)",
      .validity =
          R"(Second and third harmonic in phase with the first. Comes before signal_phase,
signal_gain and signal_offset, which act on the distorted signals.)",
      .source =
          "own derivation by the double and triple angle; third harmonic and its four periods: "
          "usual in encoder interpolation",
      .signature =
          R"(Error of the reading: -period/2pi h3 sin(4 phi), four periods per signal period, and
-period/2pi h2 (cos(phi) + sin(phi)) cos(2 phi): one and three periods, at most 1.09 h2.)",
      .confusable = "signal_offset signal_gain signal_phase encoder_subdivision",
      .separate =
          "four (h3) or three (h2) periods per signal period; a correction of the ellipse leaves "
          "them",
      .showing = Showing::circle};

  Vec3 second = Vec3::Zero();  ///< per channel, share of the amplitude
  Vec3 third = Vec3::Zero();

  static SignalHarmonics nominal() {
    return {.second = Vec3::Constant(0.01), .third = Vec3::Constant(0.01)};
  }
  bool null() const { return second.isZero(0) && third.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("second_percent", p.second, Unit{"percent", 0.01}, Range{-20, 20},
          "second harmonic of the amplitude, for x, y, z");
    visit("third_percent", p.third, Unit{"percent", 0.01}, Range{-20, 20},
          "third harmonic of the amplitude, for x, y, z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double R = context.amplitude;
    const double h2 = R * second[context.channel], h3 = R * third[context.channel];
    const T c = signal.cosine / R, s = signal.sine / R;
    const T c2 = c * c - s * s;                                                  // cos 2 phi
    const T c3 = c * (c * c - 3.0 * (s * s)), s3 = s * (3.0 * (c * c) - s * s);  // of 3 phi
    signal.cosine += h2 * c2 + h3 * c3;
    signal.sine -= h2 * c2 + h3 * s3;
  }
};

}  // namespace vcnc
