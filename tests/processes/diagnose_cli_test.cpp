// `vcnc import` and `vcnc diagnose` as their users start them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "tests/processes/shell.hpp"

namespace vcnc::diagnose_cli_test {
namespace {

constexpr double kPi2 = 2 * std::numbers::pi;

class DiagnoseCli : public testing::Test {
 protected:
  DiagnoseCli() {
    write_text(scratch_ / "machine.toml", "name = \"bench\"\n");
    write_text(scratch_ / "map.toml",
               "machine = \"machine.toml\"\n[time]\ncolumn = \"t\"\nunit = \"ms\"\n"
               "[[signals]]\ncolumn = \"A\"\nkind = \"cosine\"\naxis = \"x\"\nunit = \"V\"\n"
               "[[signals]]\ncolumn = \"B\"\nkind = \"sine\"\naxis = \"x\"\nunit = \"V\"\n");
    write_text(scratch_ / "good.csv", encoder(0));
    write_text(scratch_ / "bad.csv", encoder(0.05));
  }

  /// An encoder whose sine is larger than its cosine by a share of `gain`.
  static std::string encoder(double gain) {
    std::string text = "t,A,B\n";
    for (int k = 0; k < 5000; ++k) {
      const double phi = 10 * kPi2 * std::sin(kPi2 * k / 5000);
      const double noise = 1e-3 * std::sin(12.9898 * k * k);
      text += fmt::format("{},{:.6f},{:.6f}\n", k, 0.5 * std::cos(phi) + noise,
                          0.5 * (1 + gain) * std::sin(phi) - noise);
    }
    return text;
  }
  Said vcnc(const std::string& arguments) { return shell(scratch_, bin("vcnc") + " " + arguments); }
  void expect_refused(const std::string& arguments, const std::string& sentence) {
    const Said said = vcnc(arguments);
    EXPECT_EQ(said.code, 2) << arguments;
    EXPECT_NE(said.err.find(sentence), std::string::npos) << arguments << "\n" << said.err;
    EXPECT_EQ(said.err.find('\n'), said.err.size() - 1) << "one line: " << said.err;
  }

