#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct TorqueConstantError {
  using Port = MotorForcePort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "torque_constant_error",
      .title = "Error of the torque constant",
      .family = Family::servo,
      .brief = "the motor gives more or less force than the drive believes",
      .equation = R"(F = (1 + d) F_drive
d: deviation of the torque constant, F_drive: force as the drive reports it [N or N m])",
      .validity =
          R"(Constant; saturation and temperature of the magnets are left out. The drive's limit is one of the
current, so the true largest force changes as well.)",
      .source = "own definition; torque constants of servo motors are stated to 5 to 10 %",
      .signature =
          R"(Every reported force is 1/(1 + d) of the true one: inertia, friction and weight all seem scaled
alike. The loop has (1 + d) of its gain and its feed-forward: errors as from acceleration_ff_error
with that d.)",
      .confusable = "acceleration_ff_error velocity_gain_error weight_imbalance viscous",
      .separate =
          R"(the force at constant acceleration is off, which acceleration_ff_error leaves alone; scales all
forces by the same factor)",
      .showing = Showing::circle_feeds};

  double deviation = 0;  ///< d

  static TorqueConstantError nominal(bool) { return {-0.2}; }
  bool null() const { return deviation == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("deviation_percent", p.deviation, Unit{"percent", 0.01}, Range{-90, 100},
          "of the true torque constant from the declared one");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>&) const {
    signal.force *= 1 + deviation;
  }
};

}  // namespace vcnc
