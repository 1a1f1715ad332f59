// Every effect of the list keeps the contract (tests/effects/contract.hpp) and is reachable by its
// keys, with its bounds, from a machine file and back.
#include "tests/effects/contract.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "configs/config.hpp"
#include "configs/toml_writer.hpp"
#include "model/parameters.hpp"
#include "tests/effects/all_nominal.hpp"

namespace vcnc::contract_test {
namespace {

/// Calls f(std::type_identity<Effect>()) for every effect; failures name it.
template <class F>
void for_every_effect(F&& f) {
  for_each_effect([&]<class Effect>(std::type_identity<Effect> effect) {
    SCOPED_TRACE(std::string(Effect::text.name));
    f(effect);
  });
}

std::set<std::string> names() {
  std::set<std::string> all;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    all.insert(std::string(Effect::text.name));
  });
  return all;
}

// ---------------------------------------------------------------------------- each on its own

TEST(EffectContract, TextIsComplete) {
  const std::set<std::string> known = names();
  for_every_effect([&]<class Effect>(std::type_identity<Effect>) { check_text<Effect>(known); });
}

TEST(EffectContract, NamesAreUniqueAndThoseOfFileAndType) {
  std::set<std::string> seen;
  for_every_effect([&]<class Effect>(std::type_identity<Effect>) {
    const std::string name(Effect::text.name);
    EXPECT_TRUE(seen.insert(name).second);
    std::string type;
    for (std::size_t i = 0; i < name.size(); ++i) {
      const bool first = i == 0 || name[i - 1] == '_';
      if (name[i] != '_') type += first ? static_cast<char>(name[i] - 'a' + 'A') : name[i];
    }
    std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/model/effects/" + name + ".hpp");
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    EXPECT_NE(text.find(fmt::format("\nstruct {} {{", type)), text.npos)
        << type << " in " << name << ".hpp";
    static_assert(AllPorts::contains<typename Effect::Port>);
  });
}

TEST(EffectContract, NumbersHaveUnitsAndBounds) {
  for_every_effect([]<class Effect>(std::type_identity<Effect>) { check_numbers<Effect>(); });
}

TEST(EffectContract, NullChangesNoBit) {
  for_every_effect([]<class Effect>(std::type_identity<Effect>) { check_null<Effect>(); });
}

TEST(EffectContract, SignalsStayBounded) {
  for_every_effect([]<class Effect>(std::type_identity<Effect>) { check_bounded<Effect>(); });
}

TEST(EffectContract, WhatIsCalledDissipativeIs) {
  int claimed = 0;
  for_every_effect([&]<class Effect>(std::type_identity<Effect>) {
    if constexpr (requires { Effect::dissipative; }) ++claimed;
    check_dissipative<Effect>();
  });
  EXPECT_GE(claimed, 3);
}

// -------------------------------------------------------------------------------- in the file

