#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ContactLoss {
  using Port = TouchPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "contact_loss",
      .title = "Loss of contact",
      .family = Family::probe,
      .brief = "for a while the ball does not feel the piece",
      .equation = R"(no contact force for t_0 <= t < t_0 + T
t_0: start [s], T: duration [s]. The free ball swings: m x'' + d x' + k x = 0.)",
      .validity =
          R"(By the clock, wherever the ball is then; the cause (groove, chip, overspeed) is not
modelled. The surface comes back under the ball with a time constant of 20 ms, without a
blow.)",
      .source = "own definition; free swing as in model/probe/contact.hpp",
      .signature =
          R"(The deflection falls to zero with the probe's own frequency (22.7 Hz by default), stays
there and returns: a flat piece of trace at -predeflection, once.)",
      .confusable = "dropped_samples range_clip period_slip",
      .separate =
          "the deflection reads zero; dropped_samples hold the last value, range_clip the limit",
      .showing = Showing::circle};

  double start = 1;     ///< [s]
  double duration = 0;  ///< [s]

  static ContactLoss nominal() { return {.start = 2, .duration = 0.2}; }
  bool null() const { return duration == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("start_s", p.start, unit::s, Range{0, 1e5}, "since the first cycle");
    visit("duration_ms", p.duration, unit::ms, Range{0, 1e6}, "without contact; 0: never");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    // Half a step of margin: the same step whatever t was rounded to.
    const double since = context.moment.t - start + 0.5 * context.moment.dt;
    if (since >= 0 && since < duration) signal.lifted = T(1);
  }
};

}  // namespace vcnc