  Scratch scratch_;
};

TEST_F(DiagnoseCli, ATableIsImportedAndDiagnosedWithPageModelAndJson) {
  const std::string record = scratch_ / "bad.h5", out = scratch_ / "why";
  const Said imported = vcnc("import " + (scratch_ / "bad.csv") + " --map " +
                             (scratch_ / "map.toml") + " --out " + record);
  ASSERT_EQ(imported.code, 0) << imported.err;
  EXPECT_NE(imported.out.find("5000 samples"), std::string::npos) << imported.out;
  EXPECT_NE(imported.out.find("cosine x"), std::string::npos) << imported.out;
  for (int i = 0; i < 2; ++i) {  // the second replaces the first
    const Said said = vcnc("diagnose " + record + " --out " + out);
    ASSERT_EQ(said.code, 0) << said.err;
    EXPECT_EQ(said.out.find("EXPLAINED: "), 0u) << said.out;
    EXPECT_NE(said.out.find("probe.signal_gain (of the measurement): gain_percent.x = "),
              std::string::npos)
        << said.out;
  }
  const std::string json = read_text(out + "/diagnosis.json");
  EXPECT_EQ(json_value(json, "verdict"), "EXPLAINED");
  EXPECT_EQ(json_value(json, "name"), "signal_gain");
  const std::string page = read_text(out + "/report.html");
  EXPECT_NE(page.find("signal_gain"), std::string::npos);
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(read_text(out + "/found.toml").find("[effects.probe.signal_gain]"), std::string::npos);
  // What was found is a machine that vcnc reads.
  EXPECT_EQ(vcnc("check " + (scratch_ / "none.ngc") + " --machine " + out + "/found.toml").code, 2);
  write_text(scratch_ / "none.ngc", "G90 G21\nM30\n");
  const Said checked =
      vcnc("check " + (scratch_ / "none.ngc") + " --machine " + out + "/found.toml");
  EXPECT_EQ(checked.code, 0) << checked.err;
}

TEST_F(DiagnoseCli, TheTableItselfWithItsMapGivesTheSameVerdict) {
  const Said said =
      vcnc("diagnose " + (scratch_ / "good.csv") + " --map " + (scratch_ / "map.toml"));
  ASSERT_EQ(said.code, 0) << said.err;
  EXPECT_EQ(said.out.find("NO DEVIATION: "), 0u) << said.out;
}

/// A record of one axis is not told what other axes cannot show.
TEST_F(DiagnoseCli, OnlyAxesOfTheRecordAreCandidatesAndARunIsNoReferenceOfItself) {
  std::string text = "t,told,is\n";
  for (int k = 0; k < 4000; ++k) {
    const double x = 10 * (1 - std::cos(kPi2 * k / 1000));
    text += fmt::format("{},{:.7f},{:.7f}\n", k, x, x + 1e-5 * std::sin(12.9898 * k * k));
  }
  write_text(scratch_ / "axis.csv", text);
  write_text(scratch_ / "axis.toml",
             "machine = \"machine.toml\"\n[time]\ncolumn = \"t\"\nunit = \"ms\"\n"
             "[[signals]]\ncolumn = \"told\"\nkind = \"command\"\naxis = \"X\"\nunit = \"mm\"\n"
             "[[signals]]\ncolumn = \"is\"\nkind = \"position\"\naxis = \"X\"\nunit = \"mm\"\n");
  const Said said = vcnc("diagnose " + (scratch_ / "axis.csv") + " --map " +
                         (scratch_ / "axis.toml") + " --out " + (scratch_ / "axis"));
  ASSERT_EQ(said.code, 0) << said.err;
  EXPECT_EQ(said.out.find("NO DEVIATION: "), 0u) << said.out;
  const std::string json = read_text(scratch_ / "axis/diagnosis.json");
  EXPECT_NE(json.find("\"X.coulomb\""), std::string::npos);
  EXPECT_EQ(json.find("\"Y.coulomb\""), std::string::npos);

  const Said itself =
      vcnc("diagnose " + (scratch_ / "axis.csv") + " --reference " + (scratch_ / "axis.csv") +
           " --suspect X.coulomb --map " + (scratch_ / "axis.toml"));
  EXPECT_NE(itself.out.find("warning: The reference run holds the same values"), std::string::npos)
      << itself.out << itself.err;
  EXPECT_EQ(said.out.find("The reference run"), std::string::npos);
  EXPECT_EQ(itself.out.find("declared otherwise"), std::string::npos);

  const std::string of_y = " --map " + (scratch_ / "axis.toml") + " --suspect ";
  for (const char* suspect : {"Y.backlash", "axes.Y.load_kg"})
    expect_refused("diagnose " + (scratch_ / "axis.csv") + of_y + suspect, "holds nothing of Y");

  // A test run of another machine.
  write_text(scratch_ / "other.toml",
             read_text(scratch_ / "machine.toml") + "\n[axes.Y]\nkv_per_s = 33\n");
  std::string map = read_text(scratch_ / "axis.toml");
  write_text(scratch_ / "other_map.toml", map.replace(map.find("machine.toml"), 12, "other.toml"));
  ASSERT_EQ(vcnc("import " + (scratch_ / "axis.csv") + " --map " + (scratch_ / "other_map.toml") +
                 " --out " + (scratch_ / "other.h5"))
                .code,
            0);
  const Said other =
      vcnc("diagnose " + (scratch_ / "axis.csv") + " --test " + (scratch_ / "other.h5") +
           " --suspect X.coulomb --map " + (scratch_ / "axis.toml"));
  EXPECT_NE(other.out.find("is declared otherwise than that of"), std::string::npos)
      << other.out << other.err;
  EXPECT_NE(other.out.find("axes.Y.kv_per_s is 33"), std::string::npos) << other.out;
}

TEST_F(DiagnoseCli, RefusesWhatItCannotUseAndLeavesNothingBehind) {
  const std::string table = scratch_ / "bad.csv", map = scratch_ / "map.toml";
  expect_refused("diagnose " + table, "a table needs --map");
  expect_refused("diagnose " + table + " --map " + map + " --suspect X.rust",
                 "--suspect, --without: are for machines");
  expect_refused("diagnose " + (scratch_ / "none.h5"), "no such file or folder");
  expect_refused("import " + table + " --map " + map, "--out: is missing");
  expect_refused("import " + table + " --map " + map + " --out " + map,
                 "exists and is no record of vcnc import");
  write_text(scratch_ / "wrong.toml",
             "[time]\ncolumn = \"t\"\nunit = \"ms\"\n[[signals]]\ncolumn = \"A\"\nkind = "
             "\"cosine\"\naxis = \"x\"\nunit = \"mm\"\n");
  expect_refused(
      "import " + table + " --map " + (scratch_ / "wrong.toml") + " --out " + (scratch_ / "new.h5"),
      "wrong.toml:8: signals.unit: \"mm\" does not fit");
  EXPECT_FALSE(fs::exists(scratch_ / "new.h5"));
  fs::create_directory(scratch_ / "mine");
  write_text(scratch_ / "mine/thesis.txt", "do not lose");
  expect_refused("diagnose " + table + " --map " + map + " --out " + (scratch_ / "mine"),
                 "holds other files");
  EXPECT_EQ(read_text(scratch_ / "mine/thesis.txt"), "do not lose");
}

TEST_F(DiagnoseCli, RunsAreComparedLessTheHealthyOneOfTheirProgram) {
  const std::string machine = std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml";
  // X has no friction but what is put in.
  const auto run = [&](const std::string& name, const std::string& far, int friction_N) {
    write_text(scratch_ / "strokes.ngc",
               "G21 G90 G94\nG1 X" + far + " F3000\nX0\nX" + far + "\nX0\nM30\n");
    const std::string out = scratch_ / name;
    const Said ran = vcnc("run " + (scratch_ / "strokes.ngc") + " --machine " + machine +
                          fmt::format(" --inject X.coulomb.level_N={}", friction_N) +
                          " --in-process --no-report --out " + out);
    EXPECT_EQ(ran.code, 0) << ran.err;
    return out;
  };
  const std::string sick = run("sick", "10", 200), sicker = run("sicker", "10", 400),
                    longer = run("longer", "20", 400);
  // RMS of what the declared machine is off the force of X.
  const auto off = [&](const std::string& of, const std::string& more) {
    const Said said =
        vcnc("diagnose " + sick + " --model " + machine + " --compare-only " + machine + more);
    EXPECT_EQ(said.code, 0) << said.err;
    std::size_t row = said.out.find("force X");
    while (row != std::string::npos &&
           said.out.substr(row, said.out.find('\n', row) - row).find(" " + of + " ") ==
               std::string::npos)
      row = said.out.find("force X", row + 1);
    EXPECT_NE(row, std::string::npos) << of << " in " << said.out;
    return row == std::string::npos
               ? -1.0
               : std::stod(said.out.substr(said.out.find(of, row) + of.size()));
  };
  const std::string less = " --reference " + sick,
                    tests = " --test " + sicker + " --test " + longer;
  const Said suspicion = vcnc("diagnose " + sicker + " --reference " + sick + " --model " +
                              machine + " --suspect X.coulomb");
  EXPECT_EQ(suspicion.code, 0) << suspicion.err;
  EXPECT_NE(suspicion.out.find("sought: nothing but X.coulomb"), std::string::npos)
      << suspicion.out;
  expect_refused("diagnose " + sicker + " --model " + machine + " --suspect X.rust",
                 "--suspect: \"X.rust\" is no effect");
  expect_refused("diagnose " + sicker + " --compare-only " + machine + " --suspect X.coulomb",
                 "--compare-only: compares two models and writes nothing");
  expect_refused("diagnose " + sicker + " --suspect X.coulomb --test " + (scratch_ / "nowhere"),
                 "nowhere: no such file");
  const std::string head = std::string(VCNC_SOURCE_DIR) + "/configs/machines/head.toml";
  expect_refused("diagnose " + sicker + " --model " + head, "on a machine of another type");
  write_text(scratch_ / "rest.ngc", "G21 G90 G94\nG4 P1\nM30\n");
  const auto resting = [&](const std::string& name, const std::string& on) {
    const std::string out = scratch_ / name;
    EXPECT_EQ(vcnc("run " + (scratch_ / "rest.ngc") + " --machine " + on +
                   " --in-process --no-report --out " + out)
                  .code,
              0);
    return out;
  };
  expect_refused("diagnose " + sicker + " --test " + resting("headed", head),
                 "on a machine of other kinematics");
  expect_refused("commission " + resting("rest", machine) + " --out " + (scratch_ / "learnt.toml"),
                 "no axis moves");
  EXPECT_FALSE(fs::exists(scratch_ / "learnt.toml"));
  // Nothing of the user's is lost where a machine is written.
  const std::string recording = sicker + "/recording.h5", before = read_text(recording);
  expect_refused("commission " + sicker + " --model " + machine + " --out " + recording,
                 "exists and is no machine file");
  expect_refused("commission " + sicker + " --out " + (scratch_ / "no/where.toml"),
                 "there is no folder");
  EXPECT_EQ(read_text(recording), before);
  expect_refused("compensate " + sick + "/machine.toml --out " + sick + "/machine.toml",
                 "is the machine itself");
  EXPECT_GT(off("run", ""), 150);
  EXPECT_NEAR(off("run", less), 0, 1e-6);  // the healthy run is as far off
  const double alone = off(sicker, tests);
  EXPECT_GT(alone, 300);
  EXPECT_NEAR(off(sicker, less + tests), alone / 2, 0.01 * alone);
  EXPECT_GT(off(longer, less + tests), 300);  // of another program: as it is
}

/// A gap that nothing holds is no better for being compensated, and of one that is held a spike is
/// left.
TEST_F(DiagnoseCli, CompensationSaysWhereItDoesHarm) {
  const auto measured = [&](const std::string& changes) {
    return vcnc("compensate " + std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml " +
                changes + " --measure")
        .out;
  };
  const std::string loose = measured("--set axes.X.feedback=motor --inject X.backlash.gap_um=6");
  EXPECT_NE(loose.find("warning: circle, CCW: the settings make it worse"), std::string::npos)
      << loose;
  const std::string held = measured("--inject Y.load_play.width_um=3");
  EXPECT_EQ(held.find("worse"), std::string::npos) << held;
  EXPECT_NE(held.find("note: circle, CCW: the largest error grows"), std::string::npos) << held;
  const std::string good = measured("--inject X.coulomb.level_N=200");
  EXPECT_EQ(good.find("note:"), std::string::npos) << good;
  EXPECT_EQ(good.find("warning:"), std::string::npos) << good;
}

TEST_F(DiagnoseCli, WhatWasImportedWithoutAMachineIsCheckedWithTheModel) {
  std::string table = "t,cmd,pos,F\n";
  for (int k = 0; k < 4000; ++k) {
    const auto at = [&](double t) { return 100e-3 * std::sin(kPi2 * t / 2); };
    const double t = 1e-3 * k, a = -100e-3 * kPi2 * kPi2 / 4 * std::sin(kPi2 * t / 2);
    table += fmt::format("{},{},{},{}\n", t, at(t), at(t - 4e-3), 500 * a);
  }
  write_text(scratch_ / "far.csv", table);
  std::string map = "[time]\ncolumn = \"t\"\nunit = \"s\"\n";
  for (const char* kind : {"cmd\"\nkind = \"command", "pos\"\nkind = \"position"})
    map += fmt::format("[[signals]]\ncolumn = \"{}\"\naxis = \"X\"\nunit = \"m\"\nscale = 1000\n",
                       kind);
  write_text(scratch_ / "far.toml", map);
  const std::string record = scratch_ / "far.h5";
  const Said imported = vcnc("import " + (scratch_ / "far.csv") + " --map " +
                             (scratch_ / "far.toml") + " --out " + record);
  ASSERT_EQ(imported.code, 0) << imported.err;
  EXPECT_NE(
      imported.out.find("The map names no machine: travels, speeds, forces, inertias and readings "
                        "are not checked until vcnc diagnose has the model."),
      std::string::npos)
      << imported.out;
  const std::string model = scratch_ / "machine.toml", travel = "the declared travel is";
  expect_refused("diagnose " + record + " --model " + model, travel);
  expect_refused("commission " + record + " --model " + model + " --out " + (scratch_ / "new.toml"),
                 travel);
}

/// Two laps of a circle as a grid encoder sees it.
class GridEncoderCli : public DiagnoseCli {
 protected:
  GridEncoderCli() {
    write_text(scratch_ / "small.csv", circles(20));
    write_text(scratch_ / "large.csv", circles(30));
    for (const char* zero : {"90", "80"})
      write_text(scratch_ / ("zero" + std::string(zero) + ".toml"), map(zero));
  }
  static std::string circles(double radius_mm) {
    std::string text = "t,X,Y,Z,x,y\n";
    for (int k = 0; k < 5200; ++k) {
      const double turned = kPi2 * std::clamp(k - 100, 0, 5000) / 2500;
      const double x = 90 + radius_mm * std::cos(turned), y = 90 + radius_mm * std::sin(turned);
      const double noise = 1e-4 * std::sin(12.9898 * k * k);
      text += fmt::format("{},{:.6f},{:.6f},260,{:.4f},{:.4f}\n", k, x, y, 1e3 * (x - 90 + noise),
                          1e3 * (y - 90 - noise));
    }
    return text;
  }
  static std::string map(const std::string& zero_of_x) {
    std::string text = "machine = \"machine.toml\"\n[time]\ncolumn = \"t\"\nunit = \"ms\"\n";
    for (const char* axis : {"X", "Y", "Z"})
      text += fmt::format(
          "[[signals]]\ncolumn = \"{0}\"\nkind = \"command\"\naxis = \"{0}\"\nunit = \"mm\"\n",
          axis);
    for (const char* axis : {"x", "y"})
      text += fmt::format(
          "[[signals]]\ncolumn = \"{0}\"\nkind = \"tool_position\"\naxis = \"{0}\"\nunit = "
          "\"um\"\n",
          axis);
    return text + "[tool_position]\nzero_mm = [" + zero_of_x + ", 90, 260]\n";
  }
};

TEST_F(GridEncoderCli, AnImportRefusesReadingsThatTheMachineOfItsMapCannotMake) {
  const std::string table = "import " + (scratch_ / "small.csv") + " --map ";
  const std::string record = scratch_ / "run.h5";
  expect_refused(table + (scratch_ / "zero80.toml") + " --out " + record,
                 "\"x\" (tool position x) is -10 mm off what the machine of the model would read");
  EXPECT_FALSE(std::filesystem::exists(record));
  const Said said = vcnc(table + (scratch_ / "zero90.toml") + " --out " + record);
  EXPECT_EQ(said.code, 0) << said.err;
  EXPECT_TRUE(std::filesystem::exists(record));
}

TEST_F(GridEncoderCli, AReferenceThatCannotBeComparedIsRefusedBeforeAnythingIsSought) {
  const std::string out = scratch_ / "why";
  expect_refused("diagnose " + (scratch_ / "small.csv") + " --reference " +
                     (scratch_ / "large.csv") + " --map " + (scratch_ / "zero90.toml") + " --out " +
                     out,
                 "large.csv: does none of the motions of");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(DiagnoseCli, TheMapHasItsReference) {
  const Said said = vcnc("import --keys");
  EXPECT_EQ(said.code, 0);
  EXPECT_NE(said.out.find("`signals.unit`"), std::string::npos);
}

}  // namespace
}  // namespace vcnc::diagnose_cli_test
