#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct CornerCutting {
  using Port = PlanPort;
  static constexpr Place place = Place::nc;
  static constexpr EffectText text{
      .name = "corner_cutting",
      .title = "Too wide blends at corners",
      .family = Family::nc,
      .brief = "the NC blends G64 corners with more tolerance than programmed",
      .equation = R"(tolerance = P + d
P: tolerance of G64 [m], d: excess [m]. A corner is blended with a hat of half width h:
|x - r| = |t2 - t1| h/6 <= tolerance, t1, t2: unit tangents before and after (controller/path.hpp))",
      .validity =
          R"(Moves under G64 only; under G61 nothing changes. The blend stays below the tolerance where short
moves or the orientation tolerance of 5-axis motion bind first.)",
      .source =
          "Biagiotti, Melchiorri, Trajectory Planning for Automatic Machines and Robots, ch. 4",
      .signature =
          R"(Corners are cut by up to P + d at every feed, straight moves and circles stay. In the commanded
position and in the probe alike, not in the following error; corners are also passed faster.)",
      .confusable = "path_filter velocity_ff_error chord_error",
      .separate = "does not change with the feed, where path_filter and servo errors do",
      .showing = Showing::corner};

  double excess = 0;  ///< d [m]

  static CornerCutting nominal() { return {50e-6}; }
  bool null() const { return excess == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("excess_um", p.excess, unit::um, Range{0, 1000}, "added to the tolerance of G64");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.blend_tolerance += excess;
  }
};

}  // namespace vcnc
