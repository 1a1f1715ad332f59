#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CAxisTilt {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "c_axis_tilt",
      .title = "Direction of the C axis",
      .family = Family::geometry,
      .brief = "the C axis is not parallel to the machine's Z",
      .equation = R"(e = (t - Rz(C) t) x r,   t = (t_x, t_y, 0),  to first order
e: error of the tool tip in the workpiece frame [m], t: rotation of the axis [rad], r: from the
declared point of the C axis to the tip, workpiece frame [m].)",
      .validity =
          R"(Constant: the orientation error of the axis. Exact, a rigid motion about the tilted line
through the declared point of the axis. Frame of the machine at A = C = 0.)",
      .source = "ISO 230-1, ISO 230-7 (orientation errors of an axis of rotation)",
      .signature =
          R"(A ball held still on the piece goes up and down once per turn of C in proportion to its
radius, and around a circle in proportion to its height above the declared point of the
axis.)",
      .confusable = "piece_tilt c_axis_offset squareness rotary_runout",
      .separate =
          "once per turn in Z in proportion to the radius; a tilt of the piece stays the same "
          "while C turns",
      .showing = Showing::spin};

  double about_x = 0, about_y = 0;  ///< [rad]

  static CAxisTilt nominal() { return {.about_x = 30e-6, .about_y = -20e-6}; }
  bool null() const { return about_x == 0 && about_y == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit urad{"urad", 1e-6};
    visit("about_x_urad", p.about_x, urad, Range{-5000, 5000}, "tilt of the axis about X");
    visit("about_y_urad", p.about_y, urad, Range{-5000, 5000}, "tilt of the axis about Y");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.c_tilt += Vec3Of<T>(T(about_x), T(about_y), T(0));
  }
};

}  // namespace vcnc
