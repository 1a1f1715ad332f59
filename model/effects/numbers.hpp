// The parameters of one effect as a list: for reference pages and contract tests.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "model/axes.hpp"
#include "model/effects/effect.hpp"
#include "model/fields.hpp"

namespace vcnc {

/// One parameter of an effect: a number, a vector of three, or a whole number.
struct EffectNumber {
  std::string key;  ///< without place and name: "gap_um"
  Unit unit;
  Range range;  ///< in the unit of the key
  std::string doc;
  std::variant<double*, Vec3*, int*> value;

  int size() const { return std::holds_alternative<Vec3*>(value) ? 3 : 1; }
  bool whole() const { return std::holds_alternative<int*>(value); }
  /// SI; of a whole number the number.
  double get(int i = 0) const {
    if (const auto* number = std::get_if<double*>(&value)) return **number;
    if (const auto* vector = std::get_if<Vec3*>(&value)) return (**vector)[i];
    return *std::get<int*>(value);
  }
  /// In the unit of the key.
  void set(int i, double in_unit) const {
    if (const auto* number = std::get_if<double*>(&value))
      **number = in_unit * unit.to_si;
    else if (const auto* vector = std::get_if<Vec3*>(&value))
      (**vector)[i] = in_unit * unit.to_si;
    else
      *std::get<int*>(value) = static_cast<int>(in_unit);
  }
};

/// A visitor of fields() that keeps every number.
struct EffectNumbers {
  void operator()(std::string_view key, double& v, Unit u, Range r, const char* doc) {
    all.push_back({std::string(key), u, r, doc, &v});
  }
  void operator()(std::string_view key, Vec3& v, Unit u, Range r, const char* doc) {
    all.push_back({std::string(key), u, r, doc, &v});
  }
  void operator()(std::string_view key, int& v, Range r, const char* doc) {
    all.push_back({std::string(key), unit::none, r, doc, &v});
  }
  std::vector<EffectNumber> all;
};

/// The parameters of `effect`, which must outlive the result and not be moved.
template <class Effect>
std::vector<EffectNumber> numbers_of(Effect& effect, bool rotary) {
  EffectNumbers numbers;
  if constexpr (Effect::place == Place::axis)
    Effect::fields(effect, numbers, rotary);
  else
    Effect::fields(effect, numbers);
  return numbers.all;
}

template <class Effect>
Effect nominal_of([[maybe_unused]] bool rotary) {
  if constexpr (Effect::place == Place::axis)
    return Effect::nominal(rotary);
  else
    return Effect::nominal();
}

/// A place at which an effect may be: the first part of its key.
struct EffectPlace {
  std::string_view name;  ///< "X" ... "C", "geometry", ...
  bool rotary = false;
  std::size_t axis = kAxisCount;  ///< kAxisCount: of the machine
};

inline std::vector<EffectPlace> places_of(Place place) {
  if (!of_axis(place)) return {{key_of(place)}};
  std::vector<EffectPlace> places;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (fits(place, is_rotary(i))) places.push_back({kAxisNames[i], is_rotary(i), i});
  return places;
}

}  // namespace vcnc
