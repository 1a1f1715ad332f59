#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CableChain {
  using Port = LoadForcePort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "cable_chain",
      .title = "Cable chain, bellows, hoses",
      .family = Family::mechanics,
      .brief = "an elastic force towards a rest position, stiffening with the travel",
      .equation = R"(F = -(k_1 x + k_3 x^3),   x = q - q_0
F: added to the force on the load [N or N m], q_0: rest position [m or rad],
k_1 [N/m or N m/rad], k_3 [N/m^3 or N m/rad^3])",
      .validity =
          "Elastic only; the friction of the chain's links belongs to coulomb or presliding. No "
          "mass.",
      .source = "own parametrisation: Duffing spring, the lowest odd powers",
      .signature =
          R"(Drive force over position, the same curve in both directions and at every feed. In the position
only a lag of Ti k_1 v / (Kp Kv) while moving, fading within Ti at rest.)",
      .confusable = "weight_imbalance friction_zone cogging friction_asymmetry",
      .separate =
          "mean of the forces of both directions over the full stroke: slope and cubic bend, no "
          "period",
      .showing = Showing::line};

  double stiffness = 0;  ///< k_1 [N/m or N m/rad]
  double cubic = 0;      ///< k_3 [N/m^3 or N m/rad^3]
  double rest = 0;       ///< q_0 [m or rad]

  static CableChain nominal(bool rotary) {
    return rotary ? CableChain{.stiffness = 5, .cubic = 1}
                  : CableChain{.stiffness = 500, .cubic = 5e3};
  }
  bool null() const { return stiffness == 0 && cubic == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "stiffness_Nm_per_rad" : "stiffness_N_per_mm", p.stiffness,
          rotary ? unit::nm_per_rad : unit::n_per_mm, Range{-1000, 1000}, "linear part");
    visit(rotary ? "cubic_Nm_per_rad3" : "cubic_N_per_mm3", p.cubic,
          rotary ? Unit{"Nm_per_rad3", 1} : Unit{"N_per_mm3", 1e9},
          rotary ? Range{-1000, 1000} : Range{-0.01, 0.01}, "cubic part");
    visit(rotary ? "rest_deg" : "rest_mm", p.rest, rotary ? unit::deg : unit::mm, Range{-1e4, 1e4},
          "position without force");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const T x = context.position - rest;
    signal.force -= x * (stiffness + cubic * x * x);
  }
};

}  // namespace vcnc
