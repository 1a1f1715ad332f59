// The programs as their users start them: one hash over every layout, failures by name, no orphans.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

#include "apps/launcher.hpp"
#include "bus/hub.hpp"
#include "tests/processes/shell.hpp"

namespace vcnc::vcnc_test {
namespace {

const std::string kMachine = configs("machines/trunnion_measured.toml");

/// A five-axis program of some simulated seconds with contact on the rim.
std::string short_program() {
  return "%\n(short)\nG54 G90 G17 G21 G94 G40 G49\nG64 P0.01\nM19\nG0 A7.88 C173.92\nG43.4 H1\n"
         "G0 X115.4 Y38.43 Z79\nG0 Z20\nG1 X110.8 Y35.44 F1000\n"
         "G1 X106.54 Y41.23 A8.245 C176.62 F1500\nG1 X110.8 Y35.44 A7.88 C173.92\nG1 X115.4 "
         "Y38.43\n"
         "G0 Z79\nG49\nM30\n%\n";
}

class Vcnc : public testing::Test {
 protected:
  Vcnc() { write_text(scratch_ / "short.ngc", short_program()); }

  Said run(const std::string& out, const std::string& options) {
    return shell(scratch_, bin("vcnc") + " run " + (scratch_ / "short.ngc") + " --machine " +
                               kMachine + " --no-report --out " + (scratch_ / out) + " " + options);
  }
  std::string hash(const std::string& out) {
    return json_value(read_text(scratch_ / (out + "/summary.json")), "trace_hash");
  }

  /// Processes that still mention this test's folder on their command line.
  std::string leftovers() {
    return shell(scratch_, "pgrep -af " + (scratch_ / "") + " | grep -v pgrep | grep -v 'sh -c'")
        .out;
  }

