#pragma once

#include <cstdint>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct DroppedSamples {
  using Port = ReadingPort;
  static constexpr Place place = Place::probe;
  static constexpr EffectText text{
      .name = "dropped_samples",
      .title = "Dropped samples",
      .family = Family::acquisition,
      .brief = "now and then the module repeats its last deflection",
      .equation = R"(x_read(k) = x_read(k - 1) with probability P in every bus cycle k
P: share of the cycles [-]; all channels together, independent from cycle to cycle)",
      .validity =
          R"(Independent drops; bursts come by chance only. Time stamp, flags and converter codes of
the repeated message are fresh, so that nothing but the values shows it.)",
      .source = "own definition; expected squared error: P (x' 1 ms)^2 for small P",
      .signature =
          R"(Stairs: single readings off by one cycle of the deflection's change, 1 ms x'; none where
the deflection is constant.)",
      .confusable = "sample_jitter bus_loss contact_loss",
      .separate = "two readings exactly equal in all channels; sample_jitter never repeats",
      .showing = Showing::circle_feeds};

  double share = 0;  ///< of the cycles

  static DroppedSamples nominal() { return {0.05}; }
  bool null() const { return share == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("share_percent", p.share, Unit{"percent", 0.01}, Range{0, 100}, "of the bus cycles");
  }

  template <class T>
  struct State {
    Vec3Of<T> sent = Vec3Of<T>::Zero();
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state,
            const Seat& seat) const {
    // The sample of step 10 k is the one sent in cycle k; steps 10 k - 9 .. 10 k belong to it.
    constexpr std::int64_t kSteps = 10;
    const std::int64_t cycle = (context.moment.count + kSteps - 1) / kSteps;
    if (cycle > 0 && seat.noise.uniform(cycle) < share)
      signal.deflection = state.sent;
    else if (context.moment.count == cycle * kSteps)
      state.sent = signal.deflection;
  }
};

}  // namespace vcnc
