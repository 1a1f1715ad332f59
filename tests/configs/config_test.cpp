#include "configs/config.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/scratch.hpp"

namespace vcnc::config_test {
namespace {

const std::string kMachines = std::string(VCNC_SOURCE_DIR) + "/configs/machines/";

std::string error_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Config, ValuesInTheKeysUnitBecomeSi) {
  const Machine m = parse_machine(
      "[axes.X]\nvelocity_mm_s = 250\n[axes.A]\nmax_deg = 90\n[effects.X.backlash]\ngap_um = 10\n",
      "m");
  EXPECT_DOUBLE_EQ(m.axes[kX].limits.velocity, 0.25);
  EXPECT_DOUBLE_EQ(m.axes[kA].limits.max, kPi / 2);
  EXPECT_DOUBLE_EQ(m.effects.axis[kX].get<Backlash>().gap, 10e-6);
}

TEST(Config, AMachineFileThatSaysNothingIsNone) {
  const TemporaryFile empty("empty.toml", "# later\n");
  EXPECT_NE(error_of([&] { load_machine(empty.path()); }).find("empty.toml: says nothing"),
            std::string::npos);
}

TEST(Config, EveryShippedMachineLoadsWithItsPiece) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kMachines)) {
    const Machine m = load_machine(entry.path());
    const bool touches = !entry.path().filename().string().starts_with("ball_screw_axis");
    EXPECT_EQ(!m.setup.piece.empty(), touches) << entry.path();
    if (touches) {
      EXPECT_NO_THROW(load_piece(m.setup.piece)) << entry.path();
    }
    ++count;
  }
  EXPECT_GE(count, 3u);
}

/// What a diagnosis writes of a machine with one declared axis is about that axis.
TEST(Config, TablesOfDefaultsAreLeftOutOfABriefFile) {
  for (const auto& entry : std::filesystem::directory_iterator(kMachines)) {
    const Machine m = load_machine(entry.path());
    EXPECT_EQ(to_toml(parse_machine(brief_toml(m), "brief")), to_toml(m)) << entry.path();
  }
  const std::string brief = brief_toml(
      parse_machine("name = \"joint\"\n[axes.C]\nkv_per_s = 18\n[effects.C.coulomb]\nlevel_Nm = 1\n"
                    "[[uncertainty]]\nkey = \"axes.C.load_kgm2\"\nstandard = 1\n",
                    "m"));
  EXPECT_NE(brief.find("[axes.C]\nmin_deg = "), brief.npos) << brief;
  EXPECT_NE(brief.find("kv_per_s = 18.0\n"), brief.npos) << brief;
  EXPECT_NE(brief.find("[[uncertainty]]"), brief.npos) << brief;
  EXPECT_EQ(brief.find("[axes.X]"), brief.npos) << brief;
  EXPECT_EQ(brief.find("[probe]"), brief.npos) << brief;
  EXPECT_EQ(brief.find("[nc"), brief.npos) << brief;
}

TEST(Config, EveryShippedPieceLoads) {
  std::size_t count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(VCNC_SOURCE_DIR) + "/configs/pieces")) {
    EXPECT_NO_THROW(load_piece(entry.path())) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 5u);
}

TEST(Config, WritingAndReadingGivesTheSameBits) {
  Machine m = load_machine(kMachines + "trunnion.toml",
                           {"axes.C.velocity_deg_s=123.456", "effects.A.backlash.gap_arcsec=1.7",
                            "kinematics.a_axis_point_mm=[0.1, 0.2, 0.3]"});
  const Machine again = parse_machine(to_toml(m), "again");
  EXPECT_EQ(to_toml(again), to_toml(m));
  EXPECT_EQ(again.axes[kC].limits.velocity, m.axes[kC].limits.velocity);
  EXPECT_EQ(again.effects.axis[kA].get<Backlash>().gap, m.effects.axis[kA].get<Backlash>().gap);
  EXPECT_DOUBLE_EQ(again.effects.axis[kA].get<Backlash>().gap, 1.7 * kDegree / 3600);
  EXPECT_EQ(again.kinematics.p_MA, m.kinematics.p_MA);
}

