#include "configs/scenario.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "configs/config.hpp"

namespace vcnc::scenario_test {
namespace {

std::string refusal(const std::string& toml) {
  try {
    parse_scenario(toml, "s.toml");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "accepted";
}

const std::string kGood = "machine = \"m.toml\"\nkind = \"program_error\"\n";

TEST(Scenario, ValuesInTheKeysUnitBecomeSi) {
  const Scenario s = parse_scenario(
      kGood +
          "feed_mm_min = 1200\naxial_deg = 90\ndepth_mm = 7\nset = [\"a=1\", \"b=2\"]\n"
          "expect = \"hard\"\ntarget = \"bore\"\nrotary_feed_deg_s = 180\n",
      "s");
  EXPECT_DOUBLE_EQ(s.feed, 0.02);
  EXPECT_DOUBLE_EQ(s.axial_angle, kPi / 2);
  EXPECT_DOUBLE_EQ(s.depth, 7e-3);
  EXPECT_DOUBLE_EQ(s.rotary_feed, kPi);
  EXPECT_EQ(s.set, (std::vector<std::string>{"a=1", "b=2"}));
  EXPECT_EQ(s.expect, Scenario::Expect::hard);
  EXPECT_EQ(s.target, Scenario::Target::bore);
}

TEST(Scenario, WritingAndReadingGivesTheSame) {
  Scenario s = parse_scenario(kGood, "s");
  s.name = "a \"quoted\" name\nof two lines";
  s.set = {"probe.range_mm=1.5", "setup.piece=\"x\""};
  s.faults = {"probe mute"};
  s.feed = 1234.5e-3 / 60;
  s.at = {0.01, -0.02, 1.0 / 3};
  EXPECT_EQ(to_toml(parse_scenario(to_toml(s), "again")), to_toml(s));
  EXPECT_EQ(to_toml(s).find("[piece]"), std::string::npos) << "none was given";
  s.kind = Scenario::Kind::program;
  s.gcode = "G1 X1 F100\nM30\n";
  s.piece.kind = PieceParams::Kind::plane;
  const Scenario again = parse_scenario(to_toml(s), "again");
  EXPECT_TRUE(again.has_piece());
  EXPECT_EQ(to_toml(again), to_toml(s));
}

TEST(Scenario, BadFilesAreRefusedWithTheKey) {
  const std::pair<std::string, const char*> kBad[] = {
      {"kind = \"program_error\"\n", "machine: is missing"},
      {"machine = \"m\"\n", "needs either program"},
      {"machine = \"m\"\nprogram = \"a\"\ngcode = \"M30\"\n", "needs either program"},
      {kGood + "gcode = \"M30\"\n", "program, gcode: are for kind \"program\""},
      {kGood + "[piece]\nkind = \"plane\"\n", "piece: is for kind \"program\""},
      {kGood + "feed_mm_min = 0\n", "s.toml:3: feed_mm_min: 0 is out of range"},
      {kGood + "depth = 1\n", "s.toml:3: depth: unknown key; did you mean depth_mm?"},
      {kGood + "expect = \"crash\"\n", "s.toml:3: expect: expected one of \"soft_stop\""},
      {kGood + "set = \"a=1\"\n", "s.toml:3: set: expected an array of texts"},
      {kGood + "set = [1]\n", "s.toml:3: set: expected a text in quotes"},
      {kGood + "target = \"sphere\"\nincidence_deg = 10\n", "incidence_deg: is for target"},
      {kGood + "predeflection_mm = 9\n", "predeflection_mm: 9 must be below depth_mm"},
      {"machine = \"m\"\nkind = \"scan\"\n", "predeflection_mm: kind \"scan\" needs it"},
      {"machine = \"m\"\nkind = \"wrong_length\"\n", "axial_deg: kind \"wrong_length\" needs 90"},
      {"machine = \"m\"\nkind = \"wrong_length\"\naxial_deg = 90\nturn_deg = 1\n", "turn_deg"},
      {"machine = \n", "s.toml:1"}};
  for (const auto& [toml, expected] : kBad)
    EXPECT_NE(refusal(toml).find(expected), std::string::npos) << toml << refusal(toml);
  EXPECT_EQ(refusal(kGood), "accepted");
}

TEST(Scenario, EveryShippedOneLoadsAndItsMachineIsThere) {
  std::size_t count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(VCNC_SOURCE_DIR) + "/configs/scenarios")) {
    const Scenario s = load_scenario(entry.path());
    EXPECT_FALSE(s.name.empty()) << entry.path();
    EXPECT_NO_THROW(load_machine(s.machine, s.set, s.inject)) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 10u);
}

TEST(Scenario, TheReferenceShowsEveryKey) {
  const std::string reference = scenario_key_reference();
  for (const char* key : {"`machine`", "`set`", "`kind`", "`feed_mm_min`", "`faults`", "`expect`"})
    EXPECT_NE(reference.find(key), std::string::npos) << key;
}

}  // namespace
}  // namespace vcnc::scenario_test
