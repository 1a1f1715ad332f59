#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct RotaryRunout {
  using Port = PosePort;
  static constexpr Place place = Place::rotary_axis;
  static constexpr EffectText text{
      .name = "rotary_runout",
      .title = "Run-out of a rotary axis",
      .family = Family::geometry,
      .brief = "the rotating body wanders radially and axially, k times per turn",
      .equation = R"(r = a_1 cos(k q + psi) e_1 + a_2 sin(k q + psi) e_2 + a_3 cos(k q + psi) e_3
q: angle of the axis [rad], k: periods per turn, a: amplitudes [m], psi: phase [rad].
A: e_1 = Y, e_2 = Z, e_3 = X;   C: e_1 = X, e_2 = Y, e_3 = Z, fixed to what carries the axis.
ISO 230-7: radial EYA, EZA (EXC, EYC), axial EXA (EZC).)",
      .validity =
          R"(One harmonic, translations only; the wobble of the axis (tilt error motion) is left out.
On a table k = 1 with a_2 = -a_1 is a piece off centre.)",
      .source = "ISO 230-7 (error motions of axes of rotation)",
      .signature =
          R"(A ball held still on the piece shows k periods per turn in the directions of the
machine; seen from a piece on the table the radial part has k-1 and k+1. Independent of
radius and speed.)",
      .confusable = "c_axis_offset a_axis_offset c_axis_tilt encoder_eccentricity piece_offset",
      .separate =
          "harmonics from 2 on; encoder_eccentricity is tangential and grows with the radius",
      .showing = Showing::spin};

  double first = 0, second = 0, axial = 0;  ///< [m]
  int harmonic = 2;                         ///< periods per turn
  double phase = 0;                         ///< [rad]

  static RotaryRunout nominal() { return {.first = 3e-6, .second = 3e-6, .axial = 2e-6}; }
  bool null() const { return first == 0 && second == 0 && axial == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("first_um", p.first, unit::um, Range{-1000, 1000},
          "radial amplitude (cos); A: in Y, C: in X");
    visit("second_um", p.second, unit::um, Range{-1000, 1000},
          "radial amplitude (sin); A: in Z, C: in Y");
    visit("axial_um", p.axial, unit::um, Range{-1000, 1000}, "amplitude along the axis (cos)");
    visit("harmonic", p.harmonic, Range{1, 8}, "periods per turn");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "at the axis' zero");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, const Seat& seat) const {
    using std::cos;
    using std::sin;
    const T angle = context.axes[seat.axis].position * static_cast<double>(harmonic) + phase;
    const T c = cos(angle), s = sin(angle);
    if (seat.axis == kA)
      signal.a_run += Vec3Of<T>(axial * c, first * c, second * s);
    else
      signal.c_run += Vec3Of<T>(first * c, second * s, axial * c);
  }
};

}  // namespace vcnc
