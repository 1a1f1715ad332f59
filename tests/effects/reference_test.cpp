// What `vcnc effects` prints: complete, readable, and true.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "configs/config.hpp"
#include "configs/effect_reference.hpp"
#include "model/effects/numbers.hpp"
#include "model/effects/port_list.hpp"

namespace vcnc::reference_test {
namespace {

const std::string kTrunnion = std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml";

std::string file(const std::string& path) {
  std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/" + path);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::size_t longest_line(const std::string& text) {
  std::size_t longest = 0, column = 0;
  for (const char c : text) {
    column = c == '\n' ? 0 : column + 1;
    longest = std::max(longest, column);
  }
  return longest;
}

/// The page in docs/ is the generated one. `vcnc effects --markdown` prints it.
TEST(EffectReference, InDocsIsCurrent) { EXPECT_EQ(file("docs/effects.md"), effect_markdown()); }

TEST(EffectReference, TableHasEveryEffectWithItsBoundsIn100Columns) {
  const std::string table = effect_table();
  EXPECT_LE(longest_line(table), 100u);
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    EXPECT_NE(table.find(fmt::format("\n  {} ", Effect::text.name)), table.npos)
        << Effect::text.name;
    for (const EffectPlace& place : places_of(Effect::place)) {
      Effect effect;
      for (const EffectNumber& n : numbers_of(effect, place.rotary))
        EXPECT_NE(table.find(n.key + " "), table.npos) << n.key;
    }
  });
  EXPECT_NE(table.find("gap_um 0 .. 2000"), table.npos);
}

TEST(EffectReference, PageTellsEverything) {
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    const EffectText& t = Effect::text;
    const std::string page = effect_page(t.name);
    SCOPED_TRACE(page);
    std::string flat = page;  // without line breaks and indents
    for (std::size_t at; (at = flat.find_first_of("\n")) != flat.npos;) flat[at] = ' ';
    const auto holds = [&](std::string_view text) {
      const auto words = [](std::string_view s) {
        std::string all;
        for (const char c : s)
          if (c != ' ' && c != '\n') all += c;
        return all;
      };
      return words(flat).find(words(text)) != std::string::npos;
    };
    for (const std::string_view part : {t.title, t.brief, t.equation, t.validity, t.source,
                                        t.signature, t.confusable, t.separate})
      EXPECT_TRUE(holds(part)) << part;
    for (const EffectPlace& place : places_of(Effect::place)) {
      Effect effect;
      for (const EffectNumber& n : numbers_of(effect, place.rotary)) {
        EXPECT_TRUE(holds("." + n.key)) << n.key;
        EXPECT_TRUE(holds(n.doc)) << n.doc;
      }
    }
    const std::size_t try_it = page.find("\nTry it\n");
    ASSERT_NE(try_it, page.npos);
    EXPECT_LE(longest_line(page.substr(0, try_it)), 102u);  // 100 columns of text behind two blanks
    EXPECT_NE(page.find(effect_injection(t.name), try_it), page.npos);
  });
}

/// The options as a shell passes them on.
std::vector<std::string> injections_of(const std::string& options) {
  std::vector<std::string> all;
  const std::string flag = "--inject ";
  for (std::size_t at = 0; (at = options.find(flag, at)) != options.npos;) {
    at += flag.size();
    const bool quoted = options[at] == '\'';
    const std::size_t begin = at + quoted;
    at = std::min(options.find(quoted ? '\'' : ' ', begin), options.size());
    all.push_back(options.substr(begin, at - begin));
  }
  return all;
}

TEST(EffectReference, TheLineToPasteGivesTheTypicalEffect) {
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    SCOPED_TRACE(effect_injection(Effect::text.name));
    const Machine machine =
        load_machine(kTrunnion, {}, injections_of(effect_injection(Effect::text.name)));
    const EffectPlace place = places_of(Effect::place).front();
    const Effect* pasted;
    if constexpr (of_axis(Effect::place))
      pasted = &machine.effects.axis[place.axis].template get<Effect>();
    else
      pasted = &machine.effects.get<Effect>();
    Effect is = *pasted, nominal = nominal_of<Effect>(place.rotary);
    EXPECT_FALSE(is.null());
    const auto a = numbers_of(is, place.rotary), b = numbers_of(nominal, place.rotary);
    for (std::size_t i = 0; i < a.size(); ++i)
      for (int c = 0; c < a[i].size(); ++c)
        EXPECT_NEAR(a[i].get(c), b[i].get(c), 1e-9 * std::abs(b[i].get(c))) << a[i].key;
  });
}

