#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct LoadPlay {
  using Port = DisplacementPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "load_play",
      .title = "Play outside the measuring loop",
      .family = Family::mechanics,
      .brief = "the tool centre trails the scale by half a gap: a loose gib, fixture or scale head",
      .equation = R"(p(t) = min(max(p(t-), q - b/2), q + b/2),   displacement = p - q
p: dragged tool centre, q: scale [m or rad], b: width of the play [m or rad]; it starts in the
middle (play operator))",
      .validity =
          R"(Kinematic: friction holds the dragged body wherever it was left, its inertia is small against
that friction. No force back on the drive.)",
      .source =
          "play operator: Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996, ch. "
          "2",
      .signature =
          R"(A step of b at each reversal, the same at every feed, complete after b of travel; on a circle at
0 and 180 deg for X, at 90 and 270 deg for Y. Invisible to both encoders and the force.)",
      .confusable = "backlash lost_motion windup lateral_play",
      .separate =
          "drive force and second encoder know nothing of it, with any measuring system; "
          "lost_motion scales with the force",
      .showing = Showing::circle};

  double width = 0;  ///< b [m or rad]

  static LoadPlay nominal(bool rotary) {
    return {rotary ? 10 * unit::arcsec.to_si : 8 * unit::um.to_si};
  }
  bool null() const { return width == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "width_arcsec" : "width_um", p.width, rotary ? unit::arcsec : unit::um,
          Range{0, 2000}, "play between scale and tool centre");
  }

  template <class T>
  struct State {
    T last = T(0.0);    ///< position before
    T offset = T(0.0);  ///< p - q
    bool begun = false;
  };

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, State<T>& state) const {
    const T& q = context.load.position;
    const double half = 0.5 * width;
    if (state.begun) {
      state.offset -= q - state.last;
      if (state.offset > half) state.offset = T(half);
      if (state.offset < -half) state.offset = T(-half);
    }
    state.begun = true;
    state.last = q;
    signal.displacement += state.offset;
  }
};

}  // namespace vcnc
