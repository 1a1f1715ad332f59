#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct PitchPeriodic {
  using Port = DisplacementPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "pitch_periodic",
      .title = "Periodic pitch error",
      .family = Family::geometry,
      .brief =
          "an error that repeats with the lead of the screw, the worm or the scale's line pitch",
      .equation = R"(displacement = A sin(2 pi q / p + psi)
A: amplitude [m or rad], q: position, p: period [m or rad], psi: phase at q = 0 [rad])",
      .validity =
          R"(One harmonic. It stands outside the position loop: the loop does not follow it and the force
does not show it, at any feed.)",
      .source =
          "ISO 230-1:2012 and ISO 230-2:2014, periodic positioning error; Slocum, Precision "
          "Machine "
          "Design, Prentice Hall 1992",
      .signature =
          R"(A sine over the position with wavelength p. On a circle A sin(2 pi R cos(phi)/p + psi) cos(phi):
ripple, dense where the axis is fast, that freezes at its reversals; frequency v/p.)",
      .confusable = "encoder_subdivision cogging torque_ripple signal_offset signal_harmonics",
      .separate =
          "constant amplitude over feed and constant wavelength in position; forces of cogging "
          "show "
          "in the drive force; signal errors repeat with the deflection of the probe",
      .showing = Showing::line};

  double amplitude = 0;   ///< A [m or rad]
  double period = 10e-3;  ///< p [m or rad]
  double phase = 0;       ///< psi [rad]

  static PitchPeriodic nominal(bool rotary) {
    return rotary ? PitchPeriodic{.amplitude = 5 * unit::arcsec.to_si, .period = 5 * kDegree}
                  : PitchPeriodic{.amplitude = 2e-6, .period = 10e-3};
  }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "amplitude_arcsec" : "amplitude_um", p.amplitude,
          rotary ? unit::arcsec : unit::um, Range{0, 1000}, "amplitude of the error");
    visit(rotary ? "period_deg" : "period_mm", p.period, rotary ? unit::deg : unit::mm,
          Range{0.001, 1e4}, "travel after which it repeats");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "phase at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    using std::sin;
    const T angle = context.load.position * (2 * kPi / period) + phase;
    signal.displacement += amplitude * sin(angle);
  }
};

}  // namespace vcnc
