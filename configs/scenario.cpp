#include "configs/scenario.hpp"

#include <fmt/format.h>

#include "configs/config.hpp"
#include "configs/toml_writer.hpp"

namespace vcnc {

namespace {

/// The name of one choice, found by showing the fields to this visitor.
class NameOf {
 public:
  explicit NameOf(std::string_view key) : key_(key) {}
  template <class... Args>
  void operator()(std::string_view, Args&&...) {}
  template <class Enum>
  void choice(std::string_view key, const Enum& v,
              std::initializer_list<std::pair<const char*, Enum>> names, const char*) {
    if (key != key_) return;
    for (const auto& [name, value] : names)
      if (value == v) name_ = name;
  }
  template <class T>
  void effect(std::string_view, const T&, const char*) {}
  const char* name() const { return name_; }

 private:
  std::string_view key_;
  const char* name_ = "?";
};

const char* name_of(const Scenario& scenario, std::string_view key) {
  NameOf finder(key);
  Scenario::fields(scenario, finder);
  return finder.name();
}

[[noreturn]] void fail(const std::string& name, const std::string& reason) {
  throw ConfigError(name + ": " + reason);
}

}  // namespace

std::string to_toml(const Scenario& scenario) {
  TomlWriter w;
  Scenario::fields(scenario, w);
  return w.text();
}

const char* to_string(Scenario::Kind kind) {
  Scenario s;
  s.kind = kind;
  return name_of(s, "kind");
}

const char* to_string(Scenario::Expect expect) {
  Scenario s;
  s.expect = expect;
  return name_of(s, "expect");
}

void check_scenario(const Scenario& s, const std::string& name) {
  using Kind = Scenario::Kind;
  if (s.machine.empty()) fail(name, "machine: is missing; it names the machine file");
  const bool own = s.kind == Kind::program;
  if (own && s.program.empty() == s.gcode.empty())
    fail(name, "kind program needs either program (a G-code file) or gcode (the program itself)");
  if (!own && !(s.program.empty() && s.gcode.empty()))
    fail(name, fmt::format("program, gcode: are for kind \"program\", not for \"{}\"",
                           to_string(s.kind)));
  if (!own && s.has_piece())
    fail(name, "piece: is for kind \"program\"; the other kinds choose theirs by target");
  if (s.expect == Scenario::Expect::fault_safe && s.faults.empty())
    fail(name, "expect: \"fault_safe\" needs faults");
  if (s.kind == Kind::scan && !(s.predeflection > 0))
    fail(name, "predeflection_mm: kind \"scan\" needs it, above 0");
  if (!own && s.kind != Kind::scan && s.predeflection >= s.depth)
    fail(name, fmt::format("predeflection_mm: {:g} must be below depth_mm, {:g}",
                           s.predeflection * 1e3, s.depth * 1e3));
  if (s.kind == Kind::wrong_length && std::abs(s.axial_angle - kPi / 2) > 1e-9)
    fail(name,
         "axial_deg: kind \"wrong_length\" needs 90, a stylus that is too long touches along "
         "the tool");
  if (s.kind == Kind::wrong_length && s.turn != 0)
    fail(name, "turn_deg: kind \"wrong_length\" needs 0");
  if (s.target != Scenario::Target::plane && s.incidence != 0)
    fail(name, "incidence_deg: is for target \"plane\"");
}

}  // namespace vcnc
