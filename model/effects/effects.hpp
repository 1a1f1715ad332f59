// The effects of one machine: every effect of the list at every place it fits, null by default.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "model/axes.hpp"
#include "model/effects/law.hpp"
#include "model/effects/list.hpp"
#include "model/fields.hpp"

namespace vcnc {

/// Room for one effect; none for one that is kept elsewhere.
template <class Effect, bool kept>
struct Slot {
  Effect effect;
};
template <class Effect>
struct Slot<Effect, false> {};

/// The effects of the list that belong to an axis, or those that do not, each found by its type.
/// (Bases instead of a std::tuple, which costs a second in each file that includes it.)
template <bool axis, class List = AllEffects>
class Slots;
template <bool axis, class... Effect>
class Slots<axis, EffectList<Effect...>> : Slot<Effect, of_axis(Effect::place) == axis>... {
 public:
  template <class Wanted>
  Wanted& get() {
    return static_cast<Slot<Wanted, true>&>(*this).effect;
  }
  template <class Wanted>
  const Wanted& get() const {
    return static_cast<const Slot<Wanted, true>&>(*this).effect;
  }
};

/// Every effect that may sit on an axis; those that do not fit the axis stay null.
class AxisEffects {
 public:
  template <class Effect>
  Effect& get() {
    return all_.get<Effect>();
  }
  template <class Effect>
  const Effect& get() const {
    return all_.get<Effect>();
  }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
      constexpr Place place = Effect::place;
      if constexpr (of_axis(place)) {
        auto& effect = p.template get<Effect>();
        if (!fits(place, rotary)) return;
        if constexpr (place == Place::axis)
          visit.effect(Effect::text.name, effect, Effect::text.brief.data(), rotary);
        else
          visit.effect(Effect::text.name, effect, Effect::text.brief.data());
      }
    });
  }

 private:
  Slots<true> all_;
};

/// A declared parameter whose true value is another one: the machine is not as its file says.
struct Deviation {
  std::string key;  ///< "axes.Y.load_kg": any number of the machine outside [effects]
  double value = std::numeric_limits<double>::quiet_NaN();  ///< in the unit of the key

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    visit("key", p.key, "a number of this file outside [effects], e.g. axes.Y.load_kg");
    visit("value", p.value, unit::none, Range{}, "its true value, in the unit of the key");
  }
};

class Effects {
 public:
  PerAxis<AxisEffects> axis;
  std::vector<Law> laws;              ///< any further law, without an effect of its own
  std::vector<Deviation> deviations;  ///< see actual() in model/machine.hpp
  /// Tests: also simulate the effects that are null, which must not change a bit.
  bool simulate_null = false;

  template <class Effect>
  Effect& get() {
    return machine_.get<Effect>();
  }
  template <class Effect>
  const Effect& get() const {
    return machine_.get<Effect>();
  }

  /// Copies the effects of one place of the machine.
  void take(const Effects& from, Place place) {
    for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
      if constexpr (!of_axis(Effect::place))
        if (Effect::place == place) get<Effect>() = from.get<Effect>();
    });
  }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit) {
    for (std::size_t i = 0; i < kAxisCount; ++i)
      visit.group(kAxisNames[i], p.axis[i], "effects of one axis", is_rotary(i));
    for (const Place place : {Place::geometry, Place::probe, Place::setup, Place::nc})
      visit.section(key_of(place), "effects", [&](auto& table) {
        for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
          if constexpr (!of_axis(Effect::place))
            if (Effect::place == place)
              table.effect(Effect::text.name, p.template get<Effect>(), Effect::text.brief.data());
        });
      });
    visit.list("law", p.laws, "any law of the machine's state at one of six points of an axis");
    visit.list("deviation", p.deviations, "a declared parameter whose true value is another one");
  }

 private:
  Slots<false> machine_;
};

}  // namespace vcnc