TEST(Config, DeclaredMachineHasNoEffects) {
  const Machine m = declared(load_machine(kMachines + "trunnion_measured.toml"));
  EXPECT_EQ(m.effects.axis[kX].get<Coulomb>().level, 0);
  EXPECT_EQ(m.effects.axis[kC].get<Backlash>().gap, 0);
  EXPECT_EQ(m.axes[kX].limits.velocity,
            load_machine(kMachines + "trunnion_measured.toml").axes[kX].limits.velocity);
}

TEST(Config, AssignmentsOverrideTheFileInOrder) {
  const Machine m = load_machine(kMachines + "trunnion.toml",
                                 {"axes.Y.kv_per_s=38", "axes.Y.kv_per_s=39", "name=mine"});
  EXPECT_DOUBLE_EQ(m.axes[kY].servo.kv_per_s, 39);
  EXPECT_EQ(m.name, "mine");
}

struct BadCase {
  const char* assignment;
  const char* message;
};

class BadAssignment : public testing::TestWithParam<BadCase> {};

TEST_P(BadAssignment, IsRefusedWithKeyAndWhatIsAllowed) {
  const std::string error =
      error_of([&] { load_machine(kMachines + "trunnion.toml", {GetParam().assignment}); });
  EXPECT_NE(error.find(GetParam().message), std::string::npos) << error;
}

INSTANTIATE_TEST_SUITE_P(
    All, BadAssignment,
    testing::Values(BadCase{"axes.Y.kv=38",
                            "--set axes.Y.kv=38: axes.Y.kv: unknown key; did you mean kv_per_s?"},
                    BadCase{"axes.Y.velocity_m_s=1", "did you mean velocity_mm_s?"},
                    BadCase{"effects.X.backlash.gap_mm=0.01", "did you mean gap_um?"},
                    BadCase{"axes.Y.kv_per_s=fast", "expected a number in per_s"},
                    BadCase{"axes.Y.kv_per_s=true", "expected a number in per_s"},
                    BadCase{"axes.Y.kv_per_s=nan", "expected a finite number"},
                    BadCase{"axes.Y.kv_per_s=-1", "-1 is out of range, allowed 0.1 .. 1000 per_s"},
                    BadCase{"kinematics.type=hexapod", "expected one of \"trunnion\", \"head\""},
                    BadCase{"axes.W.kv_per_s=2",
                            "axes.W: unknown key; allowed here: A, C, X, Y, Z"},
                    BadCase{"setup.g54_mm=[1,2]", "expected 3 numbers, found 2"},
                    BadCase{"probe.in_spindle=1", "expected true or false"},
                    BadCase{"probe.adc_bits=12.5", "expected a whole number"},
                    BadCase{"probe.adc_bits=14", "allowed 12 or 16"},
                    BadCase{"axes=3", "axes: expected a table"},
                    BadCase{"axes.X.min_mm=900", "lower travel limit must be below"},
                    BadCase{"axes.X.start_mm=401", "start position is outside"},
                    BadCase{"setup.predeflection_mm=2.5", "must be below probe.range_mm"},
                    BadCase{"=3", "expected key=value"}, BadCase{"foo", "expected key=value"},
                    BadCase{"name=3", "expected a text in quotes"}));

struct BadInjection {
  std::vector<std::string> set;
  std::vector<std::string> inject;
  const char* message;
};

