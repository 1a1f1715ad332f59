#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct AccelerationFfError {
  using Port = ServoPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "acceleration_ff_error",
      .title = "Error of the acceleration feed-forward",
      .family = Family::servo,
      .brief = "the acceleration (inertia) feed-forward is not as declared",
      .equation = R"(F_ref = Kp (v_ref - v_m) + (Kp/Ti) int (v_ref - v_m) dt + (kaff + d) J a_c
d: deviation as a share of full feed-forward, J: moved inertia [kg or kg m^2])",
      .validity =
          "Constant. Acts as a wrong inertia in the feed-forward; the true inertia is unchanged.",
      .source =
          R"(Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation, feed-forward control;
error transfer: own derivation)",
      .signature = R"(With full velocity feed-forward and kaff = 1:
  e/x_c = -d J s^2 / (J s^2 + Kp (1 + 1/(Ti s)) (s + Kv))
which for slow motion is in proportion to the jerk: e = -d J (Ti/(Kp Kv)) x_c'''. Peaks where the
acceleration changes.)",
      .confusable = "torque_constant_error velocity_gain_error current_lag cross_inertia",
      .separate =
          R"(torque_constant_error also shows in the force at constant acceleration; cross_inertia does not
show in the following error)",
      .showing = Showing::circle_feeds};

  double deviation = 0;  ///< d

  static AccelerationFfError nominal(bool) { return {-0.5}; }
  bool null() const { return deviation == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("deviation_percent", p.deviation, Unit{"percent", 0.01}, Range{-200, 200},
          "added to the acceleration feed-forward, of full feed-forward");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.acceleration_ff += deviation;
  }
};

}  // namespace vcnc
