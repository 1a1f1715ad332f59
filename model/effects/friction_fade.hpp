#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct FrictionFade {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "friction_fade",
      .title = "Friction fading with running-in",
      .family = Family::friction,
      .brief = "dry friction falls as grease, seals and guides warm up and distribute",
      .equation = R"(g = g_0 (1 - c (1 - exp(-t / tau)))
g_0: dry friction of the other effects [N or N m], c: share lost in the end, tau [s],
t: time since the start [s])",
      .validity =
          R"(c <= 1, so that friction never drives. A function of time, not of the way travelled or the
heat it makes; viscous friction and bristles are not touched.)",
      .source = "own parametrisation: first-order approach to the warm state",
      .signature =
          R"(Quadrant glitches and the level of the drive force shrink from lap to lap, all by the same
factor; nothing remembers where it happened.)",
      .confusable = "coulomb thermal_drift thermal_warm_up torque_constant_error",
      .separate =
          "the same block at the start and at the end of the run: forces differ, positions at rest "
          "do not",
      .showing = Showing::reversals};
  static constexpr bool dissipative = true;

  double share = 0;            ///< c
  double time_constant = 600;  ///< tau [s]

  static FrictionFade nominal(bool /*rotary*/) { return {.share = 0.3, .time_constant = 10}; }
  bool null() const { return share == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool /*rotary*/) {
    visit("share_percent", p.share, Unit{"percent", 0.01}, Range{0, 100},
          "of dry friction, lost in the end");
    visit("time_constant_s", p.time_constant, unit::s, Range{0.1, 1e6}, "of its loss");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double left = 1 + share * std::expm1(-context.moment.t / time_constant);
    signal.dry *= left;
    signal.skew *= left;
  }
};

}  // namespace vcnc
