#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct FrameVibration {
  using Port = PosePort;
  static constexpr Place place = Place::geometry;
  static constexpr EffectText text{
      .name = "frame_vibration",
      .title = "Vibration of the frame",
      .family = Family::mechanics,
      .brief = "the tool shakes against the table: pumps, fans, the floor",
      .equation = R"(d = A sin(2 pi f t + psi)
d: displacement of the tip in the machine frame [m], A: amplitudes in X, Y, Z [m],
f: frequency [Hz], psi: phase at the first cycle [rad])",
      .validity =
          R"(Forced, of constant size, one frequency, all directions in phase; not excited by the
motion. Bus samples come at 1 kHz: f above 500 Hz appears folded down.)",
      .source = "ISO 230-8 (vibrations of machine tools); own definition",
      .signature =
          R"(A line at f in the spectrum over time, at standstill as well; over the path its
wavelength grows with the feed. Laps do not repeat unless f times the lap time is whole.)",
      .confusable = "mains_hum structural_mode cogging encoder_subdivision",
      .separate =
          "there at rest, at a fixed frequency in time; mains_hum is not in the ball's true motion "
          "and changes with the phase of the probe's signals",
      .showing = Showing::standstill};

  Vec3 amplitude = Vec3::Zero();  ///< [m]
  double frequency = 50;          ///< [Hz]
  double phase = 0;               ///< [rad]

  static FrameVibration nominal() { return {.amplitude = Vec3(1e-6, 0.5e-6, 0.5e-6)}; }
  bool null() const { return amplitude.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("amplitude_um", p.amplitude, unit::um, Range{-1000, 1000}, "in X, Y, Z of the machine");
    visit("frequency_Hz", p.frequency, unit::hz, Range{0.01, 2000}, "of the vibration");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "at the first cycle");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double swing = std::sin(2 * kPi * frequency * context.moment.t + phase);
    signal.tip += Vec3(amplitude * swing).template cast<T>();
  }
};

}  // namespace vcnc
