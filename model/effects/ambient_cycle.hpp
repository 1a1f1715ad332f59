#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct AmbientCycle {
  using Port = DisplacementPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "ambient_cycle",
      .title = "Cycle of the surroundings",
      .family = Family::thermal,
      .brief =
          "chiller, air conditioning or a hall door: an offset along the axis that comes and goes",
      .equation = R"(displacement = A sin(2 pi t / T_c)
A: amplitude [m or rad], T_c: period [s], t: time since the start [s])",
      .validity =
          R"(One harmonic, starting at its mean, the same everywhere in the work space. Chillers: T_c 2 to
10 min; halls: a day.)",
      .source =
          "ISO 230-3:2020, environmental temperature variation error (test procedure); sine: own "
          "choice",
      .signature =
          R"(A point probed again and again moves to and fro with T_c, whatever the machine does. Over less
than T_c/8 it is a straight drift of 2 pi A / T_c.)",
      .confusable = "thermal_drift thermal_expansion probe_drift mains_hum",
      .separate = "standstill for more than one period: it returns; a drift does not",
      .showing = Showing::standstill};

  double amplitude = 0;  ///< A [m or rad]
  double period = 300;   ///< T_c [s]

  static AmbientCycle nominal(bool rotary) {
    return {.amplitude = rotary ? 3 * unit::arcsec.to_si : 4 * unit::um.to_si, .period = 20};
  }
  bool null() const { return amplitude == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "amplitude_arcsec" : "amplitude_um", p.amplitude,
          rotary ? unit::arcsec : unit::um, Range{0, 1e4}, "amplitude of the offset");
    visit("period_s", p.period, unit::s, Range{1, 1e6}, "of the cycle");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.displacement += amplitude * std::sin(2 * kPi * context.moment.t / period);
  }
};

}  // namespace vcnc
