#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct LostMotion {
  using Port = DisplacementPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "lost_motion",
      .title = "Elastic lost motion outside the measuring loop",
      .family = Family::mechanics,
      .brief = "the table gives way, between its scale and the tool centre, to the force on it",
      .equation = R"(displacement = -c F,   F = m a + F_f - F_ext
c: compliance [m/N or rad/(N m)], F: force that the drive puts into the table: inertia m a,
friction F_f, less further forces on the load F_ext [N or N m])",
      .validity =
          R"(Quasi-static: no resonance of its own (see structural_mode). All of the friction acts beyond the
spring. c = 1/K.)",
      .source =
          "Hooke's law; Altintas, Verl, Brecher, Uriarte, Pritschow, Machine tool feed drives, "
          "CIRP "
          "Annals 60/2 (2011) 779",
      .signature =
          R"(A step of 2 c F_c at each reversal, rounded as the friction turns over, plus c m a while
accelerating: on a circle at feed v a radius larger by c m v^2/R. Both encoders are blind to it.)",
      .confusable = "windup load_play backlash cross_inertia presliding",
      .separate =
          "grows with friction and acceleration, which play does not; unlike windup it stays with "
          "the measuring system on the load and does not show in the second encoder",
      .showing = Showing::circle};

  double compliance = 0;  ///< c [m/N or rad/(N m)]

  static LostMotion nominal(bool rotary) { return {rotary ? 1e-6 : 10e-9}; }
  bool null() const { return compliance == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "compliance_urad_per_Nm" : "compliance_nm_per_N", p.compliance,
          rotary ? Unit{"urad_per_Nm", 1e-6} : Unit{"nm_per_N", 1e-9}, Range{0, 1000},
          "elastic compliance between scale and tool centre, 0 = rigid");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    signal.displacement -= compliance * context.force;
  }
};

}  // namespace vcnc
