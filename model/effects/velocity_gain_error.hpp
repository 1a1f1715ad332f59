#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct VelocityGainError {
  using Port = ServoPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "velocity_gain_error",
      .title = "Error of the velocity loop gain",
      .family = Family::servo,
      .brief = "the proportional gain Kp of the velocity loop is not as declared",
      .equation = R"(F_ref = Kp (1 + d) ((v_ref - v_m) + (1/Ti) int (v_ref - v_m) dt) + kaff J a_c
d: deviation, Kp = 2 pi f_v J: declared gain [N s/m or N m s/rad])",
      .validity =
          R"(Constant; the observer of the velocity keeps its declared bandwidth. Far too high a gain makes
the loop ring, as on a machine.)",
      .source =
          R"(Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation, speed control; area of the
disturbance response: own derivation)",
      .signature =
          R"(Reversal peaks, ripple and every other response to a force grow as 1/(1 + d): the area under
the error after a step F of force is F Ti/(Kp (1 + d) Kv). Nothing on a ramp.)",
      .confusable = "coulomb integral_time_error acceleration_ff_error",
      .separate =
          "coulomb changes the force, this does not; integral_time_error changes the length of a "
          "peak",
      .showing = Showing::reversals};

  double deviation = 0;  ///< d

  static VelocityGainError nominal(bool) { return {-0.3}; }
  bool null() const { return deviation == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("deviation_percent", p.deviation, Unit{"percent", 0.01}, Range{-90, 100},
          "of the true velocity loop gain from the declared one");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.velocity_gain *= 1 + deviation;
  }
};

}  // namespace vcnc
