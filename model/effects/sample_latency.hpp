#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/effects/sample_ring.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct SampleLatency {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "sample_latency",
      .title = "Latency of the probe against the axes",
      .family = Family::acquisition,
      .brief = "the deflection is older than its time stamp",
      .equation = R"(x_read(t) = x(t - tau)
tau: latency [s]; to first order the error is -tau x', x' the speed of the deflection)",
      .validity =
          R"(0 .. 5 ms, constant, all channels alike. Linear between samples of 100 us: exact for
whole multiples of 100 us, otherwise off by at most h^2/8 x'' (h = 100 us). Holds the
first value before the start.)",
      .source = "own derivation; ISO 10360-5 asks for synchronous readings in scanning",
      .signature =
          R"(Error -tau times the speed of the deflection: none while the deflection is constant, on
a circle that is off centre by e: tau w e, in quadrature to the eccentricity, reversed
with the sense.)",
      .confusable = "command_delay bus_latency clock_drift current_lag",
      .separate =
          "goes with the speed of the deflection, not of the axes: nothing on a well centred "
          "circle",
      .showing = Showing::circle_feeds};

  double latency = 0;  ///< [s]

  static SampleLatency nominal() { return {1e-3}; }
  bool null() const { return latency == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("latency_us", p.latency, unit::us, Range{0, 5000}, "age of the deflection");
  }

  template <class T>
  struct State {
    SampleRing<Vec3Of<T>, 52> ring;
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    state.ring.push(signal.deflection);
    signal.deflection = state.ring.back(latency / context.moment.dt);
  }
};

}  // namespace vcnc
