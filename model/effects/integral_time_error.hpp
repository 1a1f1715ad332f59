#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct IntegralTimeError {
  using Port = ServoPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "integral_time_error",
      .title = "Error of the velocity loop's integral time",
      .family = Family::servo,
      .brief = "the integral time Ti of the velocity loop is not as declared",
      .equation = R"(F_ref = Kp (v_ref - v_m) + Kp/(Ti (1 + d)) int (v_ref - v_m) dt + kaff J a_c
d: deviation, Ti: declared integral time [s])",
      .validity = "Constant. Far below the declared Ti the velocity loop loses its damping.",
      .source =
          R"(Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation, speed control; area of the
disturbance response: own derivation)",
      .signature =
          R"(A disturbance fades over about Ti (1 + d): longer or shorter tails after every reversal with
friction. The area under the error after a step F of force is F Ti (1 + d)/(Kp Kv).)",
      .confusable = "coulomb velocity_gain_error friction_fade",
      .separate =
          "the height of the reversal peak stays, its length changes; the friction in the force "
          "stays",
      .showing = Showing::reversals};

  double deviation = 0;  ///< d

  static IntegralTimeError nominal(bool) { return {1.0}; }
  bool null() const { return deviation == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("deviation_percent", p.deviation, Unit{"percent", 0.01}, Range{-80, 10000},
          "of the true integral time from the declared one");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.integral_time *= 1 + deviation;
  }
};

}  // namespace vcnc
