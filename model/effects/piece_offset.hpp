#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct PieceOffset {
  using Port = PosePort;
  static constexpr Place place = Place::setup;
  static constexpr EffectText text{
      .name = "piece_offset",
      .title = "Position of the piece",
      .family = Family::setup,
      .brief = "the piece is not where its work offset says",
      .equation = R"(p = p_W - s
p: tool tip as the piece sees it, p_W: as the control believes [m], s: true position of the piece
against the work offset, workpiece frame [m])",
      .validity = "Constant and exact; the piece is fixed to the table and turns with it.",
      .source = "own definition",
      .signature =
          R"(On a circle -s_x cos phi - s_y sin phi: one period per turn, the same at every feed.
While C turns with the ball held still on the piece the error is constant in the piece's
frame.)",
      .confusable = "c_axis_offset a_axis_offset thermal_drift ambient_cycle",
      .separate = "turns with C, which an error of the C axis does not; does not change with time",
      .showing = Showing::circle};

  Vec3 shift = Vec3::Zero();  ///< [m]

  static PieceOffset nominal() { return {Vec3(20e-6, -10e-6, 5e-6)}; }
  bool null() const { return shift.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("shift_um", p.shift, unit::um, Range{-10000, 10000},
          "true against declared position, workpiece frame x, y, z");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.piece_shift += shift.template cast<T>();
  }
};

}  // namespace vcnc
