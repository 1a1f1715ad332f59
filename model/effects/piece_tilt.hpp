#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct PieceTilt {
  using Port = PosePort;
  static constexpr Place place = Place::setup;
  static constexpr EffectText text{
      .name = "piece_tilt",
      .title = "Tilt of the piece",
      .family = Family::setup,
      .brief = "the piece lies askew on the table",
      .equation = R"(p = R(t)^T (p_W - s)
p: tool tip as the piece sees it, p_W: as the control believes [m], R(t): rotation of the
piece about the origin of the workpiece frame by the vector t [rad], s: see piece_offset)",
      .validity = "Constant and exact; the piece is fixed to the table and turns with it.",
      .source = "own definition",
      .signature =
          R"(A plane appears with a slope t; an upright wall leans, the error grows with the height;
t_z turns the piece about its origin. The same at every feed.)",
      .confusable = "c_axis_tilt squareness a_axis_tilt",
      .separate = "turns with C: the piece probed after a half turn shows the slope reversed",
      .showing = Showing::s_piece};

  Vec3 tilt = Vec3::Zero();  ///< [rad]

  static PieceTilt nominal() { return {Vec3(100e-6, -50e-6, 50e-6)}; }
  bool null() const { return tilt.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("tilt_urad", p.tilt, Unit{"urad", 1e-6}, Range{-50000, 50000},
          "rotation about x, y, z of the workpiece frame");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.piece_tilt += tilt.template cast<T>();
  }
};

}  // namespace vcnc
