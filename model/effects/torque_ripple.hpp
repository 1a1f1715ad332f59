#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct TorqueRipple {
  using Port = MotorForcePort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "torque_ripple",
      .title = "Torque ripple of the motor",
      .family = Family::servo,
      .brief = "the motor's force swings a whole number of times per turn",
      .equation = R"(F -> F + (A + a F) sin(n 2 pi x / p + psi)
A: amplitude at no load [N or N m], a: share of the force, n: order per motor turn,
p: travel per motor turn [m or rad], psi: phase; x: motor side)",
      .validity =
          R"(One order. A comes from offsets of the current measurement (order: pole pairs), a from their gain
errors (twice the pole pairs) and from harmonics of the flux (six times the pole pairs).)",
      .source =
          R"(Chung, Sul, Analysis and compensation of current measurement error in vector-controlled AC motor
drives, IEEE Trans. Industry Applications 34 (1998) 340)",
      .signature =
          R"(Ripple of the force with the order n of the motor turn; at the table A times the compliance of the
loop at n v/p, which has its maximum at mid frequencies. The part a grows with load and
acceleration.)",
      .confusable = "cogging pitch_periodic encoder_subdivision",
      .separate =
          R"(cogging does not grow with the force; pitch_periodic is not seen by the measuring system and
independent of the feed)",
      .showing = Showing::line};

  double amplitude = 0;  ///< A [N or N m]
  double share = 0;      ///< a
  int order = 6;         ///< n
  double phase = 0;      ///< psi [rad]

  static TorqueRipple nominal(bool rotary) {
    return {.amplitude = rotary ? 1.0 : 40.0, .share = 0.02, .order = rotary ? 24 : 6};
  }
  bool null() const { return amplitude == 0 && share == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "amplitude_Nm" : "amplitude_N", p.amplitude,
          rotary ? unit::newton_m : unit::newton, Range{0, 1e5}, "at no load, on the load side");
    visit("share_percent", p.share, Unit{"percent", 0.01}, Range{0, 50},
          "further amplitude as a share of the force");
    visit("order", p.order, Range{1, 1000}, "waves per motor turn");
    visit("phase_deg", p.phase, unit::deg, Range{-360, 360}, "at position 0");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    using std::sin;
    const T angle = (2 * kPi * order / context.travel_per_turn) * context.position + phase;
    const T wave = sin(angle);
    signal.force += (amplitude + share * signal.force) * wave;
  }
};

}  // namespace vcnc
