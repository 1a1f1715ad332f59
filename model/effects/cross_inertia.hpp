#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CrossInertia {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "cross_inertia",
      .title = "Lateral inertia",
      .family = Family::mechanics,
      .brief = "acceleration of one axis bends the machine across it",
      .equation =
          R"(dx = k_xy y'' + k_xz z'',   dy = k_yx x'' + k_yz z'',   dz = k_zx x'' + k_zy y''
x'', y'', z'': true accelerations of the axes [m/s^2], k: displacement of the tip per acceleration
[m/(m/s^2)], m/K of the bending body; 1 um/(m/s^2) is a natural frequency of 159 Hz.)",
      .validity =
          R"(Quasi-static: well below the natural frequency sqrt(1/|k|). The scales of the axis that
moves sideways see nothing of it.)",
      .source =
          "own derivation: inertia force m a on a lateral stiffness K; cross-talk of axes in "
          "Altintas et al., CIRP Annals 60/2 (2011) 779",
      .signature =
          R"(On a circle of angular speed w: -w^2 R k_xy sin phi in X, an ellipse along 45 deg that
grows with the square of the feed over the radius, of the same sign in both senses.)",
      .confusable = "squareness acceleration_ff_error structural_mode frame_vibration",
      .separate = "grows with the square of the feed; squareness does not know the feed",
      .showing = Showing::circle_feeds};

  double x_per_y = 0, x_per_z = 0, y_per_x = 0, y_per_z = 0, z_per_x = 0, z_per_y = 0;  ///< [s^2]

  static CrossInertia nominal() { return {.x_per_y = 2e-6, .z_per_x = 1e-6}; }
  bool null() const {
    return x_per_y == 0 && x_per_z == 0 && y_per_x == 0 && y_per_z == 0 && z_per_x == 0 &&
           z_per_y == 0;
  }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit um_per_m_s2{"um_per_m_s2", 1e-6};
    constexpr Range range{-1000, 1000};
    visit("x_per_y_um_per_m_s2", p.x_per_y, um_per_m_s2, range, "in X by acceleration of Y");
    visit("x_per_z_um_per_m_s2", p.x_per_z, um_per_m_s2, range, "in X by acceleration of Z");
    visit("y_per_x_um_per_m_s2", p.y_per_x, um_per_m_s2, range, "in Y by acceleration of X");
    visit("y_per_z_um_per_m_s2", p.y_per_z, um_per_m_s2, range, "in Y by acceleration of Z");
    visit("z_per_x_um_per_m_s2", p.z_per_x, um_per_m_s2, range, "in Z by acceleration of X");
    visit("z_per_y_um_per_m_s2", p.z_per_y, um_per_m_s2, range, "in Z by acceleration of Y");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const T x = context.axes[kX].acceleration, y = context.axes[kY].acceleration,
            z = context.axes[kZ].acceleration;
    signal.tip.x() += x_per_y * y + x_per_z * z;
    signal.tip.y() += y_per_x * x + y_per_z * z;
    signal.tip.z() += z_per_x * x + z_per_y * y;
  }
};

}  // namespace vcnc
