#pragma once

#include <array>
#include <cstdint>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CommandDelay {
  using Port = SetpointPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "command_delay",
      .title = "Delay of the set-point",
      .family = Family::servo,
      .brief = "the loops of one axis act on a set-point that is late by a constant time",
      .equation = R"(x_c(t) -> x_c(t - t_d),  v_c(t) -> v_c(t - t_d)
t_d: delay [s]; x_c, v_c: set-point of the loops with its velocity)",
      .validity =
          R"(Constant. Between the last set-points at 100 us by cubic Hermite interpolation, which is exact
within a bus cycle. Before the first set-point that one is held.)",
      .source =
          "own derivation; ellipses from unequal lags of two axes belong to circular tests, ISO "
          "230-4",
      .signature =
          R"(The whole motion of the axis comes t_d late: v t_d on a ramp at any feed-forward. On a circle with
one late axis an ellipse at 45 deg of v t_d from peak to peak that turns with the direction; a
late rotary axis under RTCP gives w t_d times the lever.)",
      .confusable = "kv_error velocity_ff_error bus_latency current_lag sample_latency",
      .separate =
          R"(phase in proportion to the frequency without loss of amplitude; bus_latency comes in whole
cycles; sample_latency delays the reading of all axes, also against the encoders)",
      .showing = Showing::circle_feeds};

  double delay = 0;  ///< [s]

  static CommandDelay nominal(bool) { return {0.2e-3}; }
  bool null() const { return delay == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("delay_ms", p.delay, unit::ms, Range{0, 5}, "of the set-point");
  }

  static constexpr int kHistory = 52;  ///< 5 ms of set-points at 100 us, both ends included

  template <class T>
  struct State {
    std::array<T, kHistory> position{}, velocity{};  ///< a ring
    int newest = -1;
    std::int64_t count = -1;  ///< instant of the newest
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    if (delay == 0) return;
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    const bool first = state.newest < 0;
    if (first) {
      state.position.fill(signal.position);
      state.velocity.fill(T(0));
      state.newest = 0;
    } else if (context.moment.count != state.count) {
      state.newest = (state.newest + 1) % kHistory;
    }
    state.count = context.moment.count;
    state.position[at(state.newest)] = signal.position;
    state.velocity[at(state.newest)] = signal.velocity;

    const double dt = context.moment.dt;
    const double steps = delay / dt * (1 + 1e-12);  // a whole number of steps is one
    const int whole = static_cast<int>(steps);
    const double back = steps - whole;
    const int after = (state.newest + kHistory - whole) % kHistory;
    const int before = (after + kHistory - 1) % kHistory;
    const T x1 = state.position[at(after)], v1 = state.velocity[at(after)];
    if (back < 1e-9) {
      signal.position = x1;
      signal.velocity = v1;
      return;
    }
    // Cubic in s = 0..1 from the older to the newer set-point.
    const T x0 = state.position[at(before)], b = dt * state.velocity[at(before)];
    const T way = x1 - x0, b1 = dt * v1;
    const T c = 3 * way - 2 * b - b1, d = b + b1 - 2 * way;
    const double s = 1 - back;
    signal.position = x0 + s * (b + s * (c + s * d));
    signal.velocity = (b + s * (2 * c + s * 3 * d)) / dt;
  }
};

}  // namespace vcnc
