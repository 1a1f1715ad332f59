#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct PivotLength {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "pivot_length",
      .title = "Length of pivot and tool",
      .family = Family::geometry,
      .brief = "the tool is longer than its length offset, the tip swings about another pivot",
      .equation = R"(e = -dL d(A, C),   d = (sin A sin C, -sin A cos C, cos A)
e: error of the tool tip in the workpiece frame [m], dL: true against declared length [m], d: tool
axis. Against the set-up at A = 0:  e - e_0 = dL (-sin A sin C, sin A cos C, 1 - cos A).)",
      .validity = "Constant; trunnion and head alike. Exact.",
      .source = "ISO 230-1 (location of the axes), kinematics of model/geometry/kinematics.hpp",
      .signature =
          R"(Constant in Z while A = 0; with A the tip leaves its place by dL (sin A, 1 - cos A).
Independent of the position on the table.)",
      .confusable = "a_axis_offset probe_gain tip_radius",
      .separate =
          "but for the constant dL in Z it is a_axis_offset in z: only the absolute height at A = "
          "0 or "
          "a second tool, whose length is known, tells them apart",
      .showing = Showing::spin};

  double longer = 0;  ///< [m]

  static PivotLength nominal() { return {20e-6}; }
  bool null() const { return longer == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("longer_um", p.longer, unit::um, Range{-10000, 10000},
          "true length from pivot or gauge line to the tip against the declared one");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.tool_longer += longer;
  }
};

}  // namespace vcnc
