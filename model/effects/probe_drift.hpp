#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ProbeDrift {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "probe_drift",
      .title = "Drift of the probe",
      .family = Family::probe,
      .brief = "the zero of the probe wanders as it warms up",
      .equation = R"(d = r tau (1 - exp(-t/tau));   d = r t where tau = 0
d: shift of the reading in the probe frame [m], r: rate at the start [m/s], tau: time constant [s],
t: since the first cycle [s])",
      .validity =
          "Additive, the same at every deflection; starts at switch-on and is not re-zeroed.",
      .source = "ISO 230-3 (thermal drift tests); first order warm-up: own derivation",
      .signature =
          R"(Laps of the same program differ by a shift that grows with the time, independent of
position and feed; in the frame of the probe, so on a circle one period per turn.)",
      .confusable = "thermal_drift ambient_cycle return_to_zero piece_offset",
      .separate =
          "seen with the ball free, too; thermal_drift of the machine needs contact to be seen",
      .showing = Showing::standstill};

  Vec3 rate = Vec3::Zero();  ///< [m/s]
  double time_constant = 0;  ///< [s]; 0: linear

  static ProbeDrift nominal() { return {.rate = Vec3(2e-6, -1e-6, 3e-6) / 60}; }
  bool null() const { return rate.isZero(0); }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("rate_um_per_min", p.rate, Unit{"um_per_min", 1e-6 / 60}, Range{-1000, 1000},
          "at the start, in x, y, z of the probe");
    visit("time_constant_s", p.time_constant, unit::s, Range{0, 1e5}, "of the warm-up; 0: linear");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    const double t = context.moment.t;
    const double grown = time_constant > 0 ? -time_constant * std::expm1(-t / time_constant) : t;
    signal.deflection += Vec3(rate * grown).template cast<T>();
  }
};

}  // namespace vcnc
