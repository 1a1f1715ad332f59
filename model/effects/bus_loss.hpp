#pragma once

#include <cstdint>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct BusLoss {
  using Port = ReceptionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "bus_loss",
      .title = "Lost set-points",
      .family = Family::bus,
      .brief = "set-points are lost at random; the drive holds the last position",
      .equation = R"(with probability p:  x_k -> x_(k-1) as received, v_k -> 0
p: share of lost set-points, each cycle for itself)",
      .validity =
          R"(Independent losses, no bursts. The drive holds without an alarm; frames that the bus itself loses
lead to a quick stop after three cycles instead.)",
      .source = "own derivation: the number of losses in a row is geometrically distributed",
      .signature =
          R"(Staircases in the motion: single stops of a cycle with a step of v T after them. On a ramp the axis
is late by p/(1 - p) cycles in the mean, v T p/(1 - p).)",
      .confusable = "bus_jitter dropped_samples command_delay",
      .separate =
          "single spikes of the force at random instants; dropped_samples shows in the reading "
          "only",
      .showing = Showing::circle_feeds};

  double share = 0;  ///< p

  static BusLoss nominal(bool) { return {0.01}; }
  bool null() const { return share == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("share_percent", p.share, Unit{"percent", 0.01}, Range{0, 90}, "of lost set-points");
  }

  template <class T>
  struct State {
    T position{};
    std::int64_t due = -1;  ///< the cycle that would follow on the last
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state,
            const Seat& seat) const {
    const bool follows = context.moment.count == state.due;
    state.due = context.moment.count + 1;
    if (follows && seat.noise.uniform(context.moment.count) < share) {
      signal.position = state.position;
      signal.velocity = T(0);
    }
    state.position = signal.position;
  }
};

}  // namespace vcnc
