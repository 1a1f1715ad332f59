#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Presliding {
  using Port = FrictionPort;
  static constexpr Place place = Place::axis;
  static constexpr bool constant = true;
  static constexpr EffectText text{
      .name = "presliding",
      .title = "Pre-sliding (LuGre bristles)",
      .family = Family::friction,
      .brief = "friction builds up over micrometres, like a spring, before the guide slides",
      .equation = R"(z' = v - sigma0 |v| z / g(v),   F_f = sigma0 z + sigma1 z' + B v
sigma0: stiffness [N/m or N m/rad], sigma1: damping of the bristles [N s/m or N m s/rad],
g: dry friction of the other effects [N or N m], B: their viscous friction, v: velocity)",
      .validity =
          "Needs dry friction to act. One bristle; no drift correction, no position memory beyond "
          "z.",
      .source =
          "Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419",
      .signature =
          R"(Rounded quadrant glitches: friction turns over within F_c/sigma0 of travel. Hysteresis of force
over displacement in reversals of 1..50 um.)",
      .confusable = "coulomb windup lost_motion",
      .separate =
          "small reversals: the loop's width in displacement is F_c/sigma0, whatever the speed",
      .showing = Showing::reversals};

  double stiffness = 0;  ///< [N/m or N m/rad]
  double damping = 0;    ///< [N s/m or N m s/rad]

  static Presliding nominal(bool rotary) {
    return rotary ? Presliding{.stiffness = 1e5, .damping = 50}
                  : Presliding{.stiffness = 2.5e7, .damping = 1.5e4};
  }
  bool null() const { return stiffness == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "stiffness_Nm_per_rad" : "stiffness_N_per_um", p.stiffness,
          rotary ? unit::nm_per_rad : unit::n_per_um, Range{0, 1e9}, "bristle stiffness sigma0");
    visit(rotary ? "damping_Nms_per_rad" : "damping_Ns_per_m", p.damping,
          rotary ? unit::nm_s_per_rad : unit::n_s_per_m, Range{0, 1e8}, "bristle damping sigma1");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.stiffness += stiffness;
    signal.damping += damping;
  }
};

}  // namespace vcnc
