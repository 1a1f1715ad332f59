#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct AngularErrors {
  using Port = PosePort;
  static constexpr Place place = Place::linear_axis;
  static constexpr EffectText text{
      .name = "angular_errors",
      .title = "Roll, pitch and yaw of a linear axis",
      .family = Family::geometry,
      .brief = "the carriage tilts as it travels, and the tool with it",
      .equation = R"(eps = q/100 mm (roll, pitch, yaw);  tip += eps x arm;  the tool turns by eps
q: position [m], eps: rotation of the carriage about the machine's X, Y, Z [rad],
arm: from the carriage to the tool tip [m].
X: roll about X, pitch about Y, yaw about Z  (ISO 230-1: EAX, EBX, ECX);
Y: roll about Y, pitch about X, yaw about Z;  Z: roll about Z, pitch about X, yaw about Y)",
      .validity =
          R"(Proportional to the position from the machine's zero. First order in eps: eps^2 arm is
left out, 3 nm at 100 urad and 0.3 m. Guides meet at the machine's zero; column Y on X,
Z on Y, tool on Z.)",
      .source =
          "ISO 230-1 (angular error motions); E = sum of eps x r over the chain: usual volumetric "
          "model, e.g. Schwenke et al., CIRP Annals 57/2 (2008) 660",
      .signature =
          R"(Lines become bowed or sheared in proportion to the arm: a straightness error that
differs between two heights or two tool lengths. Independent of the feed. The tool axis
tilts by eps.)",
      .confusable = "straightness squareness scale_error",
      .separate = "grows with the arm: the same line with two tool lengths or at two heights",
      .showing = Showing::line};

  double roll = 0, pitch = 0, yaw = 0;  ///< at 100 mm [rad]

  static AngularErrors nominal() { return {.roll = 10e-6, .pitch = 20e-6, .yaw = -15e-6}; }
  bool null() const { return roll == 0 && pitch == 0 && yaw == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    constexpr Unit slope{"urad_per_100mm", 1e-6};
    visit("roll_urad_per_100mm", p.roll, slope, Range{-1000, 1000}, "about the axis itself");
    visit("pitch_urad_per_100mm", p.pitch, slope, Range{-1000, 1000},
          "X: about Y, Y: about X, Z: about X");
    visit("yaw_urad_per_100mm", p.yaw, slope, Range{-1000, 1000},
          "X: about Z, Y: about Z, Z: about Y");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context, const Seat& seat) const {
    constexpr double kReach = 0.1;  // [m] where the angles are given
    const T share = context.axes[seat.axis].position * (1 / kReach);
    const Sideways across = sideways(seat.axis);
    Vec3Of<T> eps;
    eps[static_cast<int>(seat.axis)] = roll * share;
    eps[across.first] = pitch * share;
    eps[across.second] = yaw * share;
    signal.tip += eps.cross(context.arm[seat.axis]);
    signal.tool_turn += eps;
  }
};

}  // namespace vcnc
