#pragma once

#include <cmath>

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct PathFilter {
  using Port = InterpolationPort;
  static constexpr Place place = Place::nc;
  static constexpr EffectText text{
      .name = "path_filter",
      .title = "Filter of the set-points",
      .family = Family::nc,
      .brief = "the NC smooths the set-points of all axes by a low-pass",
      .equation = R"(tau y' + y = x for every axis
tau: time constant [s], x: planned set-point, y: commanded one [m or rad])",
      .validity =
          R"(Exact for set-points that are cubic between bus cycles (position and velocity at both ends). The
filter starts at rest on the first set-point; a run ends 100 ms after the last. All axes alike.)",
      .source =
          R"(own derivation; first-order low-pass. Filters of this kind belong to the high-speed settings of
controls)",
      .signature =
          R"(A circle of radius R at angular speed w keeps R/sqrt(1 + (w tau)^2), about -R (w tau)^2/2 or
-(v tau)^2/(2 R): grows with the square of the feed and with 1/R. Corners are rounded in
proportion to the feed; v tau late on a ramp. In the commanded position too.)",
      .confusable = "velocity_ff_error kv_error corner_cutting tip_radius",
      .separate =
          R"(the commanded position shows it, so the following error does not; all axes alike; grows with the
feed, where tip_radius and corner_cutting stay)",
      .showing = Showing::circle_feeds};

  double time_constant = 0;  ///< tau [s]

  static PathFilter nominal() { return {5e-3}; }
  bool null() const { return time_constant == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("time_constant_ms", p.time_constant, unit::ms, Range{0, 20}, "of the low-pass");
  }

  template <class T>
  struct State {
    bool primed = false;
    PerAxis<T> x{}, dx{};  ///< last planned position and velocity
    PerAxis<T> y{}, dy{};  ///< last commanded ones
  };

  /// With x a cubic, p = x - tau x' + tau^2 x'' - tau^3 x''' solves the equation, and y - p fades.
  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    using std::exp;
    if (time_constant == 0) return;
    const double h = context.moment.dt, tau = time_constant, fade = exp(-h / tau);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const T x1 = signal.position[i], v1 = signal.velocity[i];
      if (state.primed) {
        const T x0 = state.x[i], v0 = state.dx[i];
        const T way = (x1 - x0) / h;
        const T jerk = (v0 + v1 - 2 * way) * (6 / (h * h));
        const T a0 = (3 * way - 2 * v0 - v1) * (2 / h), a1 = a0 + jerk * h;
        const T dp0 = v0 - tau * (a0 - tau * jerk), dp1 = v1 - tau * (a1 - tau * jerk);
        state.y[i] = x1 - tau * dp1 + fade * (state.y[i] - x0 + tau * dp0);
        state.dy[i] = dp1 + fade * (state.dy[i] - dp0);
      } else {
        state.y[i] = x1;
        state.dy[i] = T(0);
      }
      state.x[i] = x1;
      state.dx[i] = v1;
      signal.position[i] = state.y[i];
      signal.velocity[i] = state.dy[i];
    }
    state.primed = true;
  }
};

}  // namespace vcnc
