#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct LateralPlay {
  using Port = PosePort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "lateral_play",
      .title = "Lateral play of a guide",
      .family = Family::geometry,
      .brief = "the carriage shifts sideways in its guide when the axis reverses",
      .equation = R"(e_1 = (l_1/2) z,  e_2 = (l_2/2) z;   z' = 2 q'/s,  held within -1 .. 1
q: position [m], l: play [m], s: travel of the axis in which the carriage changes sides [m], z: side
(z = sgn(q') once the axis has moved by s).  Directions 1, 2: X: Y, Z;  Y: X, Z;  Z: X, Y)",
      .validity =
          R"(Rate independent: no mass, no friction force. z = 0 until the axis has moved. The travel
s stands for what turns the carriage over (drag of drive and wipers) and keeps a
standstill quiet.)",
      .source =
          "ISO 230-4 / ballbar practice (lateral play: step across the reversing axis); the play "
          "operator: Visintin, Differential Models of Hysteresis (1994)",
      .signature =
          R"(On a circle the reversal of X steps Y by l, at 0 and 180 deg in the tangent: the trace
shifts sideways between the halves of the circle. The same at every feed.)",
      .confusable = "backlash load_play lost_motion",
      .separate = "the step is across the axis that reverses, backlash is along it",
      .showing = Showing::circle};

  double first = 0, second = 0;  ///< whole play [m]
  double crossing = 10e-6;       ///< [m]

  static LateralPlay nominal() { return {.first = 4e-6, .second = 2e-6}; }
  bool null() const { return first == 0 && second == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("first_um", p.first, unit::um, Range{-1000, 1000},
          "play across the axis; X: in Y, Y: in X, Z: in X; minus: the other way round");
    visit("second_um", p.second, unit::um, Range{-1000, 1000},
          "play across the axis; X: in Z, Y: in Z, Z: in Y");
    visit("crossing_um", p.crossing, unit::um, Range{0.01, 10000},
          "travel after a reversal in which the carriage changes sides");
  }

  template <class T>
  struct State {
    T last{}, side{};
    bool started = false;
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state,
            const Seat& seat) const {
    const T q = context.axes[seat.axis].position;
    if (state.started) {
      state.side += (q - state.last) * (2 / crossing);
      if (state.side > 1.0) state.side = T(1);
      if (state.side < -1.0) state.side = T(-1);
    }
    state.last = q;
    state.started = true;
    const Sideways across = sideways(seat.axis);
    signal.tip[across.first] += state.side * (0.5 * first);
    signal.tip[across.second] += state.side * (0.5 * second);
  }
};

}  // namespace vcnc
