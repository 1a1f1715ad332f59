#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct VelocityFfError {
  using Port = ServoPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "velocity_ff_error",
      .title = "Error of the velocity feed-forward",
      .family = Family::servo,
      .brief = "the velocity feed-forward is not as declared",
      .equation = R"(v_ref = Kv (x_c - x_m) + (kvff + d) v_c
d: deviation as a share of full feed-forward, Kv: position loop gain [1/s])",
      .validity = "Constant, the same in both directions. Added, so that it acts where kvff is 0.",
      .source =
          "Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation, feed-forward control",
      .signature =
          R"(Following error -d v/Kv on a ramp. All axes alike: the radius of a circle changes by
-(v^2/2R) (1 - kvff^2)/Kv^2. One axis alone: an ellipse at 45 deg that turns with the direction.)",
      .confusable = "kv_error command_delay bus_latency path_filter",
      .separate =
          R"(exists with full declared feed-forward, where kv_error shows nothing on a ramp; its lag is the
closed loop's first-order one and fades after a jerk with 1/Kv, that of a delay is dead time)",
      .showing = Showing::circle_feeds};

  double deviation = 0;  ///< d

  static VelocityFfError nominal(bool) { return {-0.01}; }
  bool null() const { return deviation == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("deviation_percent", p.deviation, Unit{"percent", 0.01}, Range{-200, 200},
          "added to the velocity feed-forward, of full feed-forward");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.velocity_ff += deviation;
  }
};

}  // namespace vcnc
