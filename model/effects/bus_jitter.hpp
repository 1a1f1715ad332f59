#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct BusJitter {
  using Port = ReceptionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "bus_jitter",
      .title = "Jitter of the bus cycle",
      .family = Family::bus,
      .brief = "a drive takes its set-points a little too early or too late, at random",
      .equation = R"(x_k -> x_k + v_k s n_k
s: rms of the instant [s], n: standard normal, new in each cycle; v: velocity of the set-point)",
      .validity =
          "Small against the cycle of 1 ms: to first order in s, the velocity itself is kept.",
      .source =
          "own derivation: rms error of the set-point = speed times s; IEEE 1588 for typical sizes",
      .signature =
          R"(White scatter of the set-point of v s rms, shaped by the loop: roughness of force and following
error in proportion to the feed, nothing at rest.)",
      .confusable = "sample_jitter adc_noise encoder_quantisation bus_loss",
      .separate =
          "grows with the axis speed and shows in the force; sample_jitter shows in the reading "
          "only",
      .showing = Showing::circle_feeds};

  double jitter = 0;  ///< rms [s]

  static BusJitter nominal(bool) { return {20e-6}; }
  bool null() const { return jitter == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("jitter_us", p.jitter, unit::us, Range{0, 200}, "of the instant of a set-point, rms");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, const Seat& seat) const {
    signal.position += signal.velocity * (jitter * seat.noise.gaussian(context.moment.count));
  }
};

}  // namespace vcnc
