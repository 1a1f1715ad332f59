#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct Windup {
  using Port = TransmissionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "windup",
      .title = "Elastic wind-up",
      .family = Family::mechanics,
      .brief = "a spring between motor and load: screw, nut and bearings, or the gear",
      .equation = R"(m_r x_m'' = F - F_s,   m x'' = F_s - F_f,   F_s = (x_m - x)/c + D (x_m' - x')
c: compliance [m/N or rad/(N m)]; D = 2 zeta w m_red, w^2 = 1/(c m_red), 1/m_red = 1/m + 1/m_r)",
      .validity =
          R"(Resonances up to 1.6 kHz (half a radian per plant step); a stiffer spring is taken as that.
Lumped: one mode.)",
      .source =
          "Altintas, Verl, Brecher, Uriarte, Pritschow, Machine tool feed drives, CIRP Annals 60/2 "
          "(2011) 779",
      .signature =
          R"(With the measuring system on the motor: the tool lags by c F, so 2 c F_c between the two
directions (a rounded step at reversals), and c m a while accelerating. After jerk it rings
at f = sqrt(1/(c m_red))/2 pi.)",
      .confusable = "backlash lost_motion structural_mode",
      .separate =
          "grows with friction and acceleration, which backlash does not; second encoder shows it",
      .showing = Showing::circle};

  double compliance = 0;        ///< [m/N] or [rad/(N m)]; 0 = rigid
  double damping_ratio = 0.05;  ///< of the free resonance

  static Windup nominal(bool rotary) { return {.compliance = rotary ? 1e-6 : 10e-9}; }
  bool null() const { return compliance == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "compliance_urad_per_Nm" : "compliance_nm_per_N", p.compliance,
          rotary ? Unit{"urad_per_Nm", 1e-6} : Unit{"nm_per_N", 1e-9}, Range{0, 1000},
          "elastic compliance between motor and load, 0 = rigid");
    visit("damping_ratio", p.damping_ratio, unit::none, Range{0, 1}, "of the free resonance");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    if (null()) return;
    signal.compliance += compliance;
    signal.damping_ratio = T(damping_ratio);
  }
};

}  // namespace vcnc
