#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Cogging {
  using Port = MotorForcePort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "cogging",
      .title = "Cogging",
      .family = Family::servo,
      .brief = "the motor's magnets pull towards their rest positions, also without current",
      .equation = R"(F -> F + A sin(2 pi x / p + psi)
A: amplitude [N or N m], p: pole pitch as travel of the axis [m or rad], psi: phase; x: motor side)",
      .validity =
          "One harmonic of the pole pitch; independent of current and speed. Conservative: no "
          "loss.",
      .source =
          "Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation, linear direct drives",
      .signature =
          R"(Force with the wavelength p in position at any load, also at creep feed; at the table A times the
compliance of the loop at v/p: x/F = Ti s/(J Ti s^3 + Kp (Ti s + 1)(s + Kv)), so it grows with
the feed while the loop is faster than v/p.)",
      .confusable = "torque_ripple pitch_periodic encoder_subdivision weight_imbalance",
      .separate =
          R"(a wave of the force, where pitch_periodic has none; the same at no load, where torque_ripple by
current vanishes)",
      .showing = Showing::line};

  double amplitude = 0;  ///< A [N or N m]
  double pitch = 1;      ///< p [m or rad]
  double phase = 0;      ///< psi [rad]

  static Cogging nominal(bool rotary) {
    if (rotary) return {2, 15 * kDegree, 0};
    return {50, 24 * unit::mm.to_si, 0};
  }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "amplitude_Nm" : "amplitude_N", p.amplitude,
          rotary ? unit::newton_m : unit::newton, Range{0, 1e5}, "on the load side");
    visit(rotary ? "pole_pitch_deg" : "pole_pitch_mm", p.pitch, rotary ? unit::deg : unit::mm,
          Range{0.01, 1000}, "wavelength as travel of the axis");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    using std::sin;
    const T angle = (2 * kPi / pitch) * context.position + phase;
    signal.force += amplitude * sin(angle);
  }
};

}  // namespace vcnc
