#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct MotorFriction {
  using Port = TransmissionPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "motor_friction",
      .title = "Friction on the motor's side",
      .family = Family::friction,
      .brief = "friction before the elasticity of the transmission: motor bearings, seals, gear",
      .equation =
          R"(z' = v_m - sigma0 |v_m| z / F_c,  F_f = sigma0 z + B v_m,  m_r v_m' = F - F_s - F_f
F_c: level, B: viscous, sigma0: stiffness of its bristles, all seen from the load [N, N s/m, N/m or
N m, N m s/rad, N m/rad]; sigma0 = 0: F_f = F_c sgn(v_m) + B v_m, |F_f| <= F_c at rest;
F_s: what the transmission carries)",
      .validity =
          R"(Without bristles it sticks exactly (model/drive/friction.hpp). Without windup or backlash motor and
load are one mass, and level and viscous friction add to those of the load: the same as coulomb and
viscous.)",
      .source =
          R"(Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083; Tuttle, Seering, IEEE
Trans. Robotics and Automation 12 (1996) 368, friction of strain-wave drives; bristles: LuGre,
Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995) 419)",
      .signature =
          R"(Drive force jumps by 2 F_c at each reversal and rises with speed, as with friction of the load,
but the transmission does not carry it: the twist between motor and load stays as it was.)",
      .confusable = "coulomb viscous torque_constant_error",
      .separate =
          "coulomb and viscous wind the transmission up by F_f/k; the two measuring systems tell",
      .showing = Showing::circle};

  double level = 0;      ///< F_c [N or N m]
  double viscous = 0;    ///< B [N s/m or N m s/rad]
  double stiffness = 0;  ///< sigma0 [N/m or N m/rad]

  static MotorFriction nominal(bool rotary) {
    return rotary ? MotorFriction{.level = 5, .viscous = 10, .stiffness = 1e5}
                  : MotorFriction{.level = 100, .viscous = 500, .stiffness = 2.5e7};
  }
  bool null() const { return level == 0 && viscous == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    visit(rotary ? "level_Nm" : "level_N", p.level, rotary ? unit::newton_m : unit::newton,
          Range{0, 1e5}, "dry friction, seen from the load");
    visit(rotary ? "viscous_Nms_per_rad" : "viscous_Ns_per_m", p.viscous,
          rotary ? unit::nm_s_per_rad : unit::n_s_per_m, Range{0, 1e6},
          "viscous friction, seen from the load");
    visit(rotary ? "stiffness_Nm_per_rad" : "stiffness_N_per_um", p.stiffness,
          rotary ? unit::nm_per_rad : unit::n_per_um, Range{0, 1e9},
          "stiffness of its bristles; 0: none, it sticks exactly");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.motor_dry += T(level);
    signal.motor_viscous += T(viscous);
    signal.motor_stiffness += T(stiffness);
  }
};

}  // namespace vcnc
