#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Straightness {
  using Port = PosePort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "straightness",
      .title = "Straightness of a linear axis",
      .family = Family::geometry,
      .brief = "the guide is bent: the axis moves sideways as it travels",
      .equation = R"(e_1 = b_1 (q/100 mm)^2 + w_1 sin(2 pi q/l + psi),  e_2 likewise with b_2, w_2
q: position [m], b: deviation at +-100 mm [m], w: amplitude of the wave [m], l: its length [m],
psi: its phase [rad]. Directions 1, 2: X: Y, Z;  Y: X, Z;  Z: X, Y  (ISO 230-1: EYX, EZX; ...).)",
      .validity =
          R"(Bow and one wave, both about the machine's zero; a slope of the guide is squareness. The
tilts that go with a bent guide are angular_errors. Whole column displaced, no load.)",
      .source =
          "ISO 230-1 (straightness error motions); the bow as the first term of its polynomial: "
          "usual in volumetric models, e.g. Schwenke et al., CIRP Annals 57/2 (2008) 660",
      .signature =
          R"(On a circle of radius R a bow b_1 of X across Y gives b_1/4 (R/100 mm)^2 (sin phi + sin
3 phi): the third harmonic grows with R^2, the same at every feed and in both senses. A
line is bowed.)",
      .confusable = "angular_errors squareness tip_lobing",
      .separate =
          "independent of the arm from the guide to the tool; turns with the machine, not with the "
          "piece or the probe",
      .showing = Showing::circle};

  double first_bow = 0, second_bow = 0;    ///< at +-100 mm [m]
  double first_wave = 0, second_wave = 0;  ///< amplitudes [m]
  double wavelength = 0.1;                 ///< [m]
  double phase = 0;                        ///< [rad]

  static Straightness nominal() {
    return {.first_bow = 5e-6, .second_bow = -3e-6, .first_wave = 1e-6, .second_wave = 1e-6};
  }
  bool null() const {
    return first_bow == 0 && second_bow == 0 && first_wave == 0 && second_wave == 0;
  }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("first_bow_um", p.first_bow, unit::um, Range{-1000, 1000},
          "deviation at +-100 mm across the axis; X: in Y, Y: in X, Z: in X");
    visit("second_bow_um", p.second_bow, unit::um, Range{-1000, 1000},
          "deviation at +-100 mm across the axis; X: in Z, Y: in Z, Z: in Y");
    visit("first_wave_um", p.first_wave, unit::um, Range{-1000, 1000},
          "amplitude of the wave in the first direction");
    visit("second_wave_um", p.second_wave, unit::um, Range{-1000, 1000},
          "amplitude of the wave in the second direction");
    visit("wavelength_mm", p.wavelength, unit::mm, Range{1, 1e5}, "of the wave");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "of the wave at the machine's zero");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, const Seat& seat) const {
    using std::sin;
    constexpr double kReach = 0.1;  // [m] where the bow is given
    const T q = context.axes[seat.axis].position;
    const T bow = q * q * (1 / (kReach * kReach));
    const T wave = sin(q * (2 * kPi / wavelength) + phase);
    const Sideways across = sideways(seat.axis);
    signal.tip[across.first] += first_bow * bow + first_wave * wave;
    signal.tip[across.second] += second_bow * bow + second_wave * wave;
  }
};

}  // namespace vcnc
