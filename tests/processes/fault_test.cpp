// Faults on real processes: dead and stopped modules at random moments, and one hash for faults in
// simulated time.
#include <gtest/gtest.h>

#include <random>

#include "tests/processes/shell.hpp"

namespace vcnc::fault_test {
namespace {

const std::string kMachine = configs("machines/trunnion_measured.toml");

/// Axes on the move for some 20 s, no contact.
std::string moving_program() {
  std::string text = "G90 G21\nM19\nG43.4 H1\n";
  for (int i = 0; i < 20; ++i)
    text += i % 2 == 0 ? "G1 X100 Y50 A3 C4 F6000\n" : "G1 X-100 Y-50 A-3 C-40\n";
  return text + "M30\n";
}

class FaultyProcesses : public testing::Test {
 protected:
  FaultyProcesses() { write_text(scratch_ / "moving.ngc", moving_program()); }

  Said run(const std::string& out, const std::string& options) {
    return shell(scratch_, bin("vcnc") + " run " + (scratch_ / "moving.ngc") + " --machine " +
                               kMachine + " --no-report --out " + (scratch_ / out) + " " + options);
  }
  std::string summary(const std::string& out) {
    return read_text(scratch_ / (out + "/summary.json"));
  }
  std::string leftovers() {
    return shell(scratch_, "pgrep -af " + (scratch_ / "") + " | grep -v pgrep | grep -v 'sh -c'")
        .out;
  }
  /// A time of the run between 0.4 and 1.2 s.
  std::string moment() {
    return std::to_string(0.4 + 0.8 * static_cast<double>(random_() % 100) / 100);
  }

  /// The end of a run in which `node` died or stopped: failed, by name, readable, nobody left.
  void expect_failed_by_name(const std::string& fault, const std::string& node, const Said& said) {
    EXPECT_EQ(said.code, 1) << fault;
    EXPECT_NE(said.err.find(node), std::string::npos) << fault << said.err;
    EXPECT_EQ(leftovers(), "") << fault;
    const Said again = shell(scratch_, bin("vcnc") + " analyze " + (scratch_ / "run"));
    EXPECT_EQ(again.code, 0) << fault << again.err;
    EXPECT_NE(summary("run").find(node), std::string::npos) << fault;
  }

