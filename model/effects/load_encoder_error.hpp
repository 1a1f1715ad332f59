#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct LoadEncoderError {
  using Port = EncoderPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "load_encoder_error",
      .title = "Error of the load's measuring system",
      .family = Family::servo,
      .brief =
          "a wave of the scale or ring encoder on the load alone: mounted off its centre, bent",
      .equation = R"(q_load measured = q + A sin(2 pi q / p + psi)
A: amplitude [m or rad], q: position, p: period [m or rad], psi: phase at q = 0 [rad];
a ring encoder off its centre: p one turn, A = 2 e / D, in arcsec 412 e[um] / D[mm]
(e: eccentricity, D: mean diameter of the graduation))",
      .validity =
          R"(One harmonic, 2 pi A/p << 1; the motor's measuring system is right. The loop first settles the
error at the start.)",
      .source =
          R"(Heidenhain, Angle Encoders, section on measuring accuracy: 412 e/D; own derivation of A = 2 e/D)",
      .signature =
          R"(A wave over the position between the two measuring systems. With the loop closed on the load,
load and motor are off by -A sin(...) as far as the position loop follows: at speed v by
A/sqrt(1 + (w/Kv)^2), w = 2 pi v/p. With the loop closed on the motor nothing moves.)",
      .confusable = "transmission_error encoder_eccentricity pitch_periodic",
      .separate =
          R"(encoder_eccentricity and pitch_periodic are not seen between the two measuring systems;
transmission_error moves the load where the loop is closed on the motor, and does not where it is
closed on the load)",
      .showing = Showing::line};

  double amplitude = 0;     ///< A [m or rad]
  double period = 2 * kPi;  ///< p [m or rad]
  double phase = 0;         ///< psi [rad]

  static LoadEncoderError nominal(bool rotary) {
    return rotary ? LoadEncoderError{.amplitude = 8 * unit::arcsec.to_si}
                  : LoadEncoderError{.amplitude = 2e-6, .period = 20e-3};
  }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "amplitude_arcsec" : "amplitude_um", p.amplitude,
          rotary ? unit::arcsec : unit::um, Range{0, 3600}, "of the error");
    visit(rotary ? "period_deg" : "period_mm", p.period, rotary ? unit::deg : unit::mm,
          Range{0.001, 1e4}, "travel after which it repeats");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "of the error at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    if (!context.of_load) return;
    using std::sin;
    const T angle = (2 * kPi / period) * signal.position + phase;
    signal.position += amplitude * sin(angle);
  }
};

}  // namespace vcnc
