#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Squareness {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "squareness",
      .title = "Squareness of the linear axes",
      .family = Family::geometry,
      .brief = "two linear axes are not at right angles",
      .equation = R"(dx = S_xy y + S_xz z,   dy = S_yz z
y, z: axis positions [m], S: squareness errors [rad]; S_xy > 0: +Y leans towards +X, the angle
between +X and +Y is less than 90 deg by S_xy.)",
      .validity =
          R"(First order: S^2 y/2 along the leaning axis is left out, 0.5 nm at 100 urad and 0.1 m. X
is the reference, then Y. The tool's own direction does not follow Z.)",
      .source = "ISO 230-1 (squareness), ISO 230-4: dR = R/2 S sin 2 phi on a circle in XY",
      .signature =
          R"(A circle in XY becomes an ellipse along 45 deg: R/2 S_xy sin 2 phi, of the same sign in
both senses and at every feed; it grows with the radius.)",
      .confusable = "kv_error velocity_ff_error command_delay piece_tilt cross_talk straightness",
      .separate =
          "does not flip with the sense of the circle, as a mismatch of the servos (kv_error, "
          "command_delay) does; independent of the feed",
      .showing = Showing::circle};

  double xy = 0, xz = 0, yz = 0;  ///< [rad]

  static Squareness nominal() { return {.xy = 50e-6, .xz = -30e-6, .yz = 20e-6}; }
  bool null() const { return xy == 0 && xz == 0 && yz == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit urad{"urad", 1e-6};
    constexpr Range range{-5000, 5000};
    visit("xy_urad", p.xy, urad, range, "X against Y: displacement in X per way in Y");
    visit("xz_urad", p.xz, urad, range, "X against Z: displacement in X per way in Z");
    visit("yz_urad", p.yz, urad, range, "Y against Z: displacement in Y per way in Z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const T y = context.axes[kY].position, z = context.axes[kZ].position;
    signal.tip.x() += xy * y + xz * z;
    signal.tip.y() += yz * z;
  }
};

}  // namespace vcnc
