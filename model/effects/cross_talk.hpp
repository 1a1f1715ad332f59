#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CrossTalk {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "cross_talk",
      .title = "Cross-talk of the probe",
      .family = Family::probe,
      .brief = "deflection in one direction appears in the channel of another",
      .equation =
          R"(x_sensed = x + c_xy y + c_xz z
y_sensed = y + c_yx x + c_yz z
z_sensed = z + c_zx x + c_zy y
x, y, z: deflection in the probe frame [m], c: shares [-])",
      .validity =
          R"(Linear. c_xy = -c_yx is a probe turned about its axis, c_xy = c_yx axes that are not
square.)",
      .source = "probe matrix: ISO 230-10, ISO 10360-5 (scanning probes)",
      .signature =
          R"(A copy of one channel in another. Along the normal (theta its direction in the probe's
plane): (c_xy + c_yx)/2 sin 2 theta of the deflection; turned channels alone show
nothing along the normal.)",
      .confusable = "squareness surface_friction tip_lobing",
      .separate =
          "in proportion to the deflection; squareness grows with the radius, surface_friction "
          "changes its sign with the sense of travel",
      .showing = Showing::circle};

  double x_from_y = 0, x_from_z = 0, y_from_x = 0, y_from_z = 0, z_from_x = 0, z_from_y = 0;

  static CrossTalk nominal() { return {.x_from_y = 0.01, .y_from_x = 0.01, .z_from_x = 0.005}; }
  bool null() const {
    return x_from_y == 0 && x_from_z == 0 && y_from_x == 0 && y_from_z == 0 && z_from_x == 0 &&
           z_from_y == 0;
  }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit percent{"percent", 0.01};
    constexpr Range range{-50, 50};
    visit("x_from_y_percent", p.x_from_y, percent, range, "share of y in the reading of x");
    visit("x_from_z_percent", p.x_from_z, percent, range, "share of z in the reading of x");
    visit("y_from_x_percent", p.y_from_x, percent, range, "share of x in the reading of y");
    visit("y_from_z_percent", p.y_from_z, percent, range, "share of z in the reading of y");
    visit("z_from_x_percent", p.z_from_x, percent, range, "share of x in the reading of z");
    visit("z_from_y_percent", p.z_from_y, percent, range, "share of y in the reading of z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    const Vec3Of<T> d = signal.deflection;
    signal.deflection.x() += x_from_y * d.y() + x_from_z * d.z();
    signal.deflection.y() += y_from_x * d.x() + y_from_z * d.z();
    signal.deflection.z() += z_from_x * d.x() + z_from_y * d.y();
  }
};

}  // namespace vcnc
