#pragma once

#include "model/effects/effect.hpp"
#include "model/effects/ports.hpp"
#include "model/fields.hpp"

namespace vcnc {

struct LoadEncoderLatency {
  using Port = EncoderPort;
  static constexpr Place place = Place::axis;
  static constexpr EffectText text{
      .name = "load_encoder_latency",
      .title = "Latency of the load's measuring system",
      .family = Family::servo,
      .brief = "the scale or ring encoder on the load is read later than the motor's encoder",
      .equation = R"(q_load measured(t) = q(t - t_d) = q - t_d q' + t_d^2 q''/2
t_d: latency [s], below zero: the motor's encoder is the later one; q: position of the load)",
      .validity =
          R"(Constant; next term t_d^3 q'''/6, so for motion of frequencies well below 1/t_d. The motor's
measuring system is right.)",
      .source =
          R"(own derivation; Heidenhain, EnDat 2.2 Technical Information, calculation time of the position
value: each encoder and its interface have their own)",
      .signature =
          R"(The two measuring systems are off by t_d v. With the loop closed on the motor nothing moves; with
the loop closed on the load the axis is ahead by t_d v and its position loop has a dead time.)",
      .confusable = "command_delay velocity_ff_error viscous sample_latency windup backlash",
      .separate =
          R"(command_delay and sample_latency are not seen between the two measuring systems; a windup twists
with the force, not with the speed; a backlash is as wide at every feed)",
      .showing = Showing::circle_feeds};

  double latency = 0;  ///< t_d [s]

  static LoadEncoderLatency nominal(bool) { return {100e-6}; }
  bool null() const { return latency == 0; }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool) {
    visit("latency_us", p.latency, unit::us, Range{-5000, 5000},
          "of the load's against the motor's");
  }

  template <class T>
  void step(Port::Signal<T>& signal, const Port::Context<T>& context) const {
    if (!context.of_load) return;
    signal.position -= latency * (context.velocity - 0.5 * latency * context.acceleration);
  }
};

}  // namespace vcnc
