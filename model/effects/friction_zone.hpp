#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct FrictionZone {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "friction_zone",
      .title = "Zone of other friction",
      .family = Family::friction,
      .brief = "a stretch of the travel where dry friction is higher or lower",
      .equation = R"(g = g_0 (1 + h b(q)),   b = S(q - q_c + w/2) S(q_c + w/2 - q)
S(x) = 0 below -e/2, 1 above e/2, 3 u^2 - 2 u^3 between, u = x/e + 1/2
g_0: dry friction of the other effects [N or N m], h: share, q_c, w: centre and width of the
zone, e: length of its flanks [m or rad])",
      .validity =
          R"(h >= -1, so that friction never drives; a full plateau needs e <= w. For a step beyond a
position let the zone end outside the travel. Viscous friction and bristles are not touched.)",
      .source =
          "own parametrisation; dependence of friction on position: Armstrong-Helouvry, Dupont, "
          "Canudas de Wit, Automatica 30 (1994) 1083",
      .signature =
          R"(Drive force sgn(v) F_c h b(q): rises and falls at the same positions at every feed and changes
sign with the direction. In the position a transient at each flank, F_c h / (J w_v Kv) at most,
and quadrant glitches whose height depends on where the axis reverses.)",
      .confusable = "cable_chain cogging torque_ripple friction_asymmetry",
      .separate =
          "half the difference of the forces of both directions over position; springs and cogging "
          "do not change sign with the direction",
      .showing = Showing::line};
  static constexpr bool dissipative = true;

  double height = 0;    ///< h, share
  double centre = 0;    ///< [m or rad]
  double width = 0.05;  ///< between the middles of the flanks [m or rad]
  double edge = 0.01;   ///< length of a flank [m or rad]

  static FrictionZone nominal(bool rotary) {
    return {.height = 0.4,
            .centre = 0,
            .width = rotary ? 30 * kDegree : 0.020,
            .edge = rotary ? 5 * kDegree : 0.005};
  }
  bool null() const { return height == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    const Unit u = rotary ? unit::deg : unit::mm;
    visit("height_percent", p.height, Unit{"percent", 0.01}, Range{-100, 1000},
          "excess of dry friction within the zone");
    visit(rotary ? "centre_deg" : "centre_mm", p.centre, u, Range{-1e4, 1e4},
          "position of the zone");
    visit(rotary ? "width_deg" : "width_mm", p.width, u, Range{0.01, 1e5},
          "width of the zone at half its height");
    visit(rotary ? "edge_deg" : "edge_mm", p.edge, u, Range{0.001, 1e4}, "length of its flanks");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const T x = context.position - centre;
    const T from = x + 0.5 * width, to = 0.5 * width - x;
    const T here = 1 + height * rise(from) * rise(to);
    signal.dry *= here;
    signal.skew *= here;
  }

 private:
  /// S(x).
  template <class T>
  T rise(const T& x) const {
    const T u = x / edge + 0.5;
    if (u <= 0.0) return T(0.0);
    if (u >= 1.0) return T(1.0);
    return u * u * (3.0 - 2.0 * u);
  }
};

}  // namespace vcnc
