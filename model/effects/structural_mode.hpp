#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct StructuralMode {
  using Port = DisplacementPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "structural_mode",
      .title = "Structural mode at the tool centre",
      .family = Family::mechanics,
      .brief = "column, spindle or table swings when the axis accelerates",
      .equation = R"(z'' + 2 zeta w z' + w^2 z = -g a,   displacement = z,   w = 2 pi f
f: frequency [Hz], zeta: damping ratio, a: acceleration of the load [m/s^2 or rad/s^2],
g: participation, 1 where the whole tool side hangs on the mode's spring)",
      .validity =
          R"(One mode, zeta < 1. Exact for an acceleration that is constant over a step of 100 us. No force
back on the drive: the swinging mass is small against the axis, or its frequency is well above
the velocity loop. f constant over the work space.)",
      .source =
          "modal superposition: Altintas, Manufacturing Automation, 2nd ed., Cambridge 2012, ch. "
          "3; "
          "discretisation by zero-order hold: own derivation",
      .signature =
          R"(Below f a deflection -g a / w^2, on a circle +g v^2 / (R w^2) on the radius. After each change of
acceleration it rings at w sqrt(1 - zeta^2), decaying by exp(-zeta w t); a jump of a gives an
overshoot of exp(-pi zeta / sqrt(1 - zeta^2)). Both encoders are blind to it.)",
      .confusable = "windup cross_inertia frame_vibration mains_hum lost_motion",
      .separate =
          "frequency constant in time whatever the feed, excited by jerk only: vibration from "
          "outside "
          "does not stop at rest; windup shows in the second encoder",
      .showing = Showing::corner};

  double participation = 0;     ///< g
  double frequency = 40;        ///< f [Hz]
  double damping_ratio = 0.03;  ///< zeta

  static StructuralMode nominal(bool /*rotary*/) {
    return {.participation = 1, .frequency = 35, .damping_ratio = 0.04};
  }
  bool null() const { return participation == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool /*rotary*/) {
    visit("participation", p.participation, unit::none, Range{-10, 10},
          "share of the axis acceleration that drives the mode");
    visit("frequency_Hz", p.frequency, unit::hz, Range{1, 2000}, "of the mode, undamped");
    visit("damping_ratio", p.damping_ratio, unit::none, Range{0, 0.9}, "of the mode");
  }

  template <class T>
  struct State {
    T z = T(0.0), speed = T(0.0);
    // Transition over one step of `dt`: found once.
    double dt = 0, zz = 0, zv = 0, vz = 0, vv = 0;
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    const double w = 2 * kPi * frequency;
    if (state.dt != context.moment.dt) prepare(state, context.moment.dt);
    const T rest = context.load.acceleration * (-participation / (w * w));
    const T z = state.z - rest, v = state.speed;
    state.z = rest + state.zz * z + state.zv * v;
    state.speed = state.vz * z + state.vv * v;
    signal.displacement += state.z;
  }

 private:
  template <class T>
  void prepare(State<T>& state, double dt) const {
    const double w = 2 * kPi * frequency, decay = damping_ratio * w;
    const double w_d = w * std::sqrt(1 - damping_ratio * damping_ratio);
    const double fade = std::exp(-decay * dt);
    const double c = fade * std::cos(w_d * dt), s = fade * std::sin(w_d * dt) / w_d;
    state.dt = dt;
    state.zz = c + decay * s;
    state.zv = s;
    state.vz = -w * w * s;
    state.vv = c - decay * s;
  }
};

}  // namespace vcnc
