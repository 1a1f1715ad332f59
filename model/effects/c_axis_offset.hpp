#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CAxisOffset {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "c_axis_offset",
      .title = "Position of the C axis",
      .family = Family::geometry,
      .brief = "the C axis is not where the control believes it to be",
      .equation = R"(e = s - Rz(C) s,   s = (x, y, 0)
e: error of the tool tip in the workpiece frame [m], x, y: true against declared axis [m].
e_x = (1 - cos C) x + sin C y,  e_y = (1 - cos C) y - sin C x)",
      .validity =
          R"(Constant: the location error of the axis. Exact, a rigid motion. Frame of the machine at
A = C = 0. The set-up at A = C = 0 takes in what there is at that position.)",
      .source = "ISO 230-1, ISO 230-7 (location errors of an axis of rotation)",
      .signature =
          R"(A ball held still on the piece traces a circle of the radius |s| through its start when
C turns, whatever its distance from the axis.)",
      .confusable = "piece_offset a_axis_offset rotary_runout encoder_eccentricity",
      .separate =
          "independent of the radius; an offset of the piece turns with C and gives a constant "
          "instead",
      .showing = Showing::spin};

  double x = 0, y = 0;  ///< [m]

  static CAxisOffset nominal() { return {.x = 10e-6, .y = -5e-6}; }
  bool null() const { return x == 0 && y == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("x_um", p.x, unit::um, Range{-10000, 10000}, "position of the axis in X, error");
    visit("y_um", p.y, unit::um, Range{-10000, 10000}, "position of the axis in Y, error");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.c_shift += Vec3Of<T>(T(x), T(y), T(0));
  }
};

}  // namespace vcnc
