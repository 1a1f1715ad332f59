// Loss of the mains and what survives switching off, with real processes and files.
#include <gtest/gtest.h>

#include "tests/processes/shell.hpp"

namespace vcnc::power_test {
namespace {

const std::string kMachine = configs("machines/trunnion.toml");

class PowerProcesses : public testing::Test {
 protected:
  PowerProcesses() {
    write_text(scratch_ / "moving.ngc",
               "G90 G21\nM19\nG1 X100 Y50 F3000\nG1 X-100 Y-50\nG1 X0 Y0\nM30\n");
  }
  Said run(const std::string& out, const std::string& program, const std::string& options) {
    return shell(scratch_, bin("vcnc") + " run " + (scratch_ / program) + " --machine " + kMachine +
                               " --no-report --out " + (scratch_ / out) + " " + options);
  }
  Said vcnc(const std::string& arguments) { return shell(scratch_, bin("vcnc") + " " + arguments); }
  std::string summary(const std::string& out, const std::string& key) {
    return json_value(read_text(scratch_ / (out + "/summary.json")), key);
  }
  std::string memory() { return " --memory " + (scratch_ / "memory"); }

  Scratch scratch_;
};

TEST_F(PowerProcesses, ALossAndAResumptionGiveOneHashInEveryLayout) {
  std::string first, second;
  for (const std::string layout : {"--in-process", ""}) {
    fs::remove_all(scratch_ / "memory");
    const Said lost = run("lost", "moving.ngc",
                          layout + memory() + " --fault \"supply power_loss from_s=1.2\" " +
                              "--set supply.hold_up_energy_J=50");
    EXPECT_EQ(lost.code, 3) << lost.err << lost.out;
    EXPECT_NE(lost.out.find("Supply exhausted"), std::string::npos) << lost.out;
    const Said shown = vcnc("memory " + (scratch_ / "memory"));
    EXPECT_NE(shown.out.find("goes on with --resume"), std::string::npos) << shown.out;
    const Said fresh = run("fresh", "moving.ngc", layout + memory());
    EXPECT_EQ(fresh.code, 2);
    EXPECT_NE(fresh.err.find("go on with --resume, or drop it with"), std::string::npos)
        << fresh.err;
    EXPECT_FALSE(fs::exists(scratch_ / "fresh"));
    const Said on =
        run("on", "moving.ngc", layout + memory() + " --resume --set supply.hold_up_energy_J=50");
    EXPECT_EQ(on.code, 0) << on.err << on.out;
    if (first.empty()) {
      first = summary("lost", "trace_hash");
      second = summary("on", "trace_hash");
      EXPECT_EQ(first.size(), 32u);
    }
    EXPECT_EQ(summary("lost", "trace_hash"), first) << layout;
    EXPECT_EQ(summary("on", "trace_hash"), second) << layout;
  }
}

TEST_F(PowerProcesses, TheMainsReturnAsTheOperatorHasChosen) {
  const std::string loss = " --fault \"supply power_loss from_s=1.2 for_s=0.5\" ";
  const Said ends = run("ends", "moving.ngc", loss);
  EXPECT_EQ(ends.code, 3) << ends.err;
  EXPECT_NE(summary("ends", "reason").find("ended after a loss of the mains"), std::string::npos);
  const Said goes_on = run("goes_on", "moving.ngc", loss + "--on-power-return resume");
  EXPECT_EQ(goes_on.code, 0) << goes_on.err;
  EXPECT_NE(run("bad", "moving.ngc", "--on-power-return maybe").code, 0);
}

// The probe trips, the spindle's program is killed: the lock is on the disk and holds in every run
// until the operator's reset.
TEST_F(PowerProcesses, ALockSurvivesAKilledSpindle) {
  const std::string trip = " --fault \"probe wire_break from_s=0.75\" --pace 1 ";
  const Said tripped =
      run("tripped", "moving.ngc", trip + memory() + " --fault \"drive spindle kill from_s=0.8\"");
  EXPECT_NE(tripped.code, 0) << tripped.out;
  const Said shown = vcnc("memory " + (scratch_ / "memory"));
  EXPECT_NE(shown.out.find("overtravel   latched, HARD"), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("spindle      locked"), std::string::npos) << shown.out;
  for (int i = 0; i < 2; ++i) {
    const Said again = run("again", "moving.ngc", memory());
    EXPECT_EQ(again.code, 3) << again.err;
    EXPECT_NE(again.out.find("Overtravel: quick stop, spindle locked"), std::string::npos)
        << again.out;
  }
  const Said reset = vcnc("reset " + (scratch_ / "memory"));
  EXPECT_EQ(reset.code, 0) << reset.err;
  EXPECT_NE(reset.out.find("spindle      locked"), std::string::npos) << "what was latched";
  EXPECT_EQ(run("free", "moving.ngc", memory()).code, 0);
}

TEST_F(PowerProcesses, BadMemoriesAreOneClearError) {
  const auto expect = [&](const Said& said, const std::string& text) {
    EXPECT_EQ(said.code, 2);
    EXPECT_NE(said.err.find(text), std::string::npos) << said.err;
  };
  expect(run("x", "moving.ngc", "--resume"), "needs --memory");
  expect(run("x", "moving.ngc", "--resume --memory " + (scratch_ / "none")), "is not a folder");
  ASSERT_EQ(run("x", "moving.ngc", "--in-process" + memory()).code, 0);
  expect(run("x", "moving.ngc", "--resume" + memory()), "holds no interrupted program");
  expect(vcnc("memory " + (scratch_ / "x")), "is not the memory of a machine");
  write_text(scratch_ / "memory/overtravel.0", "");
  EXPECT_EQ(run("x", "moving.ngc", "--in-process" + memory()).code, 0) << "the other one holds";
  write_text(scratch_ / "memory/overtravel.1", "torn");
  expect(run("y", "moving.ngc", memory()), "overtravel.1 is cut off");
  EXPECT_FALSE(fs::exists(scratch_ / "y"));
  EXPECT_EQ(vcnc("reset " + (scratch_ / "memory")).code, 0);
  EXPECT_EQ(run("x", "moving.ngc", "--in-process" + memory()).code, 0);
}

}  // namespace
}  // namespace vcnc::power_test
