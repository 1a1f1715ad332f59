#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct FrictionAsymmetry {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "friction_asymmetry",
      .title = "Friction that differs with the direction",
      .family = Family::friction,
      .brief = "more friction one way than the other: skewed wipers, a loaded gib, a worm",
      .equation = R"(dry friction slides at g (d_c s + 1) s,   B = B_0 (1 + d_v s),   s = sgn(v)
g, B_0: dry [N or N m] and viscous friction of the other effects, d_c, d_v: shares;
bristles bend about d_c g, so that a reversal is alike from either direction, and load)",
      .validity =
          R"(|d| <= 1, so that friction never drives. Acts on what the friction effects above it give and
is nothing without them.)",
      .source =
          "own parametrisation; an offset for asymmetric Coulomb friction is part of the EMPS "
          "drive "
          "benchmark, Janot, Gautier, Brunot (2019)",
      .signature =
          R"(Mean of the drive force of both directions is not zero: d_c F_c + d_v B |v|, a part of it even in
v. Quadrant glitches at the two ends of an axis are still alike: both jump by 2 F_c.)",
      .confusable = "weight_imbalance coulomb friction_zone cable_chain",
      .separate =
          "its dry part is a constant mean force like a weight's and only differs from it at rest "
          "(friction can hold, a weight always pulls); the viscous part grows with the speed",
      .showing = Showing::line};
  static constexpr bool dissipative = true;

  double dry = 0;      ///< d_c, share
  double viscous = 0;  ///< d_v, share

  static FrictionAsymmetry nominal(bool /*rotary*/) { return {.dry = 0.2, .viscous = 0.2}; }
  bool null() const { return dry == 0 && viscous == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool /*rotary*/) {
    visit("dry_percent", p.dry, Unit{"percent", 0.01}, Range{-100, 100},
          "dry friction: excess in positive, lack in negative direction");
    visit("viscous_percent", p.viscous, Unit{"percent", 0.01}, Range{-100, 100},
          "viscous friction: excess in positive, lack in negative direction");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const T v = context.velocity == 0.0 ? context.free_velocity : context.velocity;
    const double s = v > 0.0 ? 1 : v < 0.0 ? -1 : 0;
    signal.skew += dry * signal.dry;
    signal.viscous *= 1 + viscous * s;
  }
};

}  // namespace vcnc