  Scratch scratch_;
  std::mt19937 random_{11};
};

const std::vector<std::string> kNodes{"drive X", "drive Y",    "drive Z",
                                      "drive A", "drive C",    "drive spindle",
                                      "probe",   "overtravel", "NC unit"};

/// Where the NC unit is there to do it: quick stop of the others, alarm 3201.
void expect_alarm(const std::string& summary, const std::string& node) {
  if (node == "NC unit") return;
  EXPECT_NE(summary.find("3201"), std::string::npos) << summary;
}

/// "drive X: came to rest 0.047 s after the bus was lost" for what was moving.
void expect_run_down(const Scratch& scratch, const std::string& node) {
  const std::string notes = read_text(scratch / "run/notes.txt");
  if (node != "NC unit") return;
  for (const char* drive : {"drive X: ", "drive Y: ", "drive C: "}) {
    const std::size_t at = notes.find(drive + std::string("came to rest 0."));
    ASSERT_NE(at, std::string::npos) << notes;
    const double seconds = std::stod(notes.substr(notes.find("rest ", at) + 5));
    EXPECT_GE(seconds, 0.003) << "two silent cycles are borne";
    EXPECT_LT(seconds, 0.2) << drive;
  }
  EXPECT_EQ(notes.find("still moving"), std::string::npos) << notes;
}

TEST_F(FaultyProcesses, AKilledModuleOfAnyKindEndsSafelyByName) {
  for (const std::string& node : kNodes) {
    const std::string fault = node + " kill from_s=" + moment();
    const Said said = run("run", "--pace 2 --fault \"" + fault + "\"");
    expect_failed_by_name(fault, node, said);
    EXPECT_NE(said.err.find("killed by signal 9"), std::string::npos) << said.err;
    expect_alarm(summary("run"), node);
    expect_run_down(scratch_, node);
  }
}

TEST_F(FaultyProcesses, AStoppedModuleOfAnyKindEndsSafelyByName) {
  for (const std::string& node : kNodes) {
    const std::string fault = node + " stop from_s=" + moment();
    const Said said = run("run", "--pace 2 --answer-timeout-s 0.5 --fault \"" + fault + "\"");
    expect_failed_by_name(fault, node, said);
    const bool timed_out = said.err.find("no answer within 500 ms") != std::string::npos;
    EXPECT_EQ(timed_out, node != "NC unit") << said.err;
    expect_alarm(summary("run"), node);
    expect_run_down(scratch_, node);
  }
}

/// The program started again takes no part: the run ends as if it had died, the rest stands.
TEST_F(FaultyProcesses, ARestartedModuleTakesNoPartAndIsNamed) {
  for (const std::string node : {"drive Y", "overtravel", "NC unit"}) {
    const std::string fault = node + " restart from_s=0.6";
    const Said said = run("run", "--pace 2 --answer-timeout-s 0.5 --fault \"" + fault + "\"");
    expect_failed_by_name(fault, node, said);
    EXPECT_NE(said.err.find("started again"), std::string::npos) << said.err;
    expect_alarm(summary("run"), node);
    expect_run_down(scratch_, node);
    if (node == "NC unit") {
      EXPECT_NE(read_text(scratch_ / "run/notes.txt").find("the spindle is locked"),
                std::string::npos);
    }
  }
}

TEST_F(FaultyProcesses, AFullDiskStopsTheRunAndTheRecordingUpToThereOpens) {
  const Said said = run("run", "--pace 4 --fault \"analysis disk_full from_s=2\"");
  EXPECT_EQ(said.code, 1);
  EXPECT_NE(said.err.find("analysis"), std::string::npos) << said.err;
  EXPECT_EQ(leftovers(), "");
  EXPECT_NE(said.err.find("recording"), std::string::npos)
      << "it says what could not be written: " << said.err;
  const Said again = shell(
      scratch_, bin("vcnc") + " analyze " + (scratch_ / "run") + " --out " + (scratch_ / "again"));
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_GT(std::stol(json_value(read_text(scratch_ / "again/summary.json"), "rows")), 1000);
}

/// A reader that stalls changes nothing but what it has missed itself.
TEST_F(FaultyProcesses, AStalledReaderMissesRowsThatAreCounted) {
  write_text(scratch_ / "moving.ngc",
             "G90 G21\nM19\nG43.4 H1\nG1 X100 Y50 A3 C4 F6000\nX-100\nM30\n");
  ASSERT_EQ(run("reference", "--in-process").code, 0);
  const Said said = run("run", "--pace 2 --fault \"analysis stop from_s=0.6 for_s=1\"");
  EXPECT_EQ(said.code, 0) << said.err;
  EXPECT_EQ(json_value(summary("run"), "trace_hash"),
            json_value(summary("reference"), "trace_hash"));
  const auto number = [&](const char* key) { return std::stol(json_value(summary("run"), key)); };
  EXPECT_EQ(number("rows") + number("gaps"), number("cycles")) << "what it missed is counted";
}

TEST_F(FaultyProcesses, FaultsThatNeverStrikeAreToldAndAllAreKept) {
  write_text(scratch_ / "moving.ngc", "G90 G21\nM19\nG43.4 H1\nG1 X10 F3000\nM30\n");
  const std::string faults =
      "--fault \"probe mute from_s=1000\" --fault \"drive Y drop id=0x555\" "
      "--fault \"drive Y duplicate from_s=0.3 for_s=0.002\"";
  for (const std::string layout : {"--in-process ", ""}) {
    const Said said = run("run", layout + faults);
    EXPECT_EQ(said.code, 0) << said.err;
    EXPECT_NE(said.err.find("\"probe mute from_s=1000\": had no effect"), std::string::npos)
        << said.err;
    EXPECT_NE(said.err.find("id=0x555\": had no effect"), std::string::npos) << said.err;
    EXPECT_EQ(said.err.find("duplicate"), std::string::npos) << said.err;
    EXPECT_EQ(read_text(scratch_ / "run/faults.txt"),
              "probe mute from_s=1000\ndrive Y drop id=0x555\ndrive Y duplicate from_s=0.3 "
              "for_s=0.002\n");
  }
}

TEST_F(FaultyProcesses, RandomFaultsAreThoseOfTheSeed) {
  write_text(scratch_ / "moving.ngc", "G90 G21\nM19\nG43.4 H1\nG1 X10 F3000\nM30\n");
  const auto faults = [&](const std::string& seed, const std::string& out) {
    run(out, "--in-process --random-faults 4 --seed " + seed);
    return read_text(scratch_ / (out + "/faults.txt"));
  };
  const std::string one = faults("3", "a");
  EXPECT_EQ(std::count(one.begin(), one.end(), '\n'), 4);
  EXPECT_EQ(faults("3", "b"), one);
  EXPECT_EQ(json_value(summary("a"), "trace_hash"), json_value(summary("b"), "trace_hash"));
  EXPECT_NE(faults("4", "c"), one);
  const Said revealed = shell(scratch_, bin("vcnc") + " compare " + (scratch_ / "a") + " " +
                                            (scratch_ / "c") + " --reveal");
  EXPECT_EQ(revealed.code, 0) << revealed.err;
  EXPECT_NE(revealed.out.find(one.substr(0, one.find('\n'))), std::string::npos) << revealed.out;
  const Said same = shell(scratch_, bin("vcnc") + " compare " + (scratch_ / "a") + " " +
                                        (scratch_ / "b") + " --reveal");
  EXPECT_NE(same.out.find("nothing differs"), std::string::npos) << same.out;
}

TEST_F(FaultyProcesses, ASlowModuleDoesNotChangeTheHash) {
  write_text(scratch_ / "moving.ngc", "G90 G21\nM19\nG43.4 H1\nG1 X30 Y20 A3 C4 F6000\nM30\n");
  ASSERT_EQ(run("reference", "--in-process").code, 0);
  const Said slow =
      run("slow", "--fault \"drive Y slow wall_s=0\" --fault \"probe slow wall_s=0.1\"");
  ASSERT_EQ(slow.code, 0) << slow.err;
  EXPECT_EQ(json_value(summary("slow"), "trace_hash"),
            json_value(summary("reference"), "trace_hash"));
}

TEST_F(FaultyProcesses, SimulatedFaultsGiveOneHashInEveryLayout) {
  const std::string faults =
      "--fault \"probe mute from_s=0.7 for_s=0.002\" --fault \"drive Y duplicate from_s=0.8 "
      "for_s=0.02\" --fault \"bus lose_sync from_s=0.9 for_s=0.001\" --fault \"drive X "
      "encoder_jump "
      "um=3 from_s=1\" --fault \"drive C babble frames=1 from_s=1 for_s=0.01\" ";
  for (const std::string last :
       {"--fault \"probe wire_break from_s=1.2\"", "--fault \"overtravel silent from_s=1.2\"",
        "--fault \"bus stuck from_s=1.2\"", "--fault \"NC unit mute from_s=1.2\""}) {
    const Said one = run("one", "--in-process " + faults + last);
    const Said many = run("many", faults + last);
    EXPECT_EQ(one.code, 3) << one.err << one.out;
    EXPECT_EQ(many.code, 3) << many.err << many.out;
    EXPECT_EQ(json_value(summary("one"), "trace_hash").size(), 32u);
    EXPECT_EQ(json_value(summary("many"), "trace_hash"), json_value(summary("one"), "trace_hash"))
        << last;
  }
  EXPECT_EQ(leftovers(), "");
}

TEST_F(FaultyProcesses, ABadFaultIsOneClearError) {
  for (const auto& [fault, message] : std::vector<std::pair<std::string, std::string>>{
           {"drive Q mute", "no such node"}, {"probe kill", "needs processes"}}) {
    const Said said = run("bad", "--in-process --fault \"" + fault + "\"");
    EXPECT_EQ(said.code, 2);
    EXPECT_NE(said.err.find(message), std::string::npos) << said.err;
    EXPECT_FALSE(fs::exists(scratch_ / "bad"));
  }
}

}  // namespace
}  // namespace vcnc::fault_test
