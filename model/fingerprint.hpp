// What a result depends on, as bytes: two machines with the same fingerprint of a stage behave the
// same there, to the last bit.
//
// A visitor of fields() (model/fields.hpp) that appends every value it is shown.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/axes.hpp"
#include "model/effects/effect.hpp"
#include "model/fields.hpp"

namespace vcnc {

class Fingerprint {
 public:
  const std::string& bytes() const { return bytes_; }

  template <class T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  void operator()(std::string_view, const double& v, Unit, Range, const char*) { add(v); }
  void operator()(std::string_view, const Vec3& v, Unit, Range, const char*) {
    for (const double x : v) add(x);
  }
  void operator()(std::string_view, const std::vector<double>& v, Unit, Range, const char*) {
    add(v.size());
    for (const double x : v) add(x);
  }
  void operator()(std::string_view, const std::vector<Vec3>& v, Unit, Range, const char*) {
    add(v.size());
    for (const Vec3& p : v)
      for (const double x : p) add(x);
  }
  void operator()(std::string_view, const int& v, Range, const char*) { add(v); }
  void operator()(std::string_view, const bool& v, const char*) { add(v); }
  void operator()(std::string_view, const std::string&, const char*) {}  // for people
  template <class Enum>
  void choice(std::string_view, const Enum& v, std::initializer_list<std::pair<const char*, Enum>>,
              const char*) {
    add(v);
  }
  template <class T, class... Args>
  void group(std::string_view, const T& v, const char*, Args... args) {
    T::fields(v, *this, args...);
  }
  template <class T, class... Args>
  void effect(std::string_view, const T& v, const char*, Args... args) {
    T::fields(v, *this, args...);
  }
  template <class T>
  void list(std::string_view, const std::vector<T>& v, const char*) {
    add(v.size());
    for (const T& element : v) T::fields(element, *this);
  }
  template <class F>
  void section(std::string_view, const char*, F&& f) {
    f(*this);
  }

 private:
  std::string bytes_;
};

/// One effect at its axis, or kAxisCount.
template <class Effect>
void add_effect(Fingerprint& print, const Effect& effect, std::size_t axis) {
  for (const char c : Effect::text.name) print.add(c);
  print.add(axis);
  if constexpr (Effect::place == Place::axis)
    Effect::fields(effect, print, is_rotary(axis));
  else
    Effect::fields(effect, print);
}

}  // namespace vcnc
