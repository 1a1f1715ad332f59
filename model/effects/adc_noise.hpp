#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct AdcNoise {
  using Port = AnaloguePort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "adc_noise",
      .title = "Converter noise",
      .family = Family::acquisition,
      .brief = "white noise on every sine and cosine sample",
      .equation = R"(u += s n1,   w += s n2 at every 100 us
s: rms at the converter [V] over the gain 2.5 of the front end, n1, n2: standard normal)",
      .validity = "White, Gaussian, independent between the channels.",
      .source = "own derivation: rms of the reading = period/2pi s/R",
      .signature =
          R"(White scatter of the reading of period/2pi s/R rms, the same at rest and in motion.)",
      .confusable = "sample_jitter mains_hum",
      .separate = "independent of the speed",
      .showing = Showing::circle};

  double noise = 0;  ///< at the converter, rms [V]

  static AdcNoise nominal() { return {2e-3}; }
  bool null() const { return noise == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("noise_mV", p.noise, unit::mv, Range{0, 100}, "at the converter, rms");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, const Seat& seat) const {
    constexpr double kFrontEnd = 2.5;
    const std::int64_t count = 6 * context.moment.count + 2 * context.channel;
    signal.cosine += noise / kFrontEnd * seat.noise.gaussian(count);
    signal.sine += noise / kFrontEnd * seat.noise.gaussian(count + 1);
  }
};

}  // namespace vcnc
