// `vcnc lockout` as its users start it: exit codes, result files, and how a run is repeated.
#include <gtest/gtest.h>

#include <regex>
#include <vector>

#include "tests/processes/shell.hpp"

namespace vcnc::lockout_cli_test {
namespace {

/// What is wrong with a text as XML; empty: nothing. Enough for elements, attributes and entities.
std::string xml_fault(const std::string& text) {
  static const std::regex tag(
      R"re(<(\?xml( [\w]+="[^"<]*")*\?|(/?)([\w]+)((?: [\w]+="[^"<]*")*)(/?))>)re");
  static const std::regex bad_entity("&(?!(amp|lt|gt|quot|apos);)");
  if (std::regex_search(text, bad_entity)) return "a bare &";
  std::vector<std::string> open;
  std::size_t at = 0, roots = 0;
  for (std::sregex_iterator i(text.begin(), text.end(), tag), end; i != end; ++i) {
    const std::string between = text.substr(at, static_cast<std::size_t>(i->position()) - at);
    if (between.find_first_of("<>") != std::string::npos) return "not a tag: " + between;
    at = static_cast<std::size_t>(i->position() + i->length());
    const std::string name = (*i)[4];
    if (name.empty()) continue;  // the declaration
    if ((*i)[3] == "/") {
      if (open.empty() || open.back() != name) return "unexpected </" + name + ">";
      open.pop_back();
    } else if ((*i)[6] != "/") {
      roots += open.empty();
      open.push_back(name);
    }
  }
  if (text.find_first_of("<>", at) != std::string::npos) return "not a tag at the end";
  return !open.empty() ? "open: " + open.back() : roots == 1 ? "" : "not one root";
}

TEST(XmlFault, IsFound) {
  EXPECT_EQ(xml_fault("<?xml version=\"1.0\"?>\n<a x=\"1\"><b/>t &amp; u</a>\n"), "");
  for (const char* bad : {"<a>", "<a></b>", "<a>&</a>", "<a x=1/>", "<a/><b", "<a><b></a></b>"})
    EXPECT_NE(xml_fault(bad), "") << bad;
}

class LockoutCli : public testing::Test {
 protected:
  Said lockout(const std::string& arguments) {
    return shell(scratch_, bin("vcnc") + " lockout " + arguments);
  }
  Scratch scratch_;
};

TEST_F(LockoutCli, ASmallSuitePassesAndWritesItsResults) {
  const Said said =
      lockout("--scenarios 8 --seed 2 --jobs 2 --json " + (scratch_ / "r.json") + " --junit " +
              (scratch_ / "r.xml") + " --html " + (scratch_ / "r.html"));
  ASSERT_EQ(said.code, 0) << said.out << said.err;
  EXPECT_NE(said.out.find("PASS"), std::string::npos);
  EXPECT_EQ(json_value(read_text(scratch_ / "r.json"), "runs"), "24");
  EXPECT_EQ(json_value(read_text(scratch_ / "r.json"), "missed"), "0");
  const std::string junit = read_text(scratch_ / "r.xml");
  EXPECT_EQ(xml_fault(junit), "");
  EXPECT_NE(junit.find("<testsuites name=\"vcnc lockout\" tests=\"24\" failures=\"0\""),
            std::string::npos);
  const std::string page = read_text(scratch_ / "r.html");
  EXPECT_NE(page.find("</html>"), std::string::npos);
  EXPECT_EQ(page.find("http://localhost"), std::string::npos);
  EXPECT_EQ(page.find("src="), std::string::npos) << "self-contained";
}

TEST_F(LockoutCli, WhatIsNotAsExpectedIsExitCodeOneAndTold) {
  write_text(scratch_ / "wrong.toml", "name = \"a < b & c\"\nmachine = \"" +
                                          configs("machines/trunnion.toml") +
                                          "\"\nkind = \"program_error\"\nexpect = \"none\"\n");
  const Said said = lockout((scratch_ / "wrong.toml") + " --junit " + (scratch_ / "r.xml"));
  EXPECT_EQ(said.code, 1) << said.out << said.err;
  EXPECT_NE(said.out.find("expected none, but the machine stopped"), std::string::npos);
  EXPECT_NE(said.out.find("--only wrong"), std::string::npos);
  EXPECT_EQ(xml_fault(read_text(scratch_ / "r.xml")), "");
}

TEST_F(LockoutCli, BadInputIsExitCodeTwoAndOneSentence) {
  write_text(scratch_ / "bad.toml", "kind = \"program_error\"\n");
  write_text(scratch_ / "faults.toml", "machine = \"" + configs("machines/trunnion.toml") +
                                           "\"\nkind = \"program_error\"\nfaults = [\"x\"]\n");
  for (const std::string& arguments :
       {scratch_ / "bad.toml", scratch_ / "none.toml", scratch_ / "faults.toml",
        std::string("--only crash-1x"), std::string("--seed x"), std::string("--out folder"),
        std::string("--scenarios 1 --json /none/r.json"), std::string("--scenarios 0"),
        std::string("--scenarios 1 --machine /none.toml")}) {
    const Said said = lockout(arguments);
    EXPECT_EQ(said.code, 2) << arguments << said.err;
    EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << arguments << said.err;
  }
}

/// A scenario that could not run on any machine is a mistake, not a finding.
TEST_F(LockoutCli, AScenarioThatCannotRunIsBadInputAndNamesItsFile) {
  const std::string head = "machine = \"" + configs("machines/trunnion.toml") + "\"\n";
  write_text(scratch_ / "inject.toml",
             head + "kind = \"program_error\"\ninject = [\"X.backlsh.gap_um=3\"]\n");
  write_text(scratch_ / "gcode.toml",
             head + "expect = \"trip\"\ngcode = \"G90\\nG1 X1 Q7\\nM30\"\n");
  write_text(scratch_ / "bad.ngc", "G90\nG1 X9999 F100\nM30\n");
  write_text(scratch_ / "program.toml", head + "program = \"bad.ngc\"\n");
  for (const auto& [file, message] :
       {std::pair{"inject.toml", "inject.toml: --inject X.backlsh.gap_um=3: "},
        {"gcode.toml", "gcode.toml: gcode:2:1: "},
        {"program.toml", "program.toml: "}}) {
    const Said said = lockout(scratch_ / file);
    EXPECT_EQ(said.code, 2) << said.out << said.err;
    EXPECT_NE(said.err.find(message), std::string::npos) << said.err;
    EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
  }
  EXPECT_NE(lockout(scratch_ / "program.toml").err.find("bad.ngc:2:1: "), std::string::npos);
  // What only the probe forbids is what such a scenario is about.
  write_text(scratch_ / "fast.toml",
             head + "expect = \"refused\"\ngcode = \"G43.4 H1\\nG1 X90 F30000\\nM30\"\n");
  EXPECT_EQ(lockout(scratch_ / "fast.toml").code, 0);
}

TEST_F(LockoutCli, OneRunIsRepeatedIntoAFolderThatVcncRunRepeats) {
  ASSERT_EQ(lockout("--only crash-1 --seed 2 --out " + (scratch_ / "one") + " --json " +
                    (scratch_ / "r.json"))
                .code,
            0);
  const std::string hash = json_value(read_text(scratch_ / "r.json"), "trace_hash");
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(json_value(read_text(scratch_ / "one/summary.json"), "trace_hash"), hash);
  const std::string scenario = read_text(scratch_ / "one/scenario.toml");
  std::smatch seed;
  ASSERT_TRUE(std::regex_search(scenario, seed, std::regex("\nseed = ([0-9]+)\n")));
  fs::copy(scratch_ / "one", scratch_ / "copy");
  const Said again =
      shell(scratch_, bin("vcnc") + " run " + (scratch_ / "copy/program.ngc") + " --machine " +
                          (scratch_ / "copy/machine.toml") + " --seed " + seed[1].str() +
                          " --in-process --no-report --out " + (scratch_ / "again"));
  EXPECT_EQ(again.code, 3) << again.err;
  EXPECT_EQ(json_value(read_text(scratch_ / "again/summary.json"), "trace_hash"), hash);
}

TEST_F(LockoutCli, RealProcessesEndSafelyWhateverDiesWhenever) {
  const Said said =
      lockout("--processes 10 --seed 6 --jobs 2 --json " + (scratch_ / "r.json") + " --junit " +
              (scratch_ / "r.xml") + " --html " + (scratch_ / "r.html"));
  EXPECT_EQ(said.code, 0) << said.out << said.err;
  const std::string json = read_text(scratch_ / "r.json");
  EXPECT_EQ(json_value(json, "processes"), "10");
  EXPECT_EQ(json_value(json, "as_expected"), "10");
  EXPECT_EQ(xml_fault(read_text(scratch_ / "r.xml")), "");
  EXPECT_NE(read_text(scratch_ / "r.xml").find("lockout.processes"), std::string::npos);
  EXPECT_NE(read_text(scratch_ / "r.html").find("Real processes"), std::string::npos);
}

TEST_F(LockoutCli, TheListShowsKindsAndKeys) {
  const Said said = lockout("--list");
  EXPECT_EQ(said.code, 0);
  for (const char* word : {"wrong_offset", "not_retracted", "`depth_mm`", "safe", "fault_safe",
                           "at=contact", "| `stuck_adc` |"})
    EXPECT_NE(said.out.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace vcnc::lockout_cli_test