TEST(EffectReference, UnknownNamesAreRefusedWithASuggestion) {
  const auto refusal = [](const char* name) -> std::string {
    try {
      effect_page(name);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("backlsh"),
            "vcnc effects show backlsh: no such effect; did you mean backlash?");
  EXPECT_EQ(refusal("Backlash"),
            "vcnc effects show Backlash: no such effect; did you mean backlash?");
  EXPECT_EQ(refusal("quadrature"),
            "vcnc effects show quadrature: no such effect; vcnc effects lists all");
}

TEST(EffectReference, JsonHoldsTheSame) {
  const nlohmann::json json = nlohmann::json::parse(effect_json());
  std::size_t i = 0;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    const nlohmann::json& e = json.at("effects").at(i++);
    EXPECT_EQ(e.at("name"), Effect::text.name);
    EXPECT_EQ(e.at("equation"), Effect::text.equation);
    EXPECT_EQ(e.at("signature"), Effect::text.signature);
    EXPECT_EQ(e.at("family"), name_of(Effect::text.family));
    EXPECT_EQ(e.at("port"), Effect::Port::name);
    const std::vector<EffectPlace> places = places_of(Effect::place);
    ASSERT_EQ(e.at("places").size(), places.size());
    for (std::size_t p = 0; p < places.size(); ++p) {
      EXPECT_EQ(e.at("places").at(p).at("place"), places[p].name);
      Effect nominal = nominal_of<Effect>(places[p].rotary);
      const std::vector<EffectNumber> numbers = numbers_of(nominal, places[p].rotary);
      const nlohmann::json& rows = e.at("places").at(p).at("parameters");
      ASSERT_EQ(rows.size(), numbers.size());
      for (std::size_t k = 0; k < numbers.size(); ++k) {
        const EffectNumber& n = numbers[k];
        EXPECT_EQ(rows.at(k).at("key"),
                  fmt::format("effects.{}.{}.{}", places[p].name, Effect::text.name, n.key));
        EXPECT_EQ(rows.at(k).at("min"), n.range.min);
        EXPECT_EQ(rows.at(k).at("max"), n.range.max);
        EXPECT_EQ(rows.at(k).at("to_si"), n.unit.to_si);
        const nlohmann::json& value = rows.at(k).at("nominal");
        for (int c = 0; c < n.size(); ++c) {
          const double typical = n.size() == 1
                                     ? value.get<double>()
                                     : value.at(static_cast<std::size_t>(c)).get<double>();
          EXPECT_NEAR(typical * n.unit.to_si, n.get(c), 1e-9 * std::abs(n.get(c))) << n.key;
        }
      }
    }
  });
  EXPECT_EQ(json.at("effects").size(), i);
  // The order of application at a port is that of the list.
  for_each_port([&, p = std::size_t{0}]<class Port>(std::type_identity<Port>) mutable {
    const nlohmann::json& port = json.at("ports").at(p++);
    EXPECT_EQ(port.at("name"), Port::name);
    std::size_t k = 0;
    for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
      if constexpr (std::is_same_v<typename Effect::Port, Port>) {
        EXPECT_EQ(port.at("order").at(k++), Effect::text.name);
      }
    });
    EXPECT_EQ(port.at("order").size(), k);
  });
  EXPECT_EQ(json.at("law_points").size(), 6u);
}

/// The examples of the page are what the reader of machine files takes.
TEST(EffectReference, ExamplesOfThePageAreValidMachineFiles) {
  const std::string page = effect_markdown(), fence = "```toml\n";
  std::size_t laws = 0, deviations = 0;
  for (std::size_t at = 0; (at = page.find(fence, at)) != page.npos;) {
    at += fence.size();
    const std::string toml = page.substr(at, page.find("```", at) - at);
    const Machine machine = parse_machine(toml, "example");
    laws += machine.effects.laws.size();
    deviations += machine.effects.deviations.size();
    for (const Law& law : machine.effects.laws) {
      Motions<double> motions{};
      motions[kX] = {0.1, 0.02, 0};
      EXPECT_NEAR(law(0, motions), -150, 1e-9) << "against the motion, in the stretch";
      motions[kX] = {0.1, -0.02, 0};
      EXPECT_NEAR(law(0, motions), 150, 1e-9);
    }
  }
  EXPECT_EQ(laws, 1u);
  EXPECT_EQ(deviations, 1u);
}

}  // namespace
}  // namespace vcnc::reference_test
