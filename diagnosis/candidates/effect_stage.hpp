// Which part of a replica an effect concerns, by the port it acts at, and which effects a replica
// cannot show.
#pragma once

#include <string_view>
#include <type_traits>

#include "model/effects/effects.hpp"

namespace vcnc {

enum class EffectStage {
  plan,     ///< before the command: not seen by a replica, which is driven by it
  drive,    ///< one axis from its command to its true position
  contact,  ///< from the true axes to the deflection of the ball
  sensing   ///< from the deflection to the reading
};

template <class Port>
constexpr EffectStage stage_of() {
  constexpr auto any = []<class... P>(std::type_identity<P>...) {
    return (std::is_same_v<Port, P> || ...);
  };
  if (any(std::type_identity<PlanPort>(), std::type_identity<InterpolationPort>()))
    return EffectStage::plan;
  if (any(std::type_identity<PosePort>(), std::type_identity<TouchPort>()))
    return EffectStage::contact;
  if (any(std::type_identity<DeflectionPort>(), std::type_identity<AnaloguePort>(),
          std::type_identity<ReadingPort>()))
    return EffectStage::sensing;
  return EffectStage::drive;
}

/// Effects that are nothing but chance: absent from a replica. So is what an encoder rounds off: it
/// depends on positions to a fraction of its step, and hides what a number changes by less.
template <class Effect>
constexpr bool is_chance() {
  return std::is_same_v<Effect, BusLoss> || std::is_same_v<Effect, BusJitter> ||
         std::is_same_v<Effect, SampleJitter> || std::is_same_v<Effect, AdcNoise> ||
         std::is_same_v<Effect, DroppedSamples> || std::is_same_v<Effect, EncoderQuantisation>;
}

/// Why no hypothesis of a diagnosis is made of an effect; empty: one is.
template <class Effect>
constexpr std::string_view no_hypothesis() {
  if (is_chance<Effect>())
    return "nothing but chance: the audit of the noise finds it, no prediction can";
  if (stage_of<typename Effect::Port>() == EffectStage::plan)
    return "shows between program and command; a diagnosis begins at the command";
  return "";
}

/// What sets the loops and the set-points of a drive.
template <class Effect>
constexpr bool is_of_loops() {
  return std::is_same_v<typename Effect::Port, ServoPort> ||
         std::is_same_v<typename Effect::Port, SetpointPort>;
}

/// What a probe makes of its touching and of its signals, and no other device that reads.
template <class Effect>
constexpr bool is_of_touch() {
  using Port = typename Effect::Port;
  return (std::is_same_v<Port, TouchPort> && !std::is_same_v<Effect, TipRadius>) ||
         std::is_same_v<Port, AnaloguePort> ||
         (std::is_same_v<Port, DeflectionPort> && !std::is_same_v<Effect, SampleLatency> &&
          !std::is_same_v<Effect, SampleJitter> && !std::is_same_v<Effect, ClockDrift>);
}

/// Calls f(effect, axis) for every effect of a machine; axis kAxisCount for those of no axis.
template <class SomeEffects, class F>
void for_each_effect_of(SomeEffects& effects, F&& f) {
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if constexpr (of_axis(Effect::place)) {
      for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (fits(Effect::place, is_rotary(axis)))
          f(effects.axis[axis].template get<Effect>(), axis);
    } else {
      f(effects.template get<Effect>(), kAxisCount);
    }
  });
}

}  // namespace vcnc
