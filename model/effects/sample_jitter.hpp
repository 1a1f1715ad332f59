#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct SampleJitter {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "sample_jitter",
      .title = "Jitter of the sampling instant",
      .family = Family::acquisition,
      .brief = "the converter samples a little too early or too late, at random",
      .equation = R"(x_k = x(t_k + s n_k), to first order in s
s: rms of the instant [s], n: standard normal; all channels share one clock)",
      .validity =
          "Small against 100 us; the deflection's speed is taken from the last two samples.",
      .source = "own derivation: rms error = speed of the deflection times s",
      .signature = "White scatter in proportion to the speed of the deflection, none at rest.",
      .confusable = "adc_noise bus_jitter",
      .separate = "vanishes at rest",
      .showing = Showing::circle_feeds};

  double jitter = 0;  ///< rms [s]

  static SampleJitter nominal() { return {5e-6}; }
  bool null() const { return jitter == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("jitter_us", p.jitter, unit::us, Range{0, 50}, "of the sampling instant, rms");
  }

  template <class T>
  struct State {
    Vec3Of<T> last = Vec3Of<T>::Zero();
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state,
            const Seat& seat) const {
    const Vec3Of<T> now = signal.deflection;
    const double late = jitter * seat.noise.gaussian(context.moment.count) / context.moment.dt;
    if (context.moment.count > 0) signal.deflection += (now - state.last) * T(late);
    state.last = now;
  }
};

}  // namespace vcnc