TEST(Config, EveryWrongInjectionIsOneSentenceThatSaysWhatIsAllowed) {
  for (const BadInjection& bad : std::vector<BadInjection>{
           {{},
            {"X.backlash.gap_um=5 um"},
            "--inject X.backlash.gap_um=5 um: effects.X.backlash.gap_um: expected a number in um, "
            "0 .. 2000"},
           {{},
            {"X.backlash.gap_um="},
            "--inject X.backlash.gap_um=: effects.X.backlash.gap_um: expected a number in um, 0 .. "
            "2000"},
           {{},
            {"X.back lash=1"},
            "--inject X.back lash=1: expected key=value with a key of words and points, and a "
            "number, true, false, a text or a list as value"},
           {{},
            {"kinematics.c_axis_point_mm=3"},
            "--inject kinematics.c_axis_point_mm=3: expected [x, y, z] in mm, or one component: "
            "kinematics.c_axis_point_mm.x, kinematics.c_axis_point_mm.y, "
            "kinematics.c_axis_point_mm.z"},
           {{},
            {"kinematics.c_axis_point_mm=[1, x, 3]"},
            "--inject kinematics.c_axis_point_mm=[1, x, 3]: expected [x, y, z] in mm, or one "
            "component: kinematics.c_axis_point_mm.x, kinematics.c_axis_point_mm.y, "
            "kinematics.c_axis_point_mm.z"},
           {{},
            {"kinematics.c_axis_point_mm=[1, true, 3]"},
            "--inject kinematics.c_axis_point_mm=[1, true, 3]: expected a number, -10000 .. 10000 "
            "mm"},
           {{},
            {"X.backlash.gap_um=5", "effects.X.backlash.gap_um=6"},
            "--inject effects.X.backlash.gap_um=6: the key is given twice"},
           {{"effects.X.backlash.gap_um=5"},
            {"X.backlash.gap_um=6"},
            "--inject X.backlash.gap_um=6: the same is given by --set effects.X.backlash.gap_um; "
            "one of them is too many"}})
    EXPECT_EQ(error_of([&] { load_machine(kMachines + "trunnion.toml", bad.set, bad.inject); }),
              bad.message);
  // The declared number is set, its true value is injected: two numbers.
  EXPECT_NO_THROW(
      load_machine(kMachines + "trunnion.toml", {"axes.Y.load_kg=400"}, {"axes.Y.load_kg=550"}));
}

TEST(Config, AVectorDeviatesAsAWhole) {
  const Machine m = load_machine(kMachines + "trunnion.toml", {},
                                 {"kinematics.c_axis_point_mm=[0.01, -0.02, 0.03]"});
  const Vec3 is = actual(m).kinematics.p_MC;
  EXPECT_EQ(is, Vec3(0.01e-3, -0.02e-3, 0.03e-3));
  EXPECT_NE(is, m.kinematics.p_MC);
  EXPECT_EQ(m.effects.deviations.size(), 3u);
}

TEST(Config, WhatCommissioningLeftIsKept) {
  const std::string text =
      "name = \"m\"\n[[commissioned]]\nsignal = \"force X\"\nleft_si = 7.5\n"
      "[[commissioned]]\nsignal = \"deflection x\"\nleft_si = 2e-7\n";
  const Machine m = parse_machine(to_toml(parse_machine(text, "m")), "again");
  ASSERT_EQ(m.commissioned.size(), 2u);
  EXPECT_EQ(m.commissioned[1].signal, "deflection x");
  EXPECT_EQ(m.commissioned[1].left, 2e-7);
  EXPECT_EQ(to_toml(Machine()).find("commissioned"), std::string::npos);
  EXPECT_EQ(
      error_of([] { parse_machine("name = \"m\"\n[[commissioned]]\nleft_si = -1\n", "m.toml"); }),
      "m.toml:3: commissioned.left_si: -1 is out of range, allowed 0 .. 1000000");
}

TEST(Config, WhatIsUncertainIsKept) {
  const std::string text =
      "name = \"m\"\n[[uncertainty]]\nkey = \"axes.X.kv_per_s\"\nstandard = 2\n"
      "between = [20, 60]\n[[uncertainty]]\nkey = \"axes.X.load_kg\"\n";
  const Machine m = parse_machine(to_toml(parse_machine(text, "m")), "again");
  ASSERT_EQ(m.uncertainties.size(), 2u);
  EXPECT_EQ(m.uncertainties[0].standard, 2);
  EXPECT_EQ(m.uncertainties[0].between, (std::vector<double>{20, 60}));
  EXPECT_FALSE(m.uncertainties[0].free());
  EXPECT_TRUE(m.uncertainties[1].exact());
  EXPECT_EQ(to_toml(Machine()).find("uncertainty"), std::string::npos);
}

