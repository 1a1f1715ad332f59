#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ThermalExpansion {
  using Port = DisplacementPort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "thermal_expansion",
      .title = "Steady thermal growth",
      .family = Family::thermal,
      .brief = "screw or scale grows steadily about its fixed point while the machine works",
      .equation = R"(displacement = r t (q - q_0)
r: growth [m/(m s)], t: time since the start [s], q: position, q_0: fixed point [m])",
      .validity =
          R"(Runs that are short against the thermal time constant: the first, linear part of
thermal_warm_up with r = alpha dT / tau. Uniform temperature along the scale.)",
      .source =
          "linear expansion; ISO 230-3:2020, thermal distortion caused by moving linear axes (test "
          "procedure)",
      .signature =
          R"(A scale error that grows with time: r t R on a circle, larger every lap, larger far from the
fixed point, nothing at it.)",
      .confusable = "scale_error thermal_warm_up thermal_drift ambient_cycle",
      .separate =
          "the same block at the start and at the end of the run, at both ends of the travel: a "
          "drift "
          "moves both alike",
      .showing = Showing::circle};

  double rate = 0;       ///< r [1/s]
  double reference = 0;  ///< q_0 [m]

  static ThermalExpansion nominal() { return {.rate = 100 * per_minute().to_si}; }
  bool null() const { return rate == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("rate_um_per_m_min", p.rate, per_minute(), Range{-1e4, 1e4},
          "growth per metre of travel and minute");
    visit("reference_mm", p.reference, unit::mm, Range{-1e4, 1e4}, "fixed point");
  }

  static constexpr Unit per_minute() { return {"um_per_m_min", 1e-6 / 60}; }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.displacement += rate * context.moment.t * (context.load.position - reference);
  }
};

}  // namespace vcnc