  Scratch scratch_;
};

TEST_F(Vcnc, OneHashInOneProcessAndInManyFreeAndPaced) {
  ASSERT_EQ(run("a", "--in-process").code, 0);
  ASSERT_EQ(run("b", "").code, 0);
  ASSERT_EQ(run("c", "--pace 5").code, 0);
  ASSERT_EQ(run("d", "--bus inproc://").code, 0);
  EXPECT_EQ(hash("a").size(), 32u);
  for (const char* other : {"b", "c", "d"}) EXPECT_EQ(hash("a"), hash(other)) << other;
  EXPECT_EQ(leftovers(), "");
}

/// The program goes on from what the probe has told, over the bus.
TEST_F(Vcnc, AProbingProgramHasOneHashInOneProcessAndInMany) {
  write_text(scratch_ / "wall.toml",
             "name = \"wall\"\nkind = \"plane\"\ncentre_mm = [20, 0, 0]\n"
             "direction = [1, 0, 0]\nradius_mm = 100\n");
  write_text(scratch_ / "short.ngc",
             "G38.2 X15 F1500\n#1=#5061\nG0 X30\nG1 X[#1+1] F1500\nG4 P0.01\nM30\n");
  const std::string wall = " --set setup.piece=" + (scratch_ / "wall.toml") +
                           " --set axes.X.start_mm=30 --set axes.Z.start_mm=250";
  ASSERT_EQ(run("a", "--in-process" + wall).code, 0);
  ASSERT_EQ(run("b", wall).code, 0);
  ASSERT_EQ(run("c", "--bus inproc://" + wall).code, 0);
  EXPECT_EQ(hash("a").size(), 32u);
  for (const char* other : {"b", "c"}) EXPECT_EQ(hash("a"), hash(other)) << other;
}

TEST_F(Vcnc, TheSeedIsPartOfTheScenario) {
  ASSERT_EQ(run("a", "--in-process --seed 1").code, 0);
  ASSERT_EQ(run("b", "--in-process --seed 2").code, 0);
  EXPECT_NE(hash("a"), hash("b"));
}

/// Starts the modules itself, in another order each time, and stops and continues them at random.
TEST_F(Vcnc, StartOrderAndHostDelaysDoNotChangeTheHash) {
  ASSERT_EQ(run("reference", "--in-process").code, 0);
  const std::string machine = scratch_ / "reference/machine.toml";
  std::mt19937 random(7);
  for (int round = 0; round < 2; ++round) {
    const std::string bus = scratch_ / ("bus" + std::to_string(round)),
                      truth = scratch_ / ("truth" + std::to_string(round));
    const std::string out = "round" + std::to_string(round);
    ::setenv("VCNC_DDS_TAG", ("vcnc-test-" + std::to_string(::getpid()) + out).c_str(), 1);
    Hub hub(bus);
    std::vector<std::pair<std::string, std::vector<std::string>>> modules;
    for (const char* axis : {"X", "Y", "Z", "A", "C", "spindle"})
      modules.push_back({std::string("drive ") + axis,
                         {bin("vcnc-drive"), "--machine", machine, "--bus", "hub://" + bus,
                          "--truth", truth, "--axis", axis}});
    modules.push_back({"probe",
                       {bin("vcnc-probe"), "--machine", machine, "--bus", "hub://" + bus, "--truth",
                        truth, "--seed", "1"}});
    modules.push_back(
        {"overtravel", {bin("vcnc-overtravel"), "--machine", machine, "--bus", "hub://" + bus}});
    modules.push_back({"analysis", {bin("vcnc-analysis"), "--out", scratch_ / out, "--no-report"}});
    std::shuffle(modules.begin(), modules.end(), random);
    Launcher launcher;
    for (const auto& [name, argv] : modules) launcher.start(name, argv);
    launcher.wait_all_ready(30000);
    launcher.start("NC unit", {bin("vcnc-nc"), "--machine", machine, "--program",
                               scratch_ / "short.ngc", "--bus", "hub://" + bus});
    while (launcher.running() > 0) {
      const auto& victim = modules[random() % modules.size()].first;
      launcher.signal(victim, SIGSTOP);
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % 20));
      launcher.signal(victim, SIGCONT);
      const auto exited = launcher.next(5, nullptr);
      if (!exited) continue;
      EXPECT_EQ(exited->code, 0) << exited->sentence();
    }
    EXPECT_EQ(hash(out), hash("reference")) << out;
  }
}

TEST_F(Vcnc, AnalyzeGivesTheNumbersOfTheLiveRun) {
  ASSERT_EQ(run("live", "").code, 0);
  const Said said = shell(
      scratch_, bin("vcnc") + " analyze " + (scratch_ / "live") + " --out " + (scratch_ / "again"));
  ASSERT_EQ(said.code, 0) << said.err;
  EXPECT_EQ(read_text(scratch_ / "live/summary.json"), read_text(scratch_ / "again/summary.json"));
}

