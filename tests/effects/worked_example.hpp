#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct BallPassage {
  using Port = FrictionPort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "ball_passage",
      .title = "Ball passage in the guide carriages",
      .family = Family::friction,
      .brief = "dry friction swings as balls enter and leave the loaded zone of a carriage",
      .equation = R"(g = g_0 (1 + h cos(2 pi q / p + psi))
g_0: dry friction of the other effects [N], h: share [-], p: twice the ball diameter [m],
psi: phase at q = 0 [rad])",
      .validity = "First harmonic, all carriages of the axis in phase. Needs dry friction to act.",
      .source =
          "own derivation: balls roll at half the speed of the table, so one enters every 2 ball "
          "diameters of travel",
      .signature =
          R"(The drive force swings by h g_0 over the position with the period p, at every speed; in the
position only at feeds where p is crossed faster than the velocity loop follows.)",
      .confusable = "cogging friction_zone coulomb",
      .separate = "its force changes sign with the direction of motion, that of cogging does not",
      .showing = Showing::line};
  static constexpr bool dissipative = true;

  double share = 0;      ///< h
  double period = 8e-3;  ///< p [m]
  double phase = 0;      ///< psi [rad]

  static BallPassage nominal() { return {.share = 0.2, .period = 8e-3, .phase = 0.5}; }
  bool null() const { return share == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("share_percent", p.share, Unit{"percent", 0.01}, Range{0, 90}, "of the dry friction");
    visit("period_mm", p.period, unit::mm, Range{0.5, 100}, "twice the ball diameter");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    using std::cos;
    signal.dry *= T(1) + share * cos(2 * kPi / period * context.position + phase);
  }
};

}  // namespace vcnc
