#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct TransmissionError {
  using Port = TransmissionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "transmission_error",
      .title = "Transmission error of screw or gear",
      .family = Family::mechanics,
      .brief =
          "the load turns or travels unevenly against the motor: an uneven screw, gear or "
          "strain-wave drive",
      .equation = R"(q_load - q_motor = A sin(2 pi q / p + psi)
A: amplitude [m or rad], q: position, p: period [m or rad], psi: phase at q = 0 [rad])",
      .validity =
          R"(One harmonic, 2 pi A/p << 1: the changing ratio does nothing to forces; the motor's inertia is
moved by the wave at the speed of the axis. The loop first settles the error at the start.)",
      .source =
          R"(Tuttle, Seering, IEEE Trans. Robotics and Automation 12 (1996) 368, kinematic error of harmonic
drives; ISO 230-2:2014, periodic positioning error of screws)",
      .signature =
          R"(A wave over the position between the two measuring systems. With the loop closed on the motor the
load is off by A sin(...); with the loop closed on the load slowly only the motor moves by it, at
speed v the load by A w/sqrt(w^2 + Kv^2), w = 2 pi v/p: velocity is the motor's.)",
      .confusable = "pitch_periodic load_encoder_error encoder_subdivision cogging",
      .separate =
          R"(pitch_periodic and cogging are not seen between the two measuring systems; load_encoder_error
moves the load where the loop is closed on it, and does not where it is closed on the motor)",
      .showing = Showing::line};

  double amplitude = 0;   ///< A [m or rad]
  double period = 10e-3;  ///< p [m or rad]
  double phase = 0;       ///< psi [rad]

  static TransmissionError nominal(bool rotary) {
    return rotary ? TransmissionError{.amplitude = 10 * unit::arcsec.to_si, .period = 6 * kDegree}
                  : TransmissionError{.amplitude = 2e-6, .period = 10e-3};
  }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "amplitude_arcsec" : "amplitude_um", p.amplitude,
          rotary ? unit::arcsec : unit::um, Range{0, 1000}, "of the load against the motor");
    visit(rotary ? "period_deg" : "period_mm", p.period, rotary ? unit::deg : unit::mm,
          Range{0.001, 1e4}, "travel after which it repeats");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "phase at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    if (null()) return;
    signal.wave = T(amplitude);
    signal.wave_period = T(period);
    signal.wave_phase = T(phase);
  }
};

}  // namespace vcnc
