#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ThermalDrift {
  using Port = DisplacementPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "thermal_drift",
      .title = "Thermal drift",
      .family = Family::thermal,
      .brief = "column, head or table moves as it warms: an offset along the axis, growing in time",
      .equation = R"(displacement = d (1 - exp(-t / tau))
d: offset in the end [m or rad], tau: time constant [s], t: time since the start [s])",
      .validity =
          R"(One time constant, the same everywhere in the work space. Spindle heads: tau 10 to 60 min,
d 5 to 50 um.)",
      .source =
          "first-order warming, tested by ISO 230-3:2020 (environment and spindle tests); Mayr et "
          "al., "
          "CIRP Annals 61/2 (2012) 771",
      .signature =
          R"(The centre of a circle wanders while its form stays; a point probed again and again shows the
exponential directly. Independent of feed, direction and position.)",
      .confusable = "ambient_cycle probe_drift piece_offset thermal_warm_up thermal_expansion",
      .separate =
          "two points far apart move alike, which growth of a scale does not; turning the piece "
          "tells "
          "it from probe_drift: that stays with the probe",
      .showing = Showing::standstill};

  double offset = 0;            ///< d [m or rad]
  double time_constant = 1200;  ///< tau [s]

  static ThermalDrift nominal(bool rotary) {
    return {.offset = rotary ? 10 * unit::arcsec.to_si : 20 * unit::um.to_si, .time_constant = 60};
  }
  bool null() const { return offset == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "offset_arcsec" : "offset_um", p.offset, rotary ? unit::arcsec : unit::um,
          Range{-1e4, 1e4}, "offset in the end");
    visit("time_constant_s", p.time_constant, unit::s, Range{0.1, 1e6}, "of the drift");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.displacement -= offset * std::expm1(-context.moment.t / time_constant);
  }
};

}  // namespace vcnc
