#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct WeightImbalance {
  using Port = LoadForcePort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "weight_imbalance",
      .title = "Weight out of balance",
      .family = Family::mechanics,
      .brief = "a counterweight that does not fit, or a rotary axis whose centre of mass is off",
      .equation = R"(linear  F = G,   rotary  F = G sin(q + q_0)
F: added to the force on the load, positive along the axis; G: weight out of balance [N], or
m g times the lever of the centre of mass [N m]; q_0: angle of the lever from the vertical where the
axis counts nought [rad]. G > 0: it stands upright at q = -q_0 and would fall; G < 0: it hangs there)",
      .validity =
          R"(Rigid bodies, the axis of rotation horizontal (as A); G carries no inertia of its own. When the
drive starts its integrator is empty: the axis first gives way until it has taken G up.)",
      .source = "own derivation: moment of the weight of a rigid body",
      .signature =
          R"(Offset of the drive force, the same in both directions and at rest; of a rotary axis one period
per turn. Position is right once the integrator holds it; with wind-up a static shift c G.)",
      .confusable = "friction_asymmetry cable_chain torque_constant_error",
      .separate =
          "the force stays when the axis stands, and is the same at every speed; a cable chain's "
          "grows with the travel and does not repeat per turn",
      .showing = Showing::line};

  double force = 0;  ///< G [N or N m]
  double angle = 0;  ///< q_0 [rad], rotary axes only

  static WeightImbalance nominal(bool rotary) {
    return {.force = rotary ? 10.0 : 300.0, .angle = 0};
  }
  bool null() const { return force == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "torque_Nm" : "force_N", p.force, rotary ? unit::newton_m : unit::newton,
          Range{-1e5, 1e5},
          rotary ? "largest moment of the weight, negative where it hangs at position 0"
                 : "weight out of balance");
    if (rotary)
      visit("angle_deg", p.angle, unit::deg, Range{-360, 360},
            "added to the position: the moment vanishes where the sum is 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, const Seat& seat) const {
    using std::sin;
    if (seat.rotary)
      signal.force += force * sin(context.position + angle);
    else
      signal.force += force;
  }
};

}  // namespace vcnc
