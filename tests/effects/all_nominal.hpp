// A machine with every effect at its typical size at every place it fits.
#pragma once

#include "model/effects/numbers.hpp"
#include "model/machine.hpp"

namespace vcnc {

inline Machine all_nominal() {
  Machine machine;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    for (const EffectPlace& place : places_of(Effect::place)) {
      if constexpr (of_axis(Effect::place))
        machine.effects.axis[place.axis].template get<Effect>() = nominal_of<Effect>(place.rotary);
      else
        machine.effects.get<Effect>() = nominal_of<Effect>(false);
    }
  });
  return machine;
}

}  // namespace vcnc
