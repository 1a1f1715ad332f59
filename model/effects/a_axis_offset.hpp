#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct AAxisOffset {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "a_axis_offset",
      .title = "Position of the A axis",
      .family = Family::geometry,
      .brief = "the A axis is not where the control believes it to be",
      .equation = R"(e = Rz(C) (s - Rx(A) s),   s = (0, y, z)
e: error of the tool tip in the workpiece frame [m], y, z: true against declared axis [m].
At C = 0: e_y = (1 - cos A) y + sin A z,  e_z = (1 - cos A) z - sin A y)",
      .validity =
          R"(Constant: the location error of the axis. Exact, a rigid motion. Frame of the machine at
A = C = 0. The set-up at A = C = 0 takes in what there is at that position.)",
      .source = "ISO 230-1, ISO 230-7 (location errors of an axis of rotation)",
      .signature =
          R"(A ball held still on the piece shows (1 - cos A) and sin A in the plane across A;
nothing in X at C = 0. Independent of the radius of the ball from the axis.)",
      .confusable = "pivot_length c_axis_offset piece_offset rotary_runout",
      .separate =
          "z is pivot_length but for a constant height, and the same for every tool; y "
          "gives Y 1 - cos A where pivot_length gives it sin A",
      .showing = Showing::spin};

  double y = 0, z = 0;  ///< [m]

  static AAxisOffset nominal() { return {.y = 10e-6, .z = -5e-6}; }
  bool null() const { return y == 0 && z == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("y_um", p.y, unit::um, Range{-10000, 10000}, "position of the axis in Y, error");
    visit("z_um", p.z, unit::um, Range{-10000, 10000}, "position of the axis in Z, error");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.a_shift += Vec3Of<T>(T(0), T(y), T(z));
  }
};

}  // namespace vcnc
