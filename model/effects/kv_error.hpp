#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct KvError {
  using Port = ServoPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "kv_error",
      .title = "Error of the position loop gain",
      .family = Family::servo,
      .brief = "the position loop gain Kv is not as declared",
      .equation = R"(v_ref = Kv (1 + d) (x_c - x_m) + kvff v_c
d: deviation, Kv: declared gain [1/s], kvff: velocity feed-forward)",
      .validity =
          R"(Constant gain. Shows as far as the axis has a following error: an ideal drive with full
feed-forward has none, so that it then shows through disturbances only.)",
      .source =
          R"(Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation, position control; ISO 230-4
circular tests)",
      .signature =
          R"(Following error v (1 - kvff)/(Kv (1 + d)) on a ramp. Against another axis on a circle: an ellipse
at 45 deg of v (1 - kvff) |1/Kx - 1/Ky| from peak to peak, which turns by 90 deg with the
direction and grows with the feed.)",
      .confusable = "velocity_ff_error command_delay bus_latency squareness",
      .separate =
          R"(squareness does not turn with the direction; velocity_ff_error and a delay keep the recovery
from a disturbance and differ at high frequencies: phase curved for Kv, straight for a delay)",
      .showing = Showing::circle_feeds};

  double deviation = 0;  ///< d

  static KvError nominal(bool) { return {-0.1}; }
  bool null() const { return deviation == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("deviation_percent", p.deviation, Unit{"percent", 0.01}, Range{-95, 200},
          "of the true position loop gain from the declared one");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.kv *= 1 + deviation;
  }
};

}  // namespace vcnc
