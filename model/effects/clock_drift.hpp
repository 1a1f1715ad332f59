#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/effects/sample_ring.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct ClockDrift {
  using Port = DeflectionPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "clock_drift",
      .title = "Drift of the probe's clock",
      .family = Family::acquisition,
      .brief = "the probe's clock goes slow: its readings fall more and more behind",
      .equation = R"(x_read(t) = x(t - lag),   lag = p t
p: slowness of the clock [-], t: since the first cycle [s])",
      .validity =
          R"(A clock that goes slow; one that goes fast would need the future. The lag ends at 25 ms,
the length of the buffer: at 20 ppm after 21 min. Linear between samples of 100 us.)",
      .source = "own derivation; crystal oscillators are within 20 .. 100 ppm",
      .signature =
          R"(As sample_latency, but the latency grows with the time: repeated laps show an error in
proportion to the speed of the deflection and to the time since the start.)",
      .confusable = "sample_latency probe_drift thermal_drift",
      .separate =
          "nothing at the start of the run and nothing at standstill, where probe_drift goes on",
      .showing = Showing::circle};

  double slow = 0;  ///< [-]

  static ClockDrift nominal() { return {50e-6}; }
  bool null() const { return slow == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("slow_ppm", p.slow, Unit{"ppm", 1e-6}, Range{0, 10000},
          "the lag grows by this share of the time");
  }

  static constexpr int kLongest = 250;  ///< samples: the largest lag

  template <class T>
  struct State {
    SampleRing<Vec3Of<T>, kLongest + 2> ring;
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    state.ring.push(signal.deflection);
    const double lag = slow * context.moment.t / context.moment.dt;
    signal.deflection = state.ring.back(lag < kLongest ? lag : kLongest);
  }
};

}  // namespace vcnc
