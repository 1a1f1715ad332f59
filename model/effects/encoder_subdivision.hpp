#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct EncoderSubdivision {
  using Port = EncoderPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "encoder_subdivision",
      .title = "Subdivision error of the measuring system",
      .family = Family::servo,
      .brief = "a periodic error of the measuring system within each of its grating lines",
      .equation = R"(x_measured = x + A sin(2 pi x / lambda + psi)
A: amplitude [m or rad], lambda: signal period [m or rad], psi: phase)",
      .validity =
          R"(One harmonic, 2 pi A/lambda < 1; both measuring systems of the axis have the same. The axis
starts on its true position, so the loop first settles the error at the start.)",
      .source =
          R"(Heydemann, Applied Optics 20 (1981) 3382 for its origin in sine and cosine signals; makers of
encoders state about 1 % of the signal period)",
      .signature =
          R"(In slow motion the loop follows the measured position and the table is off by -A sin(...): one wave
per grating line in the probe, nothing in the following error. At v/lambda above the loop's
bandwidth the table no longer follows; the ripple moves into following error and force.)",
      .confusable = "pitch_periodic cogging signal_offset signal_harmonics",
      .separate =
          R"(wavelength of the grating, not of the screw or the magnets; fades in the probe at higher feeds,
where pitch_periodic stays; the probe's own error has the period of the deflection)",
      .showing = Showing::line};

  double amplitude = 0;  ///< A [m or rad]
  double period = 1;     ///< lambda [m or rad]
  double phase = 0;      ///< psi [rad]

  static EncoderSubdivision nominal(bool rotary) {
    if (rotary) return {0.5 * unit::arcsec.to_si, 72 * unit::arcsec.to_si, 0};
    return {200 * unit::nm.to_si, 20 * unit::um.to_si, 0};
  }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "amplitude_arcsec" : "amplitude_nm", p.amplitude,
          rotary ? unit::arcsec : unit::nm, Range{0, 1e5}, "of the error");
    visit(rotary ? "period_arcsec" : "period_um", p.period, rotary ? unit::arcsec : unit::um,
          Range{0.1, 1e6}, "signal period of the measuring system");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "of the error at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    using std::sin;
    const T angle = (2 * kPi / period) * signal.position + phase;
    signal.position += amplitude * sin(angle);
  }
};

}  // namespace vcnc
