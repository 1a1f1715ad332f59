#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct EncoderEccentricity {
  using Port = EncoderPort;
  static constexpr Place place = Place::rotary_axis;
  static constexpr EffectText text{
      .name = "encoder_eccentricity",
      .title = "Eccentric scale of a rotary axis",
      .family = Family::servo,
      .brief = "the graduation of a rotary axis is mounted off its centre",
      .equation = R"(q_measured = q + A sin(q + psi),   A = 2 e / D
A: amplitude [rad], psi: phase; e: eccentricity, D: mean diameter of the graduation (same unit);
in arcsec: A = 412 e[um] / D[mm])",
      .validity =
          R"(One scanning head, first harmonic, e << D; two opposite heads have none. Both measuring systems
of the axis have the same. The loop first settles the error at the start.)",
      .source =
          R"(Heidenhain, Angle Encoders, section on measuring accuracy: 412 e/D; own derivation of A = 2 e/D)",
      .signature =
          R"(Positioning error of the axis with one wave per turn at every feed; under RTCP the ball is off by
A times its lever. Nothing in the following error.)",
      .confusable = "rotary_runout c_axis_offset a_axis_offset pitch_periodic",
      .separate =
          R"(tangential and in proportion to the lever; an offset or run-out of the axis moves the ball by the
same at every lever)",
      .showing = Showing::spin};

  double amplitude = 0;  ///< A [rad]
  double phase = 0;      ///< psi [rad]

  static EncoderEccentricity nominal() { return {8 * unit::arcsec.to_si, 0}; }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("amplitude_arcsec", p.amplitude, unit::arcsec, Range{0, 3600}, "of the error");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "of the error at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    using std::sin;
    const T angle = signal.position + phase;
    signal.position += amplitude * sin(angle);
  }
};

}  // namespace vcnc
