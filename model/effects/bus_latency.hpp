#pragma once

#include <array>
#include <cstdint>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct BusLatency {
  using Port = ReceptionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "bus_latency",
      .title = "Latency of one drive's set-points",
      .family = Family::bus,
      .brief = "one drive acts on set-points of some bus cycles ago",
      .equation = R"(x_k -> x_(k-n),  v_k -> v_(k-n)
n: whole bus cycles; x, v: set-point received in cycle k)",
      .validity =
          R"(Constant. Before the first set-point that one is held; the same after the drive has stopped
following and begins anew.)",
      .source = "own derivation; clocks shared over the bus (IEEE 1588) exist to exclude it",
      .signature =
          R"(The axis comes n cycles late: v n T on a ramp, at 3000 mm/min and 1 ms 50 um per cycle. On a circle
with one late axis an ellipse at 45 deg of v n T from peak to peak that turns with the direction.)",
      .confusable = "command_delay kv_error velocity_ff_error sample_latency",
      .separate = "a delay in whole cycles; time stamps of the bus show it directly",
      .showing = Showing::circle_feeds};

  int cycles = 0;  ///< n

  static BusLatency nominal(bool) { return {1}; }
  bool null() const { return cycles == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("delay_cycles", p.cycles, Range{0, 8}, "of the set-points, in bus cycles of 1 ms");
  }

  static constexpr int kHistory = 9;

  template <class T>
  struct State {
    std::array<T, kHistory> position{}, velocity{};  ///< a ring
    int newest = 0;
    std::int64_t due = -1;  ///< the cycle that would follow on the newest
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    if (context.moment.count != state.due) {
      state.position.fill(signal.position);
      state.velocity.fill(T(0));
    }
    state.due = context.moment.count + 1;
    state.newest = (state.newest + 1) % kHistory;
    state.position[at(state.newest)] = signal.position;
    state.velocity[at(state.newest)] = signal.velocity;
    const int old = (state.newest + kHistory - cycles) % kHistory;
    signal.position = state.position[at(old)];
    signal.velocity = state.velocity[at(old)];
  }
};

}  // namespace vcnc
