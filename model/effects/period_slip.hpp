#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct PeriodSlip {
  using Port = ReadingPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "period_slip",
      .title = "Slip of the period counter",
      .family = Family::acquisition,
      .brief = "from some time on a channel is off by whole signal periods",
      .equation = R"(x_read += n l  for t >= t_0
n: periods, l: signal period [m], t_0: time of the slip [s])",
      .validity =
          R"(A slip that the module did not notice: no flag is set. A slip by overspeed arises by
itself in the counter (model/probe/signals.hpp) and is flagged.)",
      .source = "own definition; counting of sin/cos signals: model/probe/signals.hpp",
      .signature =
          "One step of exactly n l in one channel, at one time; before and after it nothing.",
      .confusable = "contact_loss lateral_play return_to_zero",
      .separate = "the step is a whole multiple of the signal period and never comes back",
      .showing = Showing::standstill};

  int periods = 0;
  int channel = 0;   ///< 0, 1, 2 for x, y, z
  double start = 1;  ///< [s]

  static PeriodSlip nominal() { return {.periods = 1, .channel = 0, .start = 1}; }
  bool null() const { return periods == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("periods", p.periods, Range{-1000, 1000}, "gained");
    visit("channel", p.channel, Range{0, 2}, "0: x, 1: y, 2: z");
    visit("start_s", p.start, unit::s, Range{0, 1e5}, "time of the slip since the first cycle");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    // Half a step of margin: the same step whatever t was rounded to.
    if (context.moment.t + 0.5 * context.moment.dt >= start)
      signal.deflection[channel] += periods * context.period;
  }
};

}  // namespace vcnc
