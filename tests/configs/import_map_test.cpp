#include "configs/import_map.hpp"

#include <gtest/gtest.h>

#include "configs/config.hpp"

namespace vcnc::import_map_test {
namespace {

constexpr const char* kSound = R"(
[time]
column = "t"
unit = "s"

[[axes]]
name = "carriage"
place = "X"

[[signals]]
column = "q"
kind = "position"
axis = "carriage"
unit = "um"
scale = 0.05
sign = -1
offset = 3
)";

std::string refusal(const std::string& toml) {
  try {
    parse_import_map(toml, "map.toml");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(ImportMap, ReadsPlaceUnitScaleSignAndOffset) {
  const ImportMap map = parse_import_map(kSound, "map.toml");
  ASSERT_EQ(map.signals.size(), 1u);
  const SignalPlace place = place_of(map, map.signals[0]);
  EXPECT_EQ(place.axis, 0u);
  EXPECT_FALSE(place.rotary);
  // -(1000 * 0.05) + 3 um
  EXPECT_NEAR(to_si(map.signals[0], 1000), -47e-6, 1e-15);
}

TEST(ImportMap, UnitsHaveTheirFactors) {
  EXPECT_NEAR(find_measured_unit("deg")->factor, 3.14159265358979323846 / 180, 1e-15);
  EXPECT_DOUBLE_EQ(find_measured_unit("mm/min")->factor, 1e-3 / 60);
  EXPECT_DOUBLE_EQ(find_measured_unit("rpm")->factor, 2 * 3.14159265358979323846 / 60);
  ImportMap::Signal celsius;
  celsius.unit = "degC";
  EXPECT_DOUBLE_EQ(to_si(celsius, 20), 293.15);
}

TEST(ImportMap, RefusesWithLineKeyAndWhatIsAllowed) {
  const auto with = [](const std::string& signal) { return std::string(kSound) + signal; };
  const std::vector<std::pair<std::string, std::string>> cases{
      {with("[[signals]]\ncolumn = \"q\"\nkind = \"force\"\naxis = \"X\"\nunit = \"N\"\n"),
       "map.toml:19: signals.column: column \"q\" is given twice"},
      {with("[[signals]]\ncolumn = \"p\"\nkind = \"position\"\naxis = \"X\"\nunit = \"mm\"\n"),
       "map.toml:20: signals.kind: the position of X is given twice"},
      {with("[[signals]]\ncolumn = \"f\"\nkind = \"force\"\naxis = \"X\"\nunit = \"mm\"\n"),
       "map.toml:22: signals.unit: \"mm\" does not fit; allowed for the force of a linear axis: N, "
       "kN"},
      {with("[[signals]]\ncolumn = \"f\"\nkind = \"force\"\naxis = \"X\"\nunit = \"Nm\"\n"),
       "newtons at the carriage per newton metre"},
      {with("[[signals]]\ncolumn = \"f\"\nkind = \"force\"\naxis = \"X\"\nunit = \"A\"\n"),
       "give unit \"N\" and as scale the newtons per ampere"},
      {with("[[signals]]\ncolumn = \"v\"\nkind = \"velocity\"\naxis = \"X\"\nunit = \"furlong\"\n"),
       "\"furlong\" is unknown; allowed for the velocity of a linear axis: m/s, mm/s"},
      {with("[[signals]]\ncolumn = \"v\"\nkind = \"velocity\"\naxis = \"X\"\n"),
       "signals.unit: is missing"},
      {with("[[signals]]\ncolumn = \"v\"\naxis = \"X\"\nunit = \"mm\"\n"),
       "signals.kind: is missing; allowed command, position, motor_position, load_position, "
       "following_error, twist, velocity, force, applied_force, added_force, deflection,"},
      {with("[[signals]]\ncolumn = \"e\"\nkind = \"following_error\"\naxis = \"Y\"\nunit = "
            "\"um\"\n"),
       "a following_error of Y says where it is beside its command, which is not given"},
      {with("[[signals]]\ncolumn = \"e\"\nkind = \"following_error\"\naxis = \"X\"\nunit = \"um\"\n"
            "[[signals]]\ncolumn = \"c\"\nkind = \"command\"\naxis = \"X\"\nunit = \"mm\"\n"),
       "X has a position as well; one of the two is too many"},
      {with("[[signals]]\ncolumn = \"d\"\nkind = \"position\"\naxis = \"Q\"\nunit = \"mm\"\n"),
       "\"Q\" is no axis that has a position; allowed X, Y, Z, A, C, \"carriage\""},
      {with("[[signals]]\ncolumn = \"d\"\nkind = \"deflection\"\naxis = \"X\"\nunit = \"um\"\n"),
       "allowed x, y, z of the probe"},
      {with("[[signals]]\ncolumn = \"d\"\nkind = \"cosine\"\naxis = \"x\"\nunit = \"V\"\n"),
       "x has a cosine, but no sine"},
      {with("[[signals]]\ncolumn = \"d\"\nkind = \"deflection\"\naxis = \"x\"\nunit = \"um\"\nsign "
            "= "
            "0\n"),
       "map.toml:23: signals.sign: 0 is not possible"},
      {with("[[signals]]\ncolum = \"d\"\n"), "unknown key; did you mean column?"},
      {with("[[laps]]\nfrom_s = 2\nto_s = 1\n"), "map.toml:20: laps.to_s: must be after from_s"},
      {with("[[laps]]\nfrom_s = 0\nto_s = 2\n[[laps]]\nfrom_s = 1\nto_s = 3\n"),
       "laps.from_s: the lap begins before the one above it ends"},
      {"[time]\nrate_hz = 1000\n", "signals: is missing"},
      {"[[signals]]\ncolumn = \"q\"\nkind = \"position\"\naxis = \"X\"\nunit = \"m\"\n",
       "time.column: is missing; time needs a column"},
      {"[time]\ncolumn = \"t\"\nunit = \"s\"\nrate_hz = 1000\n", "time.rate_hz: a column with the"},
      {"[time]\ncolumn = \"t\"\nunit = \"mm\"\n", "\"mm\" is no unit of time"},
      {"[time]\ncolumn = \"t\"\n", "time.unit: is missing; allowed: s, ms"},
      {"[time]\nrate_hz = 1000\n[[axes]]\nname = \"joint\"\nplace = \"Q\"\n",
       "map.toml:5: axes.place: \"Q\" is no place"},
  };
  for (const auto& [toml, sentence] : cases)
    EXPECT_NE(refusal(toml).find(sentence), std::string::npos)
        << "expected: " << sentence << "\nfound:    " << refusal(toml);
}

TEST(ImportMap, AllowsNoNameThatDoesNotFit) {
  const std::string said =
      refusal(std::string(kSound) +
              "[[signals]]\ncolumn = \"c\"\nkind = \"cosine\"\naxis = \"carriage\"\nunit = "
              "\"V\"\n");
  EXPECT_TRUE(said.ends_with("no axis that has a cosine; allowed x, y, z of the probe")) << said;
}

TEST(ImportMap, EveryKeyIsInTheReference) {
  const std::string page = import_map_key_reference();
  for (const char* key : {"`machine`", "`time.rate_hz`", "`signals.scale`", "`[[laps]]`"})
    EXPECT_NE(page.find(key), std::string::npos) << key;
}

}  // namespace
}  // namespace vcnc::import_map_test