class RunningMachine : public Vcnc {
 protected:
  /// Starts a long paced run in the background and waits until it records.
  void start() {
    write_text(scratch_ / "long.ngc", "G90 G21\nM19\nG4 P60\nM30\n");
    child_ = ::fork();
    if (child_ == 0) {
      const int err = ::open((scratch_ / "err").c_str(), O_CREAT | O_WRONLY, 0600);
      ::dup2(err, 2);
      ::dup2(::open("/dev/null", O_WRONLY), 1);
      ::execl(bin("vcnc").c_str(), "vcnc", "run", (scratch_ / "long.ngc").c_str(), "--machine",
              kMachine.c_str(), "--pace", "2", "--no-report", "--out", (scratch_ / "run").c_str(),
              nullptr);
      ::_exit(127);
    }
    for (int i = 0; i < 200 && size_of(scratch_ / "run/recording.h5.partial") < 500000; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  int wait() {
    int status = 0;
    ::waitpid(child_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  pid_t child_ = -1;
};

TEST_F(RunningMachine, AKilledDriveEndsTheRunByName) {
  start();
  shell(scratch_, "pkill -9 -f 'vcnc-driv[e].*" + (scratch_ / "run") + ".*--axis Y'");
  EXPECT_EQ(wait(), 1);
  const std::string err = read_text(scratch_ / "err");
  EXPECT_NE(err.find("drive Y: killed by signal 9"), std::string::npos) << err;
  EXPECT_EQ(leftovers(), "");
  const Said said = shell(scratch_, bin("vcnc") + " analyze " + (scratch_ / "run"));
  EXPECT_EQ(said.code, 0) << said.err;
  EXPECT_NE(read_text(scratch_ / "run/summary.json").find("drive Y"), std::string::npos);
}

TEST_F(RunningMachine, AKilledAnalysisLeavesARecordingThatOpens) {
  start();
  shell(scratch_, "pkill -9 -f 'vcnc-analysi[s].*" + (scratch_ / "run") + "'");
  EXPECT_EQ(wait(), 1);
  EXPECT_NE(read_text(scratch_ / "err").find("analysis: killed by signal 9"), std::string::npos);
  EXPECT_EQ(leftovers(), "");
  const Said said = shell(scratch_, bin("vcnc") + " analyze " + (scratch_ / "run"));
  EXPECT_EQ(said.code, 0) << said.err;
  EXPECT_NE(said.err.find("missing"), std::string::npos);
}

TEST_F(RunningMachine, AKilledNcUnitIsNamedAndNotItsVictims) {
  start();
  shell(scratch_, "pkill -9 -f 'vcnc-n[c].*" + (scratch_ / "run") + "'");
  EXPECT_EQ(wait(), 1);
  const std::string err = read_text(scratch_ / "err");
  EXPECT_NE(err.find("NC unit: killed by signal 9"), std::string::npos) << err;
  EXPECT_EQ(leftovers(), "");
}

TEST_F(RunningMachine, ASecondRunIntoTheSameFolderIsRefused) {
  start();
  const Said said = run("run", "");
  EXPECT_EQ(said.code, 2);
  EXPECT_NE(said.err.find("another run is writing here"), std::string::npos) << said.err;
  ::kill(child_, SIGINT);
  EXPECT_EQ(wait(), 130);
}

TEST_F(RunningMachine, CtrlCEndsARunWhoseAnalysisIsStuck) {
  start();
  shell(scratch_, "pkill -STOP -f 'vcnc-analysi[s].*" + (scratch_ / "run") + "'");
  ::kill(child_, SIGINT);
  EXPECT_EQ(wait(), 130);
  EXPECT_EQ(leftovers(), "");
}

TEST_F(Vcnc, AnEarlyCtrlCEndsAtOnce) {
  for (const char* delay : {"0.02", "0.1", "0.3"}) {
    const Said said =
        shell(scratch_, "timeout -s INT " + std::string(delay) + " " + bin("vcnc") + " run " +
                            (scratch_ / "short.ngc") + " --machine " + kMachine +
                            " --pace 1 --no-report --out " + (scratch_ / "early"));
    EXPECT_NE(said.code, 0);
    EXPECT_EQ(leftovers(), "") << delay;
  }
}

TEST_F(Vcnc, InputsInTheFolderOfResultsAreNeverLost) {
  ASSERT_EQ(run("a", "--in-process").code, 0);
  const std::string machine = read_text(scratch_ / "a/machine.toml");
  const Said said = shell(scratch_, bin("vcnc") + " run " + (scratch_ / "short.ngc") +
                                        " --machine " + (scratch_ / "a/machine.toml") +
                                        " --in-process --out " + (scratch_ / "a"));
  EXPECT_EQ(said.code, 2);
  EXPECT_NE(said.err.find("is an input of this run"), std::string::npos) << said.err;
  EXPECT_EQ(read_text(scratch_ / "a/machine.toml"), machine);
  EXPECT_TRUE(fs::exists(scratch_ / "a/recording.h5"));

  fs::create_directory(scratch_ / "mine");
  write_text(scratch_ / "mine/machine.toml", "name = \"my own\"\n");
  EXPECT_EQ(run("mine", "--in-process").code, 2);
  EXPECT_EQ(read_text(scratch_ / "mine/machine.toml"), "name = \"my own\"\n");
}

TEST_F(RunningMachine, CtrlCEndsInOrder) {
  start();
  ::kill(child_, SIGINT);
  EXPECT_EQ(wait(), 130);
  EXPECT_EQ(leftovers(), "");
  EXPECT_NE(read_text(scratch_ / "run/summary.json").find("stopped by the operator"),
            std::string::npos);
}

TEST_F(RunningMachine, AKilledLauncherLeavesNoOrphans) {
  start();
  ::kill(child_, SIGKILL);
  wait();
  for (int i = 0; i < 100 && !leftovers().empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(leftovers(), "");
}

// ------------------------------------------------------------------------------ bad input

struct BadInput {
  const char* name;
  const char* options;  ///< instead of the good ones; {S} is the scratch folder
  int code;
  const char* message;
};

class BadRun : public Vcnc, public testing::WithParamInterface<BadInput> {};

TEST_P(BadRun, IsOneClearErrorAndLeavesNothing) {
  write_text(scratch_ / "error.ngc", "G90 G21\nG1 X1 F100\nG1 Y2\nG12.7 X3\nM30\n");
  write_text(scratch_ / "far.ngc", "G90 G21\nG0 X0\nG1 X4000 F1000\nM30\n");
  write_text(scratch_ / "bad.toml", "name = \"x\"\n[axes.X]\nvelocity_m_s = 1\n");
  write_text(scratch_ / "surface.toml",
             "kind = \"ruled\"\ndegree = 3\nknots = [0, 0, 1, 1]\nbottom_mm = "
             "[[0,0,0],[1,0,0]]\ntop_mm = [[0,0,9],[1,0,9]]\n");
  fs::create_directory(scratch_ / "mine");
  write_text(scratch_ / "mine/thesis.tex", "precious");
  const std::string good =
      (scratch_ / "short.ngc") + " --machine " + kMachine + " --out " + (scratch_ / "out");
  std::string options = GetParam().options;
  for (const auto& [mark, value] : {std::pair<std::string, std::string>{"{S}", scratch_ / ""},
                                    {"{M}", kMachine},
                                    {"{GOOD}", good}})
    for (std::size_t at; (at = options.find(mark)) != std::string::npos;)
      options.replace(at, mark.size(), value);
  const Said said = shell(scratch_, bin("vcnc") + " run " + options);
  EXPECT_EQ(said.code, GetParam().code) << said.err;
  EXPECT_NE(said.err.find(GetParam().message), std::string::npos) << said.err;
  EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
  EXPECT_FALSE(fs::exists(scratch_ / "out"));
  EXPECT_TRUE(fs::exists(scratch_ / "mine/thesis.tex"));
  EXPECT_EQ(leftovers(), "");
}

INSTANTIATE_TEST_SUITE_P(
    All, BadRun,
    testing::Values(
        BadInput{"UnknownKey", "{GOOD} --set axes.X.speed=3", 2, "axes.X.speed: unknown key"},
        BadInput{"WrongUnit", "{S}short.ngc --machine {S}bad.toml --out {S}out", 2,
                 "bad.toml:3: axes.X.velocity_m_s: unknown key; did you mean velocity_mm_s?"},
        BadInput{"UnknownEffect", "{GOOD} --inject X.backlsh.gap_um=3", 2,
                 "--inject X.backlsh.gap_um=3: effects.X.backlsh: unknown key; did you mean "
                 "backlash?"},
        BadInput{"EffectOutOfRange", "{GOOD} --inject X.backlash.gap_um=3000", 2,
                 "allowed 0 .. 2000 um"},
        BadInput{"BadDeviation", "{GOOD} --inject axes.Y.load_kg=-1", 2,
                 "load_kg=-1: expected a number, 0.0001 .. 100000 kg"},
        BadInput{"OutOfRange", "{GOOD} --set axes.X.kv_per_s=-4", 2, "allowed 0.1 .. 1000 per_s"},
        BadInput{"NoMachine", "{S}short.ngc --machine {S}none.toml --out {S}out", 2,
                 "none.toml: cannot be opened"},
        BadInput{"NoProgram", "{S}none.ngc --machine {M} --out {S}out", 2, "none.ngc"},
        BadInput{"ErrorInTheMiddle", "{S}error.ngc --machine {M} --out {S}out", 2,
                 "error.ngc:4:1: "},
        BadInput{"AxisLimit", "{S}far.ngc --machine {M} --out {S}out", 2, "far.ngc:3:1: "},
        BadInput{"NoPiece", "{GOOD} --set setup.piece={S}none.toml", 2,
                 "none.toml: cannot be opened"},
        BadInput{"BadSurface", "{GOOD} --set setup.piece={S}surface.toml", 2, "surface.toml: "},
        BadInput{"NoBus", "{GOOD} --bus can://nosuchcan0", 2, "nosuchcan0"},
        BadInput{"UnknownBus", "{GOOD} --bus smoke://signals", 2, "smoke"},
        BadInput{"Seed", "{GOOD} --seed -1", 2, "expected a whole number"},
        BadInput{"DeepKey",
                 "{GOOD} --set "
                 "a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a."
                 "a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a=1",
                 2, "a key of more than"},
        BadInput{"NotAFile", "/dev/stdin --machine {M} --out {S}out", 2, "is not a regular file"},
        BadInput{"Pace", "{GOOD} --pace fast", 2, "expected free or a factor of real time"},
        BadInput{"ForeignFolder", "{S}short.ngc --machine {M} --out {S}mine", 2,
                 "holds other files"}),
    [](const auto& test) { return test.param.name; });

TEST_F(Vcnc, AnEmptyValueIsAMistake) {
  for (const char* arguments :
       {"run '' --machine m.toml --out o", "run p.ngc --machine m.toml --out ''",
        "run p.ngc --machine m.toml --out o --set ''", "lockout --only ''", "lockout --html ''",
        "gallery --out o --only ''", "compare a b --out ''", "program step --machine m --out ''"}) {
    const Said said = shell(scratch_, bin("vcnc") + " " + arguments);
    EXPECT_EQ(said.code, 2) << arguments;
    EXPECT_NE(said.err.find(": needs a value, \"\" is none"), std::string::npos) << said.err;
  }
}

TEST_F(Vcnc, AnEffectWithNothingToActOnIsToldAtTheBegin) {
  const std::string run = bin("vcnc") + " run " + (scratch_ / "short.ngc") + " --machine " +
                          configs("machines/trunnion.toml") + " --in-process --no-report --out " +
                          (scratch_ / "idle") + " --inject X.presliding.stiffness_N_per_um=25";
  const Said idle = shell(scratch_, run);
  EXPECT_EQ(idle.code, 0) << idle.err;
  EXPECT_NE(idle.err.find("warning: effects.X.presliding: does nothing"), std::string::npos)
      << idle.err;
  EXPECT_EQ(shell(scratch_, run + " --inject X.coulomb.level_N=50").err.find("warning"),
            std::string::npos);
}

TEST_F(Vcnc, EveryProgramExplainsItself) {
  for (const char* program :
       {"vcnc", "vcnc-nc", "vcnc-drive", "vcnc-probe", "vcnc-overtravel", "vcnc-analysis"}) {
    const Said help = shell(scratch_, bin(program) + " --help");
    EXPECT_EQ(help.code, 0) << program;
    EXPECT_GT(help.out.size(), 100u) << program;
    EXPECT_EQ(shell(scratch_, bin(program) + " --nonsense").code, 2) << program;
  }
}

TEST_F(Vcnc, EffectsAreListedShownAndExported) {
  const auto effects = [&](const std::string& options) {
    return shell(scratch_, bin("vcnc") + " effects " + options);
  };
  const Said table = effects("");
  EXPECT_EQ(table.code, 0);
  EXPECT_NE(table.out.find("  backlash "), std::string::npos);
  const Said page = effects("show backlash");
  EXPECT_EQ(page.code, 0);
  EXPECT_NE(page.out.find("--inject X.backlash.gap_um=10\n"), std::string::npos) << page.out;
  const Said json = effects("--json");
  EXPECT_EQ(json.code, 0);
  EXPECT_EQ(json.out.substr(0, 11), "{\"effects\":");
  EXPECT_EQ(effects("--markdown").out,
            read_text(std::string(VCNC_SOURCE_DIR) + "/docs/effects.md"));
  const Said unknown = effects("show backlas");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_EQ(unknown.out, "");
  EXPECT_EQ(unknown.err,
            "vcnc: vcnc effects show backlas: no such effect; did you mean backlash?\n");
  EXPECT_EQ(effects("show").code, 2);
  EXPECT_EQ(effects("--json --markdown").code, 2);
}

/// What is injected is in the machine as run, changes the run, and is no secret to its folder.
TEST_F(Vcnc, InjectionsAreInTheRunInEveryLayout) {
  ASSERT_EQ(run("plain", "--in-process").code, 0);
  const std::string options =
      "--inject Y.backlash.gap_um=12 --inject axes.X.load_kg=550 "
      "--inject 'probe.signal_offset.cosine_percent=[1, 2, 3]'";
  ASSERT_EQ(run("a", "--in-process " + options).code, 0);
  ASSERT_EQ(run("b", options).code, 0);
  EXPECT_EQ(hash("a"), hash("b"));
  EXPECT_NE(hash("a"), hash("plain"));
  const std::string machine = read_text(scratch_ / "a/machine.toml");
  EXPECT_NE(machine.find("[effects.Y.backlash]\ngap_um = 12.0\n"), std::string::npos);
  EXPECT_NE(machine.find("[[effects.deviation]]\nkey = \"axes.X.load_kg\"\nvalue = 550.0\n"),
            std::string::npos);
  EXPECT_NE(machine.find("\nload_kg = 500.0\n"), std::string::npos);
}

TEST_F(Vcnc, WritesOverNothingButItsOwn) {
  const std::string program = scratch_.write("mine.ngc", "G0 X1\nM30\n"),
                    machine = scratch_.write("mine.toml", "name = \"mine\"\n"),
                    on = " --machine " + configs("machines/trunnion.toml");
  for (const std::string& command :
       {" plan " + program + on + " --csv " + program,
        " interpret " + program + " --json " + machine,
        " program step" + on + " --axis X --step 1 --steps 1 --out " + program}) {
    const Said said = shell(scratch_, bin("vcnc") + command);
    EXPECT_EQ(said.code, 2) << command;
    EXPECT_NE(said.err.find("exists and is no earlier output of this command"), std::string::npos)
        << said.err;
  }
  EXPECT_EQ(read_text(program), "G0 X1\nM30\n");
  EXPECT_EQ(read_text(machine), "name = \"mine\"\n");
  const std::string csv = scratch_ / "plan.csv", json = scratch_ / "path.json",
                    step = scratch_ / "step.ngc";
  for (int twice = 0; twice < 2; ++twice)
    for (const std::string& command :
         {" plan " + program + on + " --csv " + csv, " interpret " + program + " --json " + json,
          " program step" + on + " --axis X --step 1 --steps 1 --out " + step})
      EXPECT_EQ(shell(scratch_, bin("vcnc") + command).code, 0) << command;
}

TEST_F(Vcnc, AFullDiskIsAFailureAndLeavesNothing) {
  const std::string on = " --machine " + configs("machines/trunnion.toml"),
                    program = scratch_.write("mine.ngc", "G1 F1000 X50\nM30\n");
  for (const char* command : {"keys", "effects --markdown", "plan"}) {
    const std::string words = command == std::string("plan") ? "plan " + program + on : command;
    const Said said = shell(scratch_, "(" + bin("vcnc") + " " + words + " > /dev/full)");
    EXPECT_EQ(said.code, 1) << words;
    EXPECT_NE(said.err.find("standard output: cannot be written"), std::string::npos) << said.err;
  }
  const std::string limited = "ulimit -f 1; trap '' XFSZ; " + bin("vcnc");
  for (const std::string& command : {" plan " + program + on + " --csv p.csv",
                                     " program diagnosis" + on + " --set setup.piece=" +
                                         configs("pieces/ring.toml") + " --out p.ngc"}) {
    const Said said = shell(scratch_, "(cd " + (scratch_ / "") + "; " + limited + command + ")");
    EXPECT_EQ(said.code, 1) << command << said.err;
    EXPECT_NE(said.err.find("cannot be written completely"), std::string::npos) << said.err;
  }
  for (const char* left : {"p.csv", "p.csv.partial", "p.ngc", "p.ngc.partial"})
    EXPECT_FALSE(std::filesystem::exists(scratch_ / left)) << left;
}

/// HDF5 looks at its files once more when a program ends.
TEST_F(Vcnc, AnImportToAFullDiskEndsWithItsMessage) {
  std::string table = "q,p\n";
  for (int k = 0; k < 3000; ++k) {
    const double q = 50 * std::sin(0.002 * k), p = 50 * std::sin(0.002 * (k - 4));
    table += std::to_string(q) + "," + std::to_string(p) + "\n";
  }
  scratch_.write("run.csv", table);
  scratch_.write("map.toml",
                 "[time]\nrate_hz = 1000\n"
                 "[[signals]]\ncolumn = \"q\"\nkind = \"command\"\naxis = \"X\"\nunit = \"mm\"\n"
                 "[[signals]]\ncolumn = \"p\"\nkind = \"position\"\naxis = \"X\"\nunit = \"mm\"\n");
  const std::string import = bin("vcnc") + " import run.csv --map map.toml --out run.h5",
                    in = "(cd " + (scratch_ / "") + "; ";
  const Said said = shell(scratch_, in + "ulimit -f 8; trap '' XFSZ; " + import + ")");
  EXPECT_EQ(said.code, 2) << said.err;
  EXPECT_NE(said.err.find("the record cannot be written: File too large"), std::string::npos)
      << said.err;
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "run.h5"));
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "run.h5.partial"));
  EXPECT_EQ(shell(scratch_, in + import + ")").code, 0);
}

TEST_F(Vcnc, ProgramsOfEveryKindRunOnBothKinematics) {
  for (const std::string machine : {"trunnion", "head"}) {
    const auto generate_and_run = [&](const std::string& kind, const std::string& piece) {
      const std::string file = scratch_ / (kind.substr(0, kind.find(' ')) + ".ngc");
      const std::string on = " --machine " + configs("machines/" + machine + ".toml") +
                             " --set setup.piece=" + configs("pieces/" + piece);
      Said said = shell(scratch_, bin("vcnc") + " program " + kind + on + " --out " + file);
      ASSERT_EQ(said.code, 0) << machine << " " << kind << ": " << said.err;
      said = shell(scratch_, bin("vcnc") + " run " + file + on +
                                 " --in-process --no-report --out " + (scratch_ / "run"));
      EXPECT_EQ(said.code, 0) << machine << " " << kind << ": " << said.err << said.out;
    };
    generate_and_run("s-piece --feed-mm-min 3000", "s_eq1.toml");
    generate_and_run("cone --feed-mm-min 3000", "cone.toml");
    generate_and_run("circle --feed-mm-min 3000", "ring.toml");
    generate_and_run("step --axis X --step 5 --steps 2 --dwell-s 0.2", "ring.toml");
  }
}

}  // namespace
}  // namespace vcnc::vcnc_test