TEST(Config, RefusesUncertaintiesOfWhatThereIsNotAndBoundsWithoutTheValue) {
  const auto error_with = [](const std::string& lines) {
    return error_of([&] { parse_machine("name = \"m\"\n[[uncertainty]]\n" + lines, "m.toml"); });
  };
  const std::string kv = "key = \"axes.X.kv_per_s\"\n";
  EXPECT_EQ(error_with("standard = 1\n"), "m.toml:2: uncertainty: key is missing");
  EXPECT_EQ(error_with("key = \"axes.X.kv\"\n"),
            "m.toml:2: uncertainty: axes.X.kv is not a number of a machine file; did you mean "
            "axes.X.kv_per_s?");
  EXPECT_EQ(error_with(kv + "between = [50, 20]\n"),
            "m.toml:2: uncertainty: axes.X.kv_per_s: between: expected [least, most]");
  EXPECT_NE(error_with(kv + "between = [500, 600]\n").find("is declared, which is not between 500"),
            std::string::npos);
  EXPECT_NE(error_with(kv + "between = [-5, 600]\n").find("between: allowed "), std::string::npos);
  EXPECT_EQ(error_with(kv + "[[uncertainty]]\n" + kv),
            "m.toml:4: uncertainty: axes.X.kv_per_s is given twice");
  EXPECT_EQ(error_with(kv + "standard = -1\n").find("m.toml:4: uncertainty.standard: -1 is out of"),
            0u);
}

TEST(Config, MessagesNameFileAndLine) {
  EXPECT_EQ(error_of([] { parse_machine("name = \"a\"\n[axes.X]\nkv = 3\n", "m.toml"); }),
            "m.toml:3: axes.X.kv: unknown key; did you mean kv_per_s?");
  EXPECT_EQ(error_of([] { parse_machine("[axes.X]\nmin_mm = 3 mm\n", "m.toml"); }).substr(0, 9),
            "m.toml:2:");
  EXPECT_EQ(error_of([] { load_machine("/no/such/file.toml"); }),
            "/no/such/file.toml: cannot be opened");
  EXPECT_NE(error_of([] { load_machine("/"); }).find("is a directory"), std::string::npos);
}

TEST(Config, PathsAreRelativeToTheirSource) {
  const Machine from_file = load_machine(kMachines + "trunnion.toml");
  EXPECT_EQ(from_file.setup.piece,
            std::filesystem::weakly_canonical(kMachines + "../pieces/s_eq1.toml"));
  const Machine from_here = load_machine(kMachines + "trunnion.toml", {"setup.piece=ring.toml"});
  EXPECT_EQ(from_here.setup.piece, (std::filesystem::current_path() / "ring.toml").string());
}

constexpr const char* kOwnFile = "[[nc.compensation.table]]\naxis = \"X\"\nfile = \"x.txt\"\n";

TEST(CompensationFile, HoldsMeasuredPositionsOrTrims) {
  const Scratch workshop;
  const std::string machine = workshop.write("m.toml", kOwnFile);
  workshop.write("x.txt", "# LinuxCNC\n-100 -99.998 -100.001\n\n0, 0.004, 0.001\n+100 100 100\n");
  const CompensationTable actual = load_machine(machine).nc.compensation.tables.at(0);
  ASSERT_EQ(actual.at.size(), 3u);
  EXPECT_NEAR(actual.at[0], -0.1, 1e-12);
  EXPECT_NEAR(actual.error[0], 2e-6, 1e-12);
  EXPECT_NEAR(actual.error[1], 4e-6, 1e-12);
  EXPECT_NEAR(actual.error_reverse[0], -1e-6, 1e-12);
  EXPECT_EQ(actual.error_reverse[2], 0);
  EXPECT_TRUE(actual.file.empty()) << "the points are the machine's now";

  // Trim: nominal less actual.
  const std::string trims =
      workshop.write("t.toml", std::string(kOwnFile) + "file_type = \"trim\"\nover = \"Y\"\n");
  workshop.write("x.txt", "0 0.003 -0.002\n50 0 0\n");
  const CompensationTable trim = load_machine(trims).nc.compensation.tables.at(0);
  EXPECT_NEAR(trim.error[0], -3e-6, 1e-12);
  EXPECT_NEAR(trim.error_reverse[0], 2e-6, 1e-12);
}

