#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct AAxisTilt {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "a_axis_tilt",
      .title = "Direction of the A axis",
      .family = Family::geometry,
      .brief = "the A axis is not parallel to the machine's X",
      .equation = R"(e = Rz(C) ((t - Rx(A) t) x r),   t = (0, t_y, t_z),  to first order
e: error of the tool tip in the workpiece frame [m], t: rotation of the axis [rad], r: from the
declared point of the A axis to the tip, in the frame of the body that A turns [m].)",
      .validity =
          R"(Constant: the orientation error of the axis. Exact, a rigid motion about the tilted line
through the declared point of the axis. Frame of the machine at A = C = 0.)",
      .source = "ISO 230-1, ISO 230-7 (orientation errors of an axis of rotation)",
      .signature =
          R"(A ball held still on the piece leaves its place along X by the tilt times its distance
from the axis: sin A and 1 - cos A, growing with the radius. Across A it grows with the
distance along X.)",
      .confusable = "c_axis_tilt squareness piece_tilt a_axis_offset",
      .separate =
          "along the axis and in proportion to the radius, where a_axis_offset is across and "
          "constant",
      .showing = Showing::spin};

  double about_y = 0, about_z = 0;  ///< [rad]

  static AAxisTilt nominal() { return {.about_y = 30e-6, .about_z = -20e-6}; }
  bool null() const { return about_y == 0 && about_z == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit urad{"urad", 1e-6};
    visit("about_y_urad", p.about_y, urad, Range{-5000, 5000}, "tilt of the axis about Y");
    visit("about_z_urad", p.about_z, urad, Range{-5000, 5000}, "tilt of the axis about Z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.a_tilt += Vec3Of<T>(T(0), T(about_y), T(about_z));
  }
};

}  // namespace vcnc
