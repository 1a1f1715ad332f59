#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CurrentLag {
  using Port = ServoPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "current_lag",
      .title = "Lag of the current loop",
      .family = Family::servo,
      .brief = "the motor's force follows its reference later than declared",
      .equation = R"((tau + d) F' + F = F_ref
d: further lag [s], tau: declared lag of the current loop [s])",
      .validity =
          R"(First order; bandwidth and saturation of the voltage are not modelled. A lag near 1/(2 pi f_v)
takes the damping from the velocity loop.)",
      .source =
          R"(Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation: current loops of
0.3 to 1 ms; error transfer: own derivation)",
      .signature = R"(With full feed-forward
  e/x_c = d s J s^2 / ((1 + d s) J s^2 + Kp (1 + 1/(Ti s)) (s + Kv))
so that e ~ the snap x_c'''' in slow motion: only at jerks and high frequencies; more ringing.)",
      .confusable = "command_delay acceleration_ff_error structural_mode",
      .separate = "no error on ramps and next to none on slow circles, where a delay shows v t",
      .showing = Showing::corner};

  double lag = 0;  ///< [s]

  static CurrentLag nominal(bool) { return {500e-6}; }
  bool null() const { return lag == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("lag_us", p.lag, unit::us, Range{0, 5000}, "added to the declared lag of the current");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.current_lag += lag;
  }
};

}  // namespace vcnc
