#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct MainsHum {
  using Port = AnaloguePort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "mains_hum",
      .title = "Mains hum",
      .family = Family::acquisition,
      .brief = "the mains couples into the probe's cable",
      .equation = R"(u += a sin(2 pi f t),   w += a sin(2 pi f t)
a: amplitude before the front end [V] (the signals have R = 0.5 V), f: frequency [Hz])",
      .validity =
          "One frequency, the same on both signals of all channels; phase 0 at the first cycle.",
      .source = "own derivation: common voltage on both signals",
      .signature =
          R"(Error of the reading of period/2pi a/R (cos(phi) - sin(phi)) sin(2 pi f t): a line at f
at rest, whose size depends on the phase phi of the deflection: none at 45 deg.)",
      .confusable = "frame_vibration adc_noise signal_offset",
      .separate =
          "modulated with the signal period: a shift of the deflection by a quarter of a period "
          "changes it, frame_vibration stays",
      .showing = Showing::standstill};

  double amplitude = 0;   ///< [V]
  double frequency = 50;  ///< [Hz]

  static MainsHum nominal() { return {.amplitude = 5e-3}; }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("amplitude_mV", p.amplitude, unit::mv, Range{0, 200}, "on sine and cosine, peak");
    visit("frequency_Hz", p.frequency, unit::hz, Range{1, 5000}, "of the mains");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double hum = amplitude * std::sin(2 * kPi * frequency * context.moment.t);
    signal.cosine += hum;
    signal.sine += hum;
  }
};

}  // namespace vcnc
