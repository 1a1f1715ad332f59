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

template <Place place>
struct IsOfAxis : std::bool_constant<of_axis(place)> {};
template <Place place>
struct IsOfMachine : std::bool_constant<!of_axis(place)> {};

/// Every effect that may sit on an axis; those that do not fit the axis stay null.
class AxisEffects {
 public:
  template <class Effect>
  Effect& get() {
    return std::get<Effect>(all_);
  }
  template <class Effect>
  const Effect& get() const {
    return std::get<Effect>(all_);
  }

  template <class Self, class Visit>
  static void fields(Self& p, Visit& visit, bool rotary) {
    std::apply([&](auto&... effect) { (field(effect, visit, rotary), ...); }, p.all_);
  }

 private:
  template <class Effect, class Visit>
  static void field(Effect& effect, Visit& visit, bool rotary) {
    constexpr Place place = Effect::place;
    if (!fits(place, rotary)) return;
    if constexpr (place == Place::axis)
      visit.effect(Effect::text.name, effect, Effect::text.brief.data(), rotary);
    else
      visit.effect(Effect::text.name, effect, Effect::text.brief.data());
  }

  decltype(select_effects<IsOfAxis>(AllEffects())) all_;
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
    return std::get<Effect>(machine_);
  }
  template <class Effect>
  const Effect& get() const {
    return std::get<Effect>(machine_);
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
        std::apply([&](auto&... effect) { (field(effect, table, place), ...); }, p.machine_);
      });
    visit.list("law", p.laws, "any law of the machine's state at one of six points of an axis");
    visit.list("deviation", p.deviations, "a declared parameter whose true value is another one");
  }

 private:
  template <class Effect, class Visit>
  static void field(Effect& effect, Visit& visit, Place place) {
    if (Effect::place == place) visit.effect(Effect::text.name, effect, Effect::text.brief.data());
  }

  decltype(select_effects<IsOfMachine>(AllEffects())) machine_;
};

}  // namespace vcnc
