#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ThermalWarmUp {
  using Port = DisplacementPort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "thermal_warm_up",
      .title = "Warm-up of a screw or scale",
      .family = Family::thermal,
      .brief = "screw or scale grows towards the length of its warm state",
      .equation = R"(displacement = alpha dT (1 - exp(-t / tau)) (q - q_0)
alpha: coefficient of expansion [1/K], dT: rise in the end [K], tau: time constant [s],
t: time since the start [s], q: position, q_0: fixed point [m])",
      .validity =
          R"(One lumped heat capacity, uniform temperature, load and surroundings constant. Screws of machine
tools: tau 5 to 60 min, dT 1 to 10 K.)",
      .source =
          "linear expansion with Newton cooling; Mayr et al., Thermal issues in machine tools, "
          "CIRP "
          "Annals 61/2 (2012) 771; alpha of steel 11.5 um/(m K)",
      .signature =
          R"(A scale error alpha dT that builds up with tau: circles grow from lap to lap, fast at first.
Nothing at the fixed point.)",
      .confusable = "thermal_expansion scale_error thermal_drift ambient_cycle friction_fade",
      .separate =
          "repetition of one block over the run: the trend bends, and is in proportion to the "
          "distance from the fixed point",
      .showing = Showing::circle};

  double rise = 0;              ///< dT [K]
  double time_constant = 1200;  ///< tau [s]
  double expansion = 11.5e-6;   ///< alpha [1/K]
  double reference = 0;         ///< q_0 [m]

  static ThermalWarmUp nominal() { return {.rise = 5, .time_constant = 60}; }
  bool null() const { return rise == 0 || expansion == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("rise_K", p.rise, Unit{"K", 1}, Range{-50, 50}, "rise of temperature in the end");
    visit("time_constant_s", p.time_constant, unit::s, Range{0.1, 1e6}, "of the warming");
    visit("expansion_um_per_m_K", p.expansion, Unit{"um_per_m_K", 1e-6}, Range{0, 100},
          "coefficient of expansion; 11.5 is steel");
    visit("reference_mm", p.reference, unit::mm, Range{-1e4, 1e4}, "fixed point");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double growth = -expansion * rise * std::expm1(-context.moment.t / time_constant);
    signal.displacement += growth * (context.load.position - reference);
  }
};

}  // namespace vcnc
