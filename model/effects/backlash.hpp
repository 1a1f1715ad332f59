#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Backlash {
  using Port = TransmissionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "backlash",
      .title = "Backlash",
      .family = Family::mechanics,
      .brief = "play between motor and load: the load waits while the motor crosses the gap",
      .equation = R"(F_s = K (z - sgn(z) b/2) + D z'  where |z| > b/2, else 0;  z = x_motor - x_load
b: gap [m or rad], K, D: stiffness and damping of the transmission (see windup).)",
      .validity =
          R"(One gap for the whole travel. Needs a motor side of at least a thousandth of the load.
Without friction on the load, inertia decides on which side of the gap it lies.)",
      .source =
          "Gross, Hamann, Wiegaertner, Electrical Feed Drives in Automation, ch. 6; two-mass model",
      .signature =
          R"(With the measuring system on the motor: a step of b in the tool's position at each reversal
of the axis, the same at every feed; on a circle at 0 and 180 deg for X, 90 and 270 deg for Y.
With the measuring system on the load: the loop crosses the gap, a short spike instead.)",
      .confusable = "load_play windup lost_motion",
      .separate =
          "the step does not grow with friction or acceleration; the force dips while the gap is "
          "crossed",
      .showing = Showing::circle};

  double gap = 0;  ///< [m or rad]

  static Backlash nominal(bool rotary) {
    return {rotary ? 10 * unit::arcsec.to_si : 10 * unit::um.to_si};
  }
  bool null() const { return gap == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "gap_arcsec" : "gap_um", p.gap, rotary ? unit::arcsec : unit::um, Range{0, 2000},
          "play between motor and load");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.gap += gap;
  }
};

}  // namespace vcnc