std::string error_of(const std::string& toml) {
  try {
    parse_machine(toml, "m");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

/// A machine file with one effect at one place, every number at its nominal value but one.
template <class Effect>
std::string file_with(const EffectPlace& place, std::size_t which, int component, double in_unit) {
  Effect effect = nominal_of<Effect>(place.rotary);
  const std::vector<EffectNumber> numbers = numbers_of(effect, place.rotary);
  std::string text = fmt::format("[effects.{}.{}]\n", place.name, Effect::text.name);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const EffectNumber& n = numbers[i];
    std::vector<std::string> values;
    for (int c = 0; c < n.size(); ++c)
      values.push_back(i == which && c == component ? fmt::format("{}", in_unit)
                       : n.whole()                  ? fmt::format("{:.0f}", n.get())
                                                    : toml_number(n.get(c), n.unit));
    text += n.size() == 1 ? fmt::format("{} = {}\n", n.key, values[0])
                          : fmt::format("{} = [{}]\n", n.key, fmt::join(values, ", "));
  }
  return text;
}

/// The effect at a place of a machine.
template <class Effect>
Effect& at(Effects& effects, const EffectPlace& place) {
  if constexpr (of_axis(Effect::place))
    return effects.axis[place.axis].template get<Effect>();
  else
    return effects.get<Effect>();
}

template <class Effect>
void expect_bounds_enforced(const EffectPlace& place, std::size_t i, int component) {
  Effect any = nominal_of<Effect>(place.rotary);
  const EffectNumber n = numbers_of(any, place.rotary)[i];
  const std::string key = fmt::format("effects.{}.{}.{}", place.name, Effect::text.name, n.key);
  SCOPED_TRACE(key);
  for (const double bound : {n.range.min, n.range.max}) {
    const bool upper = bound == n.range.max;
    const double outwards = upper ? HUGE_VAL : -HUGE_VAL;
    const double beyond = n.whole() ? bound + (upper ? 1 : -1) : std::nextafter(bound, outwards);
    const std::string error = error_of(file_with<Effect>(place, i, component, beyond));
    EXPECT_NE(error.find(key + ": "), error.npos) << beyond << ": " << error;
    EXPECT_NE(error.find("is out of range, allowed"), error.npos) << beyond << ": " << error;
    const std::string text = file_with<Effect>(place, i, component, bound);
    EXPECT_EQ(error_of(text), "");
    Machine machine = parse_machine(text, "m");
    const double value =
        numbers_of(at<Effect>(machine.effects, place), place.rotary)[i].get(component);
    EXPECT_EQ(value, bound * (n.whole() ? 1 : n.unit.to_si));
  }
}

TEST(EffectFile, BoundsAreEnforcedForEveryNumberAtEveryPlace) {
  for_every_effect([]<class Effect>(std::type_identity<Effect>) {
    for (const EffectPlace& place : places_of(Effect::place)) {
      Effect any = nominal_of<Effect>(place.rotary);
      const std::vector<EffectNumber> numbers = numbers_of(any, place.rotary);
      for (std::size_t i = 0; i < numbers.size(); ++i)
        expect_bounds_enforced<Effect>(place, i, numbers[i].size() - 1);
    }
  });
}

TEST(EffectFile, AnEffectIsRefusedWhereItDoesNotFit) {
  for_every_effect([]<class Effect>(std::type_identity<Effect>) {
    for (const std::string place : {"X", "A", "geometry", "probe", "setup", "nc"}) {
      bool fits_there = false;
      for (const EffectPlace& p : places_of(Effect::place)) fits_there |= p.name == place;
      const std::string error =
          error_of(fmt::format("[effects.{}.{}]\n", place, Effect::text.name));
      if (fits_there)
        EXPECT_EQ(error, "") << place;
      else
        EXPECT_NE(error.find("unknown key"), error.npos) << place << ": " << error;
    }
  });
}

/// A number that came from a file is written as what reads back as the same bits; one given in SI
/// by the program (a default, a nominal) may lie between two that a file can hold.
TEST(EffectFile, EverythingAtNominalSurvivesTheRoundTrip) {
  Machine given = all_nominal();
  Machine once = parse_machine(to_toml(given), "once"),
          twice = parse_machine(to_toml(once), "twice");
  EXPECT_EQ(to_toml(twice), to_toml(once));
  const std::vector<Parameter> a = parameters(given), b = parameters(once), c = parameters(twice);
  ASSERT_TRUE(a.size() == b.size() && b.size() == c.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(*b[i].value, *c[i].value) << b[i].key;
    EXPECT_NEAR(*a[i].value, *b[i].value, 4e-16 * std::abs(*a[i].value)) << a[i].key;
  }
  for_every_effect([&]<class Effect>(std::type_identity<Effect>) {
    for (const EffectPlace& place : places_of(Effect::place)) {
      const auto x = numbers_of(at<Effect>(given.effects, place), place.rotary),
                 y = numbers_of(at<Effect>(twice.effects, place), place.rotary);
      for (std::size_t i = 0; i < x.size(); ++i)
        for (int k = 0; k < x[i].size(); ++k)
          EXPECT_NEAR(x[i].get(k), y[i].get(k), 4e-16 * std::abs(x[i].get(k))) << x[i].key;
      EXPECT_FALSE(at<Effect>(twice.effects, place).null());
    }
  });
}

TEST(EffectFile, DeclaredStripsEverything) {
  Machine full = all_nominal();
  full.effects.laws.emplace_back();
  full.effects.deviations.push_back({"axes.Y.load_kg", 550});
  const Machine plain = declared(full);
  EXPECT_EQ(to_toml(plain), to_toml(Machine()));
  EXPECT_EQ(to_toml(plain).find("effects"), std::string::npos);
  EXPECT_TRUE(plain.effects.laws.empty() && plain.effects.deviations.empty());
}

TEST(EffectFile, ParametersListEachKeyAsInTheFile) {
  Machine machine = all_nominal();
  const std::string file = to_toml(machine);
  std::map<std::string, Parameter> listed;
  std::size_t of_effects = 0, expected = 0;
  for (const Parameter& p : parameters(machine)) {
    EXPECT_TRUE(listed.emplace(p.key, p).second) << p.key << " twice";
    of_effects += p.key.starts_with("effects.");
  }
  for_every_effect([&]<class Effect>(std::type_identity<Effect>) {
    for (const EffectPlace& place : places_of(Effect::place)) {
      const std::string table = fmt::format("effects.{}.{}", place.name, Effect::text.name);
      const std::size_t begin = file.find(fmt::format("\n[{}]\n", table));
      ASSERT_NE(begin, file.npos) << table;
      const std::string section = file.substr(begin, file.find("\n[", begin + 2) - begin);
      for (const EffectNumber& n : numbers_of(at<Effect>(machine.effects, place), place.rotary)) {
        EXPECT_NE(section.find(fmt::format("\n{} = ", n.key)), section.npos)
            << n.key << " in" << section;
        if (n.whole()) continue;  // not a number to perturb
        for (int c = 0; c < n.size(); ++c) {
          std::string key = table + "." + n.key;
          if (n.size() > 1) key += fmt::format(".{}", "xyz"[c]);
          ++expected;
          ASSERT_TRUE(listed.contains(key)) << key;
          const Parameter& p = listed.at(key);
          EXPECT_EQ(*p.value, n.get(c)) << key;
          EXPECT_EQ(p.range.min, n.range.min) << key;
          EXPECT_EQ(p.range.max, n.range.max) << key;
          EXPECT_EQ(p.unit.to_si, n.unit.to_si) << key;
        }
      }
    }
  });
  EXPECT_EQ(of_effects, expected);
}

TEST(EffectFile, SetParameterWorksAndRefuses) {
  Machine machine;
  set_parameter(machine, "effects.X.backlash.gap_um", 12);
  EXPECT_EQ(machine.effects.axis[kX].get<Backlash>().gap, 12 * 1e-6);
  set_parameter(machine, "effects.probe.signal_offset.sine_percent.y", -3);
  EXPECT_EQ(machine.effects.get<SignalOffset>().sine, Vec3(0, -3 * 0.01, 0));
  const auto refusal = [&](const char* key, double value) -> std::string {
    try {
      set_parameter(machine, key, value);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("effects.X.backlash.gap_um", 2001),
            "effects.X.backlash.gap_um: 2001 is out of range, allowed 0 .. 2000 um");
  EXPECT_EQ(refusal("effects.X.backlash.gap_um", std::nan("")),
            "effects.X.backlash.gap_um: nan is out of range, allowed 0 .. 2000 um");
  EXPECT_EQ(refusal("effects.X.backlash.gap_arcsec", 1),
            "effects.X.backlash.gap_arcsec: is not a number of a machine file");
  EXPECT_EQ(machine.effects.axis[kX].get<Backlash>().gap, 12 * 1e-6);
}

// ------------------------------------------------------------------------------ injection

TEST(EffectInjection, AnEffectOnTheCommandLineIsItsKeyInTheFile) {
  const std::string file = std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml";
  const Machine machine = load_machine(file, {},
                                       {"Y.backlash.gap_um=12", "effects.A.coulomb.level_Nm=4",
                                        "probe.signal_offset.cosine_percent=[1, 2, 3]"});
  EXPECT_EQ(machine.effects.axis[kY].get<Backlash>().gap, 12 * 1e-6);
  EXPECT_EQ(machine.effects.axis[kA].get<Coulomb>().level, 4);
  EXPECT_EQ(machine.effects.get<SignalOffset>().cosine, Vec3(1 * 0.01, 2 * 0.01, 3 * 0.01));
  EXPECT_EQ(to_toml(declared(machine)), to_toml(declared(load_machine(file))));
}

}  // namespace
}  // namespace vcnc::contract_test