TEST(CompensationFile, EveryMistakeIsOneSentenceWithItsLine) {
  const Scratch workshop;
  const std::string machine = workshop.write("m.toml", kOwnFile);
  const auto says = [&](const std::string& points) {
    const std::string file = workshop.write("x.txt", points);
    const std::string error = error_of([&] { load_machine(machine); });
    EXPECT_EQ(error.substr(0, file.size()), file);
    return error.size() > file.size() ? error.substr(file.size()) : error;
  };
  EXPECT_EQ(says("0 0 0\n1 x 0\n"), ":2: x: expected a number, -100000 .. 100000");
  EXPECT_EQ(says("0 0 0\n1 nan 0\n"), ":2: nan: expected a number, -100000 .. 100000");
  EXPECT_EQ(says("0 0\n"), ":1: expected three numbers: nominal, forward, reverse");
  EXPECT_EQ(says("0 0 0 0\n"), ":1: more than three numbers: nominal, forward, reverse");
  EXPECT_EQ(says("1 0 0\n1 0 0\n"), ":2: positions must ascend");
  EXPECT_EQ(says("# nothing\n"),
            ": holds fewer than two points, lines of nominal, forward, reverse");
  const std::string other = workshop.write("o.toml", std::string(kOwnFile) + "over = \"Y\"\n");
  workshop.write("x.txt", "0 0 0\n1 1 1\n");
  EXPECT_NE(error_of([&] { load_machine(other); }).find("must be \"trim\""), std::string::npos);
  EXPECT_NE(
      error_of([&] {
        load_machine(workshop.write("n.toml", "[[nc.compensation.table]]\nfile = \"no.txt\"\n"));
      }).find("no.txt: cannot be opened"),
      std::string::npos);
}

TEST(Config, WrongCompensationIsOneSentence) {
  const auto says = [](const std::string& text) {
    return error_of([&] { parse_machine("[nc.compensation]\n" + text, "m.toml"); });
  };
  EXPECT_EQ(says("table = [{at_mm = [0], error_um = [0]}]\n"),
            "m.toml: nc.compensation.table 1: needs at least two points");
  EXPECT_EQ(says("table = [{at_mm = [0, 1], error_um = [0]}]\n"),
            "m.toml: nc.compensation.table 1: needs as many errors as positions");
  EXPECT_EQ(says("table = [{at_mm = [1, 0], error_um = [0, 0]}]\n"),
            "m.toml: nc.compensation.table 1: positions must ascend");
  EXPECT_EQ(says("table = [{at_mm = [0, 1], error_um = [0, 1], modulo = true}]\n"),
            "m.toml: nc.compensation.table 1: with modulo the last error must be the first one "
            "again");
  EXPECT_EQ(says("table = [{over = \"C\", at_mm = [0, 1], error_um = [0, 0]}]\n"),
            "m.toml:2: nc.compensation.table.at_mm: unknown key; did you mean at_deg?");
  // 9 b / T^2 of 30 um in 7 ms is 5.5 m/s^2, the axis may have 5.
  EXPECT_EQ(says("X = {backlash_um = 30, transition_ms = 7}\n"),
            "m.toml: nc.compensation.X.transition_ms: 7 is too short for the limits of X, at least "
            "7.4 are needed");
  EXPECT_EQ(says("X = {friction = {amplitude_mm_s = 1, rise_ms = 9}}\n"),
            "m.toml: nc.compensation.X.friction.rise_ms must be below friction.decay_ms");
  EXPECT_NE(says("X = {friction = {amplitude_mm_s = 50}}\n").find("rises faster"),
            std::string::npos);
}

/// The reference page in docs/ is the generated one. `vcnc keys` prints it.
TEST(Config, KeyReferenceInDocsIsCurrent) {
  std::ifstream in(std::string(VCNC_SOURCE_DIR) + "/docs/keys.md");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  EXPECT_NE(text.find(machine_key_reference()), std::string::npos);
  EXPECT_NE(text.find(piece_key_reference()), std::string::npos);
}

}  // namespace
}  // namespace vcnc::config_test
