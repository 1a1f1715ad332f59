#include "diagnosis/records/import_table.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>

#include "configs/config.hpp"
#include "diagnosis/records/any_record.hpp"
#include "diagnosis/records/commanded_motion.hpp"
#include "diagnosis/records/record_check.hpp"
#include "diagnosis/records/record_file.hpp"
#include "tests/scratch.hpp"

namespace vcnc::import_table_test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kRows = 6000;
constexpr double kStep = 1e-3;

/// Ball-screw axis that swings by 80 mm in 2 s, and another one by 50 mm in 3 s.
struct LinearAxis {
  static double position(double t) { return 0.08 * std::sin(kPi * t); }
  static double velocity(double t) { return 0.08 * kPi * std::cos(kPi * t); }
  static double force(double t) {
    const double v = velocity(t), a = -0.08 * kPi * kPi * std::sin(kPi * t);
    return 100 * a + 200 * v + 20 * std::tanh(v / 1e-3);
  }
  static double other(double t) { return 0.05 * std::sin(2 * kPi / 3 * t + 1); }
};

using Columns = std::map<std::string, std::function<double(double)>>;

const Columns& columns() {
  static const Columns all{
      {"t", [](double t) { return t; }},
      {"cmd", [](double t) { return LinearAxis::position(t); }},
      {"pos", [](double t) { return LinearAxis::position(t - 0.004); }},
      {"vel", [](double t) { return LinearAxis::velocity(t - 0.004); }},
      {"force", [](double t) { return LinearAxis::force(t - 0.004); }},
      {"cmd2", [](double t) { return LinearAxis::other(t); }},
      {"pos2", [](double t) { return LinearAxis::other(t - 0.004); }},
  };
  return all;
}

MeasuredTable table_of(const Columns& all, std::size_t rows = kRows) {
  MeasuredTable table{.source = "run.csv", .columns = {}, .line = {}};
  std::mt19937 random(7);
  for (const auto& [name, f] : all) {
    MeasuredColumn& c = table.columns.emplace_back();
    c.name = name;
    for (std::size_t k = 0; k < rows; ++k) {
      // A uniform noise of a millionth of the size, so that nothing is quantised by accident.
      const double noise = static_cast<double>(random()) / 4294967296.0 - 0.5;
      const double v = f(static_cast<double>(k) * kStep);
      c.value.push_back(name == "t" ? v : v + 2e-7 * noise * std::max(1.0, std::abs(v)));
    }
  }
  for (std::size_t k = 0; k < rows; ++k) table.line.push_back(k + 2);
  return table;
}

std::string signal(const std::string& column, const std::string& kind, const std::string& axis,
                   const std::string& unit, const std::string& more = "") {
  return fmt::format(
      "[[signals]]\ncolumn = \"{}\"\nkind = \"{}\"\naxis = \"{}\"\nunit = \"{}\"\n{}\n", column,
      kind, axis, unit, more);
}

const std::string kTime = "[time]\ncolumn = \"t\"\nunit = \"s\"\n";

std::string sound_map() {
  return kTime + signal("cmd", "command", "X", "m") + signal("pos", "position", "X", "m") +
         signal("vel", "velocity", "X", "m/s") + signal("force", "force", "X", "N");
}

Machine declared() {
  return parse_machine(
      "name = \"axis\"\n[axes.X]\nmin_mm = -150\nmax_mm = 150\nvelocity_mm_s = 500\nload_kg = 90\n"
      "motor_inertia_kgm2 = 1e-5\ntravel_per_turn_mm = 10\n",
      "axis.toml");
}

Record imported(const std::string& map, const MeasuredTable& table = table_of(columns())) {
  const Machine machine = declared();
  return import_table(table, parse_import_map(map, "map.toml"), "map.toml", &machine);
}

std::string refusal(const std::string& map, const MeasuredTable& table = table_of(columns())) {
  try {
    imported(map, table);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

bool warned(const Record& record, const std::string& part) {
  for (const std::string& w : record.warnings)
    if (w.find(part) != std::string::npos) return true;
  return false;
}

std::string all_warnings(const Record& record) {
  std::string all;
  for (const std::string& w : record.warnings) all += w + "\n";
  return all;
}

TEST(ImportTable, ASoundTableBecomesARecordInSiWithItsLapsAndNoComplaint) {
  const Record record = imported(sound_map());
  EXPECT_EQ(record.samples(), kRows);
  EXPECT_NEAR(record.period, 1e-3, 1e-12);
  const MeasuredSignal* force = record.find(SignalKind::force, 0);
  ASSERT_NE(force, nullptr);
  EXPECT_NEAR(force->value[1000], LinearAxis::force(0.996), 1e-4);
  EXPECT_EQ(force->source, "force");
  EXPECT_GE(record.stretches.size(), 2u);
  EXPECT_EQ(record.warnings.size(), 0u) << all_warnings(record);
}

TEST(ImportTable, AVelocityIsKeptAndToldWhereItIsLate) {
  const Record sound = imported(sound_map());
  const MeasuredSignal* velocity = sound.find(SignalKind::velocity, 0);
  ASSERT_NE(velocity, nullptr);
  EXPECT_NEAR(velocity->value[1000], LinearAxis::velocity(0.996), 1e-6);
  Columns late = columns();
  late["vel"] = [](double t) { return LinearAxis::velocity(t - 0.007); };
  const Record record = imported(sound_map(), table_of(late));
  EXPECT_TRUE(warned(record, "\"vel\" (velocity X) comes 3 ms after the position of X"))
      << all_warnings(record);
}

TEST(ImportTable, UnitScaleSignAndOffsetComeOutInSi) {
  Columns all = columns();
  all["pos"] = [](double t) { return -1e6 * (LinearAxis::position(t - 0.004) - 0.001); };
  all["force"] = [](double t) { return LinearAxis::force(t - 0.004) / 35.15; };
  const Record record =
      imported(kTime + signal("cmd", "command", "X", "m") +
                   signal("pos", "position", "X", "um", "sign = -1\noffset = 1000") +
                   signal("force", "force", "X", "N", "scale = 35.15"),
               table_of(all));
  EXPECT_NEAR(record.find(SignalKind::position, 0)->value[500], LinearAxis::position(0.496), 1e-6);
  EXPECT_NEAR(record.find(SignalKind::force, 0)->value[500], LinearAxis::force(0.496), 1e-3);
}

TEST(ImportTable, AFollowingErrorIsAPositionBesideItsCommand) {
  Columns all = columns();
  all["behind"] = [](double t) {
    return 1e6 * (LinearAxis::position(t) - LinearAxis::position(t - 0.004));
  };
  const auto map = [](const std::string& more) {
    return kTime + signal("behind", "following_error", "X", "um", more) +
           signal("cmd", "command", "X", "m");
  };
  const Record record = imported(map(""), table_of(all));
  const MeasuredSignal* position = record.find(SignalKind::position, kX);
  ASSERT_NE(position, nullptr);
  EXPECT_NEAR(position->value[700], LinearAxis::position(0.696), 1e-6);
  EXPECT_EQ(position->source, "cmd - behind");
  EXPECT_FALSE(warned(record, "ahead")) << all_warnings(record);
  EXPECT_TRUE(warned(imported(map("sign = -1"), table_of(all)),
                     "X goes ahead of its command: a following error is command less position"));
}

/// An axis that was told to stand trembles in the last digits of its encoder: nothing is the matter
/// with its columns.
TEST(ImportTable, AnAxisThatStandsIsNotJudged) {
  Columns all = columns();
  all["cmd_y"] = [](double) { return 0.1; };
  all["pos_y"] = [](double) { return 0.1; };
  all["vel_y"] = [](double t) { return 1e-5 * std::sin(170 * t); };
  all["force_y"] = [](double t) { return 0.5 * std::round(3 * std::sin(50 * t)); };
  MeasuredTable table = table_of(all);
  for (MeasuredColumn& c : table.columns)
    if (c.name == "cmd_y")
      std::fill(c.value.begin(), c.value.end(), 0.1);
    else if (c.name == "pos_y")  // without the noise of other columns
      for (std::size_t k = 0; k < c.value.size(); ++k)
        c.value[k] = 0.1 + 1e-8 * std::round(2 * std::sin(0.3 * static_cast<double>(k)));
  const Record record = imported(
      sound_map() + signal("cmd_y", "command", "Y", "m") + signal("pos_y", "position", "Y", "m") +
          signal("vel_y", "velocity", "Y", "m/s") + signal("force_y", "force", "Y", "N"),
      table);
  EXPECT_EQ(all_warnings(record), "");
}

TEST(ImportTable, TwoEncodersOfARobotJointBecomePositionAndTwist) {
  Columns all = columns();
  all["motor"] = [](double t) { return 5 * LinearAxis::position(t); };
  all["load"] = [](double t) { return 5 * LinearAxis::position(t) - 1e-3 * std::sin(t); };
  const Record record = imported(kTime + "[[axes]]\nname = \"joint 2\"\nplace = \"C\"\n" +
                                     signal("motor", "motor_position", "joint 2", "rad") +
                                     signal("load", "load_position", "joint 2", "rad"),
                                 table_of(all));
  ASSERT_EQ(record.signals.size(), 2u);
  const MeasuredSignal* twist = record.find(SignalKind::twist, kC);
  ASSERT_NE(twist, nullptr);
  EXPECT_NEAR(twist->value[2000], -1e-3 * std::sin(2.0), 2e-6);
  EXPECT_EQ(record.find(SignalKind::position, kC)->source, "motor");
  EXPECT_EQ(twist->source, "load - motor");
  EXPECT_EQ(record.axis_names[kC], "joint 2");
  EXPECT_EQ(record.axis_names[kX], "");
}

/// Of two measuring systems the loop's is the position, as the declared machine says.
TEST(ImportTable, ThePositionOfTwoIsThatOfTheDeclaredLoop) {
  Columns all = columns();
  all["motor"] = [](double t) { return LinearAxis::position(t - 0.004); };
  all["scale"] = [](double t) { return LinearAxis::position(t - 0.004) + 1e-5 * std::sin(t); };
  const MeasuredTable table = table_of(all);
  const std::string both = kTime + signal("motor", "motor_position", "X", "m") +
                           signal("scale", "load_position", "X", "m"),
                    map = both + signal("cmd", "command", "X", "m");
  Machine machine = declared();
  const auto position_of = [&](const std::string& text, const Machine* of) {
    const Record r = import_table(table, parse_import_map(text, "map.toml"), "map.toml", of);
    EXPECT_NE(r.find(SignalKind::twist, 0), nullptr);
    return r.find(SignalKind::position, 0)->source + (warned(r, "not known with which") ? "?" : "");
  };
  machine.axes[kX].servo.feedback = ServoParams::Feedback::load;
  EXPECT_EQ(position_of(map, &machine), "scale");
  EXPECT_EQ(position_of(both, &machine), "motor") << "no command, no loop";
  machine.axes[kX].servo.feedback = ServoParams::Feedback::motor;
  EXPECT_EQ(position_of(map, &machine), "motor");
  EXPECT_EQ(position_of(map, nullptr), "motor?");
  // One alone must be the loop's.
  const std::string motor =
      kTime + signal("cmd", "command", "X", "m") + signal("motor", "motor_position", "X", "m");
  EXPECT_NO_THROW(import_table(table, parse_import_map(motor, "map.toml"), "map.toml", &machine));
  EXPECT_TRUE(warned(import_table(table, parse_import_map(motor, "map.toml"), "map.toml", nullptr),
                     "whether the loop of X is closed with the motor"));
  const std::string refused = refusal(motor, table);  // the loop of declared() has a scale
  EXPECT_NE(refused.find("axes.X.feedback"), std::string::npos) << refused;
}

TEST(ImportTable, TwoPositionsThatCannotBeOfOneAxisAreRefused) {
  Columns all = columns();
  all["motor"] = [](double t) {
    return std::remainder(LinearAxis::position(t - 0.004), 0.010);  // an encoder of one turn
  };
  all["half"] = [](double t) { return 0.4 * LinearAxis::position(t - 0.004); };
  const auto with = [&](const char* motor) {
    return refusal(kTime + signal("cmd", "command", "X", "m") +
                       signal("pos", "position", "X", "m") +
                       signal(motor, "motor_position", "X", "m"),
                   table_of(all));
  };
  EXPECT_NE(with("motor").find("wraps"), std::string::npos) << with("motor");
  EXPECT_NE(with("half").find("check scale"), std::string::npos) << with("half");
}

TEST(ImportTable, APositionThatStopsWhileItsCommandGoesOnIsRefused) {
  Columns all = columns();
  all["pos"] = [](double t) { return LinearAxis::position(std::min(t, 3.0)); };
  MeasuredTable table = table_of(all);
  for (MeasuredColumn& c : table.columns)
    if (c.name == "pos") std::fill(c.value.begin() + 3000, c.value.end(), c.value[3000]);
  const std::string map =
      kTime + signal("cmd", "command", "X", "m") + signal("pos", "position", "X", "m");
  EXPECT_NE(refusal(map, table).find("from 3.000 s on"), std::string::npos) << refusal(map, table);
}

TEST(ImportTable, AForceFarBeyondTheDeclaredLimitIsRefused) {
  const auto scaled = [](double scale) {
    return refusal(kTime + signal("pos", "position", "X", "m") +
                   signal("force", "force", "X", "N", fmt::format("scale = {}", scale)));
  };
  EXPECT_EQ(scaled(1), "");  // 130 N of 40000
  EXPECT_NE(scaled(1e4).find("the declared limit is 4e+04 (axes.X.force_limit_N)"),
            std::string::npos)
      << scaled(1e4);
}

TEST(ImportTable, RoundingOfADifferenceIsNoResolution) {
  MeasuredTable table = table_of(columns());
  for (MeasuredColumn& c : table.columns)
    if (c.name == "pos" || c.name == "pos2")
      for (std::size_t k = 0; k < c.value.size(); ++k)
        c.value[k] = 1e-6 * std::round(1e6 * LinearAxis::position(kStep * static_cast<double>(k))) +
                     (c.name == "pos2" ? (k % 3 == 0 ? 3e-6 : 2e-6) : 0);
  const Record record = imported(
      kTime + signal("pos", "motor_position", "X", "m") + signal("pos2", "load_position", "X", "m"),
      table);
  EXPECT_EQ(record.find(SignalKind::twist, 0)->resolution, 0);
  EXPECT_NEAR(record.find(SignalKind::position, 0)->resolution, 1e-6, 1e-9);
}

TEST(ImportTable, GapsAndMissingValuesStayMissingAndAreTold) {
  MeasuredTable table = table_of(columns());
  for (MeasuredColumn& c : table.columns) {
    c.value.erase(c.value.begin() + 2000, c.value.begin() + 2010);
    if (c.name == "pos") c.value[100] = kMissing;
  }
  const Record record = imported(sound_map(), table);
  EXPECT_EQ(record.samples(), kRows);
  const MeasuredSignal* pos = record.find(SignalKind::position, 0);
  EXPECT_TRUE(std::isnan(pos->value[100]));
  EXPECT_TRUE(std::isnan(pos->value[2005]));
  EXPECT_NEAR(pos->value[2010], LinearAxis::position(2.006), 1e-6);
  EXPECT_TRUE(warned(record, "10 samples are missing in 1 gap")) << all_warnings(record);
  EXPECT_TRUE(warned(record, "\"pos\": 1 of 5990 values are missing")) << all_warnings(record);
}

TEST(ImportTable, LapsByTimeAndByColumn) {
  const Record by_time = imported(sound_map() +
                                  "[[laps]]\nfrom_s = 0\nto_s = 2\ncondition = \"swing\"\n"
                                  "[[laps]]\nfrom_s = 2\nto_s = 4\ncondition = \"swing\"\n"
                                  "[[laps]]\nfrom_s = 4\nto_s = 5\ncondition = \"rest\"\n");
  ASSERT_EQ(by_time.stretches.size(), 3u);
  EXPECT_EQ(by_time.stretches[1].begin, 2000u);
  EXPECT_EQ(by_time.stretches[1].end, 4000u);
  EXPECT_EQ(by_time.stretches[1].condition, by_time.stretches[0].condition);
  EXPECT_EQ(by_time.stretches[1].repetition, 1);
  EXPECT_NE(by_time.stretches[2].condition, by_time.stretches[0].condition);
  Columns all = columns();
  all["lap"] = [](double t) { return std::floor(t / 2 + 1e-9); };
  MeasuredTable table = table_of(all);
  for (MeasuredColumn& c : table.columns)
    if (c.name == "lap")
      for (double& v : c.value) v = std::round(v);
  const Record by_column = imported("lap_column = \"lap\"\n" + sound_map(), table);
  ASSERT_EQ(by_column.stretches.size(), 3u);
  EXPECT_EQ(by_column.stretches[2].begin, 4000u);
  EXPECT_EQ(by_column.stretches[2].repetition, 2);
}

TEST(ImportTable, RefusesLapsOfOneConditionThatAreDifferentMotions) {
  // Half a period later the axis swings the other way.
  const std::string reason = refusal(sound_map() +
                                     "[[laps]]\nfrom_s = 0\nto_s = 2\ncondition = \"swing\"\n"
                                     "[[laps]]\nfrom_s = 3\nto_s = 5\ncondition = \"swing\"\n");
  EXPECT_NE(reason.find("laps.condition: the laps \"swing\" at 0.000 and 3.000 s are different "
                        "motions; laps of one condition repeat the same one"),
            std::string::npos)
      << reason;
  EXPECT_EQ(reason.find("map.toml:"), 0u) << reason;
}

TEST(ImportTable, RefusesLapsThatReachBeyondTheRun) {
  const std::string reason = refusal(sound_map() + "[[laps]]\nfrom_s = 4\nto_s = 6.1\n");
  EXPECT_NE(reason.find("laps.to_s: the lap lies partly outside the run, 0.000 .. 5.999 s"),
            std::string::npos)
      << reason;
  EXPECT_NE(refusal(sound_map() + "[[laps]]\nfrom_s = 8\nto_s = 9\n")
                .find("laps.from_s: the lap lies outside the run"),
            std::string::npos);
  EXPECT_EQ(imported(sound_map() + "[[laps]]\nfrom_s = 4\nto_s = 6\n").stretches.size(), 1u);
}

/// A column "lap" that counts from `begin` [s] on, `length` [s] each, and holds nothing later.
MeasuredTable with_laps(const std::vector<std::pair<double, double>>& laps) {
  MeasuredTable table = table_of(columns());
  MeasuredColumn column{.name = "lap", .value = std::vector<double>(kRows, NAN)};
  for (std::size_t n = 0; n < laps.size(); ++n)
    for (std::size_t k = 0; k < kRows; ++k)
      if (const double t = static_cast<double>(k) * kStep;
          t >= laps[n].first - 1e-9 && t < laps[n].first + laps[n].second - 1e-9)
        column.value[k] = static_cast<double>(n);
  table.columns.push_back(column);
  return table;
}

TEST(ImportTable, ALapThatWasBrokenOffAndOneThatNobodyToldOfAreMotionsOfTheirOwn) {
  const Record broken =
      imported("lap_column = \"lap\"\n" + sound_map(), with_laps({{0, 2}, {2, 2}, {4, 1}}));
  ASSERT_EQ(broken.stretches.size(), 3u);
  EXPECT_EQ(broken.stretches[1].condition, broken.stretches[0].condition);
  EXPECT_NE(broken.stretches[2].condition, broken.stretches[0].condition);
  EXPECT_EQ(broken.stretches[2].repetition, 0);
  EXPECT_TRUE(warned(broken,
                     "at 0.000 and 4.000 s take 2.000 and 1.000 s: they count as motions of "
                     "their own"))
      << all_warnings(broken);
  const Record other =
      imported("lap_column = \"lap\"\n" + sound_map(), with_laps({{0, 1}, {1, 1}, {2, 1}, {3, 1}}));
  ASSERT_EQ(other.stretches.size(), 4u);
  EXPECT_EQ(other.stretches[2].condition, other.stretches[0].condition);
  EXPECT_EQ(other.stretches[2].repetition, 1);
  EXPECT_NE(other.stretches[1].condition, other.stretches[0].condition);
  EXPECT_EQ(other.stretches[3].condition, other.stretches[1].condition);
  EXPECT_TRUE(warned(other, "at 0.000 and 1.000 s are different motions: they count"))
      << all_warnings(other);
}

TEST(ImportTable, RefusesLapsTooShortToTellTheirNoise) {
  const std::string by_time =
      refusal(sound_map() + "[[laps]]\nfrom_s = 0\nto_s = 0.02\n[[laps]]\nfrom_s = 1\nto_s = 2\n");
  EXPECT_NE(by_time.find("laps.to_s: a lap has 20 samples of the run; at least 50 are needed"),
            std::string::npos)
      << by_time;
  // A column that changes in every sample.
  const std::string by_column = refusal("lap_column = \"cmd\"\n" + sound_map());
  EXPECT_NE(by_column.find("map.toml:1: lap_column: a lap has 1 sample"), std::string::npos)
      << by_column;
}

TEST(ImportTable, RefusesWhatTheMapCannotMean) {
  EXPECT_NE(refusal(kTime + signal("posi", "position", "X", "m"))
                .find("map.toml:5: signals.column: \"posi\" is no column of run.csv; did you mean "
                      "\"pos\"?"),
            std::string::npos)
      << refusal(kTime + signal("posi", "position", "X", "m"));
  EXPECT_NE(refusal(kTime + "[[signals]]\nnumber = 90\nkind = \"position\"\naxis = \"X\"\nunit = "
                            "\"m\"\n")
                .find("column 90 is not there, run.csv has 7"),
            std::string::npos);
  // By its heading and by its number: still the same column.
  EXPECT_NE(refusal(kTime + signal("cmd", "command", "X", "m") +
                    "[[signals]]\nnumber = 1\nkind = \"position\"\naxis = \"X\"\nunit = \"m\"\n")
                .find("column \"cmd\" is used as command of X already"),
            std::string::npos);
  MeasuredTable table = table_of(columns());
  table.columns[3].bad_line = 17;
  table.columns[3].bad_text = "err";
  EXPECT_NE(refusal(sound_map(), table).find("run.csv:17: \"err\" in column"), std::string::npos);
  EXPECT_NE(refusal(sound_map(), table_of(columns(), 40)).find("too short a run"),
            std::string::npos);
}

/// What a user is most likely to get wrong, each with the words that must name it.
TEST(ImportTable, NamesWrongUnitsSignsAndSwappedColumns) {
  const std::string cmd = signal("cmd", "command", "X", "m"),
                    pos = signal("pos", "position", "X", "m"),
                    cmd2 = signal("cmd2", "command", "Y", "m"),
                    pos2 = signal("pos2", "position", "Y", "m");
  struct Case {
    const char* what;
    std::string map;
    std::vector<std::string> words;
  };
  const std::vector<Case> cases{
      {"velocity in mm/s said to be m/s",
       kTime + pos + signal("vel", "velocity", "X", "m/s", "scale = 1000"),
       {"1000 times the derivative", "m and mm"}},
      {"velocity with the wrong sign",
       kTime + pos + signal("vel", "velocity", "X", "m/s", "sign = -1"),
       {"-1 times the derivative", "sign"}},
      {"position in mm said to be m",
       kTime + cmd + signal("pos", "position", "X", "m", "scale = 1000"),
       {"1000", "m and mm"}},
      {"position and velocity swapped",
       kTime + signal("vel", "position", "X", "m") + signal("pos", "velocity", "X", "m/s"),
       {"swapped"}},
      {"positions of two axes swapped",
       kTime + cmd + cmd2 + signal("pos2", "position", "X", "m") +
           signal("pos", "position", "Y", "m"),
       {"follows \"cmd2\"", "swapped"}},
      {"command counts the other way",
       kTime + pos + signal("cmd", "command", "X", "m", "sign = -1"),
       {"moves against", "signs"}},
      {"time in ms said to be s",
       "[time]\ncolumn = \"t\"\nunit = \"ms\"\n" + cmd + pos,
       {"declared limit", "1000"}},
      {"force with the wrong sign",
       kTime + cmd + pos + signal("force", "force", "X", "N", "sign = -1"),
       {"against the acceleration", "sign must be -1"}},
      {"force of the other axis",
       kTime + pos + pos2 + signal("force", "force", "Y", "N"),
       {"belongs to the motion of \"pos\"", "swapped"}},
      {"nothing to compare", kTime + cmd, {"no signal can be compared"}},
  };
  for (const Case& c : cases) {
    const std::string said = refusal(c.map);
    for (const std::string& word : c.words)
      EXPECT_NE(said.find(word), std::string::npos)
          << c.what << "\nexpected: " << word << "\nfound:    " << said;
  }
}

TEST(ImportTable, RefusesAnInertiaThatOnlyAWrongTimeMakes) {
  MeasuredTable table = table_of(columns());
  for (MeasuredColumn& c : table.columns)
    if (c.name == "t")
      for (double& t : c.value) t *= 1000;
  const std::string said =
      refusal(kTime + signal("cmd", "command", "X", "m") + signal("pos", "position", "X", "m") +
                  signal("force", "force", "X", "N"),
              table);
  EXPECT_NE(said.find("times the declared inertia"), std::string::npos) << said;
  EXPECT_NE(said.find("unit of the time stamps"), std::string::npos) << said;
}

TEST(ImportTable, WarnsOfWhatIsOnlySuspicious) {
  const auto with = [](const std::string& column, std::function<double(double)> f,
                       const std::string& map) {
    Columns all = columns();
    all[column] = std::move(f);
    MeasuredTable table = table_of(all);
    for (MeasuredColumn& c : table.columns)
      if (c.name == column)
        for (std::size_t k = 0; k < kRows; ++k) c.value[k] = all[column](1e-3 * double(k));
    return imported(map, table);
  };
  const Record constant = with(
      "force", [](double) { return 3.0; }, sound_map());
  EXPECT_TRUE(warned(constant, "\"force\" (force X) is constant")) << all_warnings(constant);
  EXPECT_EQ(constant.find(SignalKind::force, kX), nullptr);  // no law of friction is made of it
  const Record coarse = with(
      "pos", [](double t) { return 1e-3 * std::round(1e3 * LinearAxis::position(t - 0.004)); },
      sound_map());
  EXPECT_TRUE(warned(coarse, "comes in 160 coarse steps of 0.001")) << all_warnings(coarse);
  EXPECT_NEAR(coarse.find(SignalKind::position, 0)->resolution, 1e-3, 1e-9);
  const Record clipped = with(
      "force", [](double t) { return std::clamp(LinearAxis::force(t - 0.004), -60.0, 60.0); },
      sound_map());
  EXPECT_TRUE(warned(clipped, "may be saturated")) << all_warnings(clipped);
  const Record spiky = with(
      "force",
      [](double t) { return LinearAxis::force(t - 0.004) + (std::abs(t - 2.5) < 1e-6 ? 400 : 0); },
      sound_map());
  EXPECT_TRUE(warned(spiky,
                     "1 value stands alone far off the values before and after, the first "
                     "by 400"))
      << all_warnings(spiky);
  const Record scaled = with(
      "force", [](double t) { return 1000 * LinearAxis::force(t - 0.004); }, sound_map());
  EXPECT_TRUE(warned(scaled, "times the declared inertia")) << all_warnings(scaled);
  const Record outside = with(
      "pos", [](double t) { return 0.1 + LinearAxis::position(t - 0.004); }, sound_map());
  EXPECT_TRUE(warned(outside, "outside the declared travel")) << all_warnings(outside);
  const Record swapped =
      imported(kTime + signal("pos", "command", "X", "m") + signal("cmd", "position", "X", "m"));
  EXPECT_TRUE(warned(swapped, "is ahead of \"pos\" (command X) by 4 ms")) << all_warnings(swapped);
}

/// A transmission that gives way leaves the load behind.
TEST(ImportTable, AUnitThatTheTableCallsOtherwiseIsTold) {
  const auto told = [](const std::string& unit, const std::string& more = "") {
    MeasuredTable table = table_of(columns());
    for (MeasuredColumn& c : table.columns)
      if (c.name == "force") c.unit = unit;
    return imported(kTime + signal("cmd", "command", "X", "m") +
                        signal("pos", "position", "X", "m") +
                        signal("force", "force", "X", "N", more),
                    table);
  };
  EXPECT_TRUE(warned(told("kN"), "column \"force\" is in kN by the table and in N by the map"));
  EXPECT_TRUE(warned(told("[Nm]"), "in Nm by the table"));
  EXPECT_EQ(told("Nm", "scale = 1.001").warnings.size(), 0U);  // which may convert it
  for (const char* unit : {"N", "(N)", "counts", ""})
    EXPECT_EQ(told(unit).warnings.size(), 0U) << unit;
  EXPECT_TRUE(warned(told("\xb5s"), "in us by the table and in N by the map"));  // Latin-1
  for (const char* micrometres : {"um", "\u00b5m", "[\u03bcm]"}) {
    MeasuredTable table = table_of(columns());
    for (MeasuredColumn& c : table.columns)
      if (c.name == "pos") c.name = std::string("pos (") + micrometres + ")";
    const std::string map = kTime + signal("cmd", "command", "X", "m");
    EXPECT_TRUE(warned(
        imported(map + signal(std::string("pos (") + micrometres + ")", "position", "X", "m"),
                 table),
        "is in um by the table and in m by the map"));
  }
}

TEST(ImportTable, MotorAndLoadThatAreSwappedAreSuspicious) {
  Columns all = columns();
  all["motor"] = [](double t) { return LinearAxis::position(t) + LinearAxis::force(t) / 2e7; };
  all["scale"] = [](double t) { return (1 - 20e-6) * LinearAxis::position(t); };
  all["force"] = [](double t) { return LinearAxis::force(t); };
  const auto of = [&](const std::string& motor, const std::string& load, bool with_force = false) {
    return imported(kTime + signal(motor, "motor_position", "X", "m") +
                        signal(load, "load_position", "X", "m") +
                        (with_force ? signal("force", "force", "X", "N") : ""),
                    table_of(all));
  };
  const std::string words = "are the columns of motor and load swapped";
  EXPECT_TRUE(warned(of("cmd", "motor"), words)) << all_warnings(of("cmd", "motor"));
  EXPECT_FALSE(warned(of("motor", "cmd"), words)) << all_warnings(of("motor", "cmd"));
  EXPECT_TRUE(warned(of("cmd", "motor", true), words)) << all_warnings(of("cmd", "motor", true));
  EXPECT_FALSE(warned(of("motor", "cmd", true), words)) << all_warnings(of("motor", "cmd", true));
  EXPECT_FALSE(warned(of("cmd", "scale"), words)) << all_warnings(of("cmd", "scale"));
  EXPECT_FALSE(warned(of("scale", "cmd"), words)) << all_warnings(of("scale", "cmd"));
}

TEST(ImportTable, ASideOfATransmissionThatIsRecordedLateIsSuspicious) {
  Columns all = columns();
  all["motor"] = [](double t) { return LinearAxis::position(t) + LinearAxis::force(t) / 2e7; };
  all["late"] = [](double t) { return LinearAxis::position(t - 0.001); };
  const auto of = [&](const std::string& motor, const std::string& load) {
    return imported(
        kTime + signal(motor, "motor_position", "X", "m") + signal(load, "load_position", "X", "m"),
        table_of(all));
  };
  EXPECT_TRUE(warned(of("motor", "late"), "as if the load were recorded 1"))
      << all_warnings(of("motor", "late"));
  EXPECT_TRUE(warned(of("late", "motor"), "as if the motor were recorded 1"));
  EXPECT_FALSE(warned(of("motor", "cmd"), "recorded")) << all_warnings(of("motor", "cmd"));
}

TEST(ImportTable, TextThatIsNoNumberIsCalledMissingOnlyWithoutDigits) {
  const auto said = [](const std::string& text) {
    MeasuredTable table = table_of(columns());
    for (MeasuredColumn& c : table.columns)
      if (c.name == "pos") c.bad_line = 7, c.bad_text = text;
    return refusal(sound_map(), table);
  };
  EXPECT_NE(said("n/a").find("missing = [\"n/a\"]"), std::string::npos) << said("n/a");
  EXPECT_NE(said("1,008.74").find("only digits"), std::string::npos) << said("1,008.74");
  EXPECT_EQ(said("1,008.74").find("missing"), std::string::npos);
}

/// -9999 for "none" that the map does not know.
TEST(ImportTable, ValuesThatFillGapsAreSuspicious) {
  MeasuredTable table = table_of(columns());
  for (MeasuredColumn& c : table.columns)
    if (c.name == "force")
      for (std::size_t k = 1000; k < 1010; ++k) c.value[k] = -999;
  const Record filled = imported(sound_map(), table);
  EXPECT_TRUE(warned(filled, "10 values are -999 (SI), far off all others"))
      << all_warnings(filled);
  EXPECT_FALSE(warned(imported(sound_map()), "far off all others"));
}

TEST(Resolution, IsTheStepOfQuantisedValuesAndNothingOfSmoothOnes) {
  std::vector<double> quantised, smooth;
  for (int k = 0; k < 3000; ++k) {
    const double v = std::sin(1e-2 * k);
    quantised.push_back(0.25e-3 * std::round(v / 0.25e-3));
    smooth.push_back(v);
  }
  EXPECT_NEAR(resolution_of(quantised), 0.25e-3, 1e-9);
  EXPECT_EQ(resolution_of(smooth), 0);
  EXPECT_EQ(resolution_of(std::vector<double>(100, 1.0)), 0);
}

/// With other values in one column, without noise.
MeasuredTable with_column(const std::string& name, const std::function<double(double)>& f) {
  MeasuredTable table = table_of(columns());
  for (MeasuredColumn& c : table.columns)
    if (c.name == name)
      for (std::size_t k = 0; k < kRows; ++k) c.value[k] = f(kStep * static_cast<double>(k));
  return table;
}

std::string move_map() {
  return kTime + signal("cmd", "command", "X", "m") + signal("pos", "position", "X", "m");
}

TEST(ImportTable, APositionThatIsTheCommandIsRefused) {
  MeasuredTable table = table_of(columns());
  const auto copied = [&](double scale, double noise) {
    for (MeasuredColumn& c : table.columns)
      if (c.name == "pos")
        for (std::size_t k = 0; k < kRows; ++k)
          c.value[k] = scale * table.columns[0].value[k] + (k % 2 == 0 ? noise : 0);
    return refusal(move_map(), table);
  };
  ASSERT_EQ(table.columns[0].name, "cmd");
  EXPECT_NE(copied(1, 0).find("\"pos\" (position X) is \"cmd\" (command X) itself"),
            std::string::npos);
  EXPECT_NE(copied(1.01, 0).find("no drive follows without error"), std::string::npos);
  EXPECT_EQ(copied(1, 1e-8), "");  // a drive that is off by 10 nm
}

TEST(ImportTable, TwoEncodersThatAreOneColumnAreRefused) {
  MeasuredTable table = table_of(columns());
  const std::vector<double> motor = table.columns[0].value;  // cmd
  const auto said = [&](double noise) {
    for (MeasuredColumn& c : table.columns)
      if (c.name == "pos")
        for (std::size_t k = 0; k < kRows; ++k)
          c.value[k] = 0.001 + motor[k] + (k % 2 == 0 ? noise : 0);
    return refusal(kTime + signal("cmd", "motor_position", "X", "m") +
                       signal("pos", "load_position", "X", "m"),
                   table);
  };
  EXPECT_NE(said(0).find("\"pos\" is \"cmd\" itself"), std::string::npos) << said(0);
  EXPECT_EQ(said(1e-8), "");
}

TEST(ImportTable, ForcesThatWereNotUpdatedBecomeMissing) {
  MeasuredTable frozen = table_of(columns());
  for (MeasuredColumn& c : frozen.columns)
    if (c.name == "force") std::fill(c.value.begin() + 2400, c.value.begin() + 3000, c.value[2400]);
  const Record record = imported(sound_map(), frozen);
  EXPECT_TRUE(warned(record, "\"force\" (force X) stays to the last digit at"))
      << all_warnings(record);
  EXPECT_TRUE(warned(record, "from 2.400 to 3.000 s")) << all_warnings(record);
  const std::vector<double>& force = record.find(SignalKind::force, 0)->value;
  EXPECT_TRUE(std::isnan(force[2500]));
  EXPECT_TRUE(std::isfinite(force[2399]) && std::isfinite(force[3000]));
  // Coarse, limited, and at rest: nothing of that is frozen.
  for (const auto& f : std::vector<std::function<double(double)>>{
           [](double t) { return 20 * std::round(LinearAxis::force(t - 0.004) / 20); },
           [](double t) { return std::clamp(LinearAxis::force(t - 0.004), -50.0, 40.0); },
           [](double t) { return std::round(LinearAxis::force(t - 0.004)); }})
    EXPECT_FALSE(warned(imported(sound_map(), with_column("force", f)), "last digit"));
}

/// With a motion of more than one frequency; of one alone a time looks like a friction.
TEST(ImportTable, AForceThatIsRecordedLateIsSuspicious) {
  const auto way = [](double t) { return 0.08 * std::sin(kPi * t) + 0.01 * std::sin(5 * kPi * t); };
  const auto late = [&](double by, double sign) {
    Columns all = columns();
    all["pos"] = way;
    all["force"] = [=](double at) {
      const double t = at - by;
      const double v = kPi * (0.08 * std::cos(kPi * t) + 0.05 * std::cos(5 * kPi * t));
      const double a = -kPi * kPi * (0.08 * std::sin(kPi * t) + 0.25 * std::sin(5 * kPi * t));
      return sign * (90 * a + 20 * std::tanh(v / 1e-3));
    };
    return imported(kTime + signal("pos", "position", "X", "m") +
                        signal("force", "force", "X", "N", sign < 0 ? "sign = -1" : ""),
                    table_of(all));
  };
  EXPECT_TRUE(warned(late(0.03, 1), "\"force\" (force X) is 30 ms late for what \"pos\""))
      << all_warnings(late(0.03, 1));
  EXPECT_TRUE(warned(late(-0.02, -1), "is 20 ms early")) << all_warnings(late(-0.02, -1));
  EXPECT_FALSE(warned(late(0, 1), "put its time right")) << all_warnings(late(0, 1));
  EXPECT_FALSE(warned(late(0.004, 1), "put its time right"));
}

/// A ball in a ring: x and y go round, z stays.
MeasuredTable table_of_readings(double noise, const std::function<bool(double)>& touches) {
  std::mt19937 random(3);
  MeasuredTable table{.source = "run.csv", .columns = {}, .line = {}};
  const std::vector<std::string> names{"cx", "cy", "cz", "dx", "dy", "dz"};
  for (const std::string& name : names) {
    MeasuredColumn& c = table.columns.emplace_back();
    c.name = name;
    for (std::size_t k = 0; k < kRows; ++k) {
      const double t = kStep * static_cast<double>(k), turn = 2 * kPi * t / 3;
      const double way = name[1] == 'x' ? std::cos(turn) : name[1] == 'y' ? std::sin(turn) : 0;
      const double off = noise * (static_cast<double>(random()) / 4294967296.0 - 0.5);
      c.value.push_back(name[0] == 'c' ? 0.05 * way : off + (touches(t) ? 2e-4 * way : 0));
    }
  }
  return table;
}

std::string readings_map() {
  std::string map = "[time]\nrate_hz = 1000\n";
  for (const char* axis : {"X", "Y", "Z"})
    map += signal("c" + std::string(1, static_cast<char>(axis[0] + 32)), "command", axis, "m");
  for (const char* axis : {"x", "y", "z"})
    map += signal("d" + std::string(axis), "deflection", axis, "m");
  return map;
}

TEST(ImportTable, ReadingsThatWereNotUpdatedBecomeMissing) {
  const auto always = [](double) { return true; };
  MeasuredTable table = table_of_readings(1e-8, always);
  ASSERT_EQ(table.columns[3].name, "dx");
  std::vector<double>& dx = table.columns[3].value;
  std::fill(dx.begin() + 1000, dx.begin() + 1500, dx[1000]);
  std::fill(dx.begin() + 5000, dx.end(), dx[5000]);
  const Record record = imported(readings_map(), table);
  EXPECT_TRUE(warned(record, "\"dx\" (deflection x) stays to the last digit"))
      << all_warnings(record);
  EXPECT_TRUE(warned(record, "from 1.000 to 1.500 s, at")) << all_warnings(record);
  EXPECT_TRUE(warned(record, "from 5.000 to 6.000 s while")) << all_warnings(record);
  EXPECT_TRUE(warned(record, "these 1500 samples are taken as missing")) << all_warnings(record);
  EXPECT_TRUE(std::isnan(record.find(SignalKind::deflection, 0)->value[1200]));
  // Without noise: a ball that is off the piece reads the same all the time.
  const auto now_and_then = [](double t) { return t > 1 && (t < 2.5 || t > 3.5) && t < 5; };
  for (const auto& touches : {std::function<bool(double)>(always), {now_and_then}}) {
    const Record sound = imported(readings_map(), table_of_readings(0, touches));
    EXPECT_FALSE(warned(sound, "last digit")) << all_warnings(sound);
  }
}

TEST(ImportTable, ReadingsWithoutAllLinearAxesAreTold) {
  const auto always = [](double) { return true; };
  std::string map = readings_map();
  EXPECT_FALSE(warned(imported(map, table_of_readings(1e-8, always)), "neither command"));
  const std::string cz = signal("cz", "command", "Z", "m");
  map.erase(map.find(cz), cz.size());
  const Record record = imported(map, table_of_readings(1e-8, always));
  EXPECT_TRUE(warned(record, "neither command nor position of Z, A, C")) << all_warnings(record);
}

TEST(ImportTable, APositionThatWrapsIsRefused) {
  const auto wraps = [](double t) { return std::remainder(4 * LinearAxis::position(t), 0.1); };
  const std::string said = refusal(move_map(), with_column("pos", wraps));
  EXPECT_NE(said.find("\"pos\" (position) jumps from"), std::string::npos) << said;
  EXPECT_NE(said.find("it wraps, and must be unrolled before"), std::string::npos) << said;
  // A jump that is made in one sample from rest to rest.
  const auto step = [](double t) { return t > 3 ? 0.1 : 0.0; };
  EXPECT_EQ(refusal(kTime + signal("pos", "command", "X", "m") + signal("force", "force", "X", "N"),
                    with_column("pos", step))
                .find("wraps"),
            std::string::npos);
}

TEST(ImportTable, ZerosWithinAPositionAreRefused) {
  const auto zeros = [](double t) { return t > 0.5 && t < 0.6 ? 0 : LinearAxis::position(t); };
  const std::string said = refusal(move_map(), with_column("pos", zeros));
  EXPECT_NE(said.find("run.csv:503: \"pos\" (position) is 0 in 99 rows, 0.08 before"),
            std::string::npos)
      << said;
  // An axis that stands at zero, and goes through it.
  const auto stands = [](double t) { return t < 2 ? 0 : LinearAxis::position(t - 0.004); };
  EXPECT_EQ(refusal(kTime + signal("pos", "position", "X", "m"), with_column("pos", stands)), "");
}

/// Robots: each encoder counts from where it was switched on.
TEST(ImportTable, ZerosOfTwoEncodersAreTakenOff) {
  const auto with = [](double apart) {
    Columns all = columns();
    all["motor"] = [](double t) { return LinearAxis::position(t) + LinearAxis::force(t) / 2e7; };
    all["load"] = [apart](double t) { return LinearAxis::position(t) + apart; };
    return imported(kTime + signal("motor", "motor_position", "X", "m") +
                        signal("load", "load_position", "X", "m"),
                    table_of(all));
  };
  const Record apart = with(0.05), together = with(1e-5);
  EXPECT_TRUE(warned(apart, "\"load - motor\" is 0.05 m and changes by")) << all_warnings(apart);
  EXPECT_NEAR(apart.find(SignalKind::twist, 0)->value[1000],
              together.find(SignalKind::twist, 0)->value[1000] - 1e-5, 2e-6);
  EXPECT_FALSE(warned(together, "zeros of their own")) << all_warnings(together);
  EXPECT_TRUE(together.find(SignalKind::twist, 0)->relative);
  EXPECT_FALSE(together.find(SignalKind::position, 0)->relative);
}

TEST(ImportTable, AnEncoderThatStopsWhileTheOtherGoesOnIsRefused) {
  MeasuredTable table = table_of(columns());
  for (MeasuredColumn& c : table.columns)
    if (c.name == "pos") std::fill(c.value.begin() + 3000, c.value.end(), c.value[3000]);
  const std::string said = refusal(
      kTime + signal("cmd", "motor_position", "X", "m") + signal("pos", "load_position", "X", "m"),
      table);
  EXPECT_NE(said.find("from 3.000 s on while \"cmd\" goes on"), std::string::npos) << said;
}

/// What was imported without a machine is checked when there is one.
TEST(ImportTable, ChecksAgainstAMachineAreMadeLater) {
  const auto later = [](const std::string& scale) -> std::string {
    const std::string map = kTime + signal("cmd", "command", "X", "m", scale) +
                            signal("pos", "position", "X", "m", scale) +
                            signal("force", "force", "X", "N");
    Record record =
        import_table(table_of(columns()), parse_import_map(map, "map.toml"), "map.toml", nullptr);
    record.warnings.clear();
    try {
      check_against(record, declared());
      const std::string once = all_warnings(record);
      check_against(record, declared());
      EXPECT_EQ(all_warnings(record), once);
      return once;
    } catch (const MeasurementError& e) {
      return e.what();
    }
  };
  EXPECT_NE(later("scale = 1000").find("the declared travel is 0.3 m; a factor of 1000"),
            std::string::npos)
      << later("scale = 1000");
  EXPECT_EQ(later(""), "");
  EXPECT_NE(later("offset = 0.1").find("outside the declared travel"), std::string::npos)
      << later("offset = 0.1");
}

class RecordFile : public testing::Test {
 protected:
  const Scratch folder_;
};

/// Of two encoders that of the loop of the map's machine has become the position.
TEST_F(RecordFile, IsRefusedForAModelWhoseLoopHasTheOtherEncoder) {
  Record record = imported(sound_map());
  record.signals.push_back(record.signals.back());
  record.signals.back().kind = SignalKind::twist;
  Machine machine = declared();
  machine.axes[kX].servo.feedback = ServoParams::Feedback::motor;
  record.machine_toml = to_toml(machine);
  record.axis_names[kX] = "the long axis";
  const std::string file = folder_ / "run.h5";
  write_record(record, file);
  EXPECT_NO_THROW(load_record(file, "", folder_.write("same.toml", to_toml(machine))));
  EXPECT_EQ(read_record(file).axis_names[kX], "the long axis");
  machine.axes[kX].servo.feedback = ServoParams::Feedback::load;
  try {
    load_record(file, "", folder_.write("other.toml", to_toml(machine)));
    FAIL() << "accepted";
  } catch (const MeasurementError& e) {
    EXPECT_NE(std::string(e.what()).find("(axes.X.feedback)"), std::string::npos) << e.what();
  }
}

/// A ramp has a step from sample to sample, and begins anywhere.
TEST(CommandedMotionOfATable, IsNoMultipleOfTheStepsOfARamp) {
  Columns all = columns();
  all["cmd"] = [](double t) {
    const double part = std::fmod(t, 4);
    return 0.0512345 + 0.05 * (part < 2 ? part : 4 - part);
  };
  all["pos"] = [&](double t) { return all["cmd"](std::max(0.0, t - 0.004)); };
  MeasuredTable table = table_of(all);
  for (MeasuredColumn& c : table.columns)
    if (c.name == "cmd")
      for (double& v : c.value) v = std::round(v / 0.5e-6) * 0.5e-6;
  const Record record = imported(
      kTime + signal("cmd", "command", "X", "m") + signal("pos", "position", "X", "m"), table);
  const CommandedMotion motion = commanded_motion(record);
  const std::vector<double>& told = record.find(SignalKind::command, kX)->value;
  for (std::size_t k = 0; k < told.size(); ++k)
    ASSERT_NEAR(motion.position[kX][k], told[k], 1e-9) << k;
}

TEST_F(RecordFile, ADamagedOneIsStillARecordAndIsToldAsSuch) {
  const std::string file = folder_ / "run.h5";
  write_record(imported(sound_map()), file);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 100);
  EXPECT_TRUE(is_record_file(file));
  try {
    load_record(file);
    FAIL() << "accepted";
  } catch (const MeasurementError& e) {
    EXPECT_NE(std::string(e.what()).find("import it again"), std::string::npos) << e.what();
  }
}

TEST_F(RecordFile, ReadsBackWhatWasWrittenToTheLastBit) {
  Record record = imported(sound_map());
  record.machine_toml = to_toml(declared());
  record.warnings = {"one", "two"};
  record.signals[1].value[7] = kMissing;
  record.signals[1].relative = true;
  const std::string file = folder_ / "run.h5";
  write_record(record, file);
  EXPECT_TRUE(is_record_file(file));
  const Record back = load_record(file);
  EXPECT_EQ(back.source, record.source);
  EXPECT_EQ(back.period, record.period);
  EXPECT_EQ(back.machine_toml, record.machine_toml);
  EXPECT_EQ(back.warnings, record.warnings);
  ASSERT_EQ(back.signals.size(), record.signals.size());
  for (std::size_t i = 0; i < back.signals.size(); ++i) {
    EXPECT_EQ(back.signals[i].kind, record.signals[i].kind);
    EXPECT_EQ(back.signals[i].resolution, record.signals[i].resolution);
    EXPECT_EQ(back.signals[i].relative, record.signals[i].relative);
    for (std::size_t k = 0; k < record.samples(); ++k) {
      const double a = back.signals[i].value[k], b = record.signals[i].value[k];
      EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << i << " " << k;
    }
  }
  ASSERT_EQ(back.stretches.size(), record.stretches.size());
  EXPECT_EQ(back.stretches.back().end, record.stretches.back().end);
  EXPECT_EQ(back.stretches.back().label, record.stretches.back().label);
}

TEST_F(RecordFile, AnyHdf5FileIsATableOfItsDataSets) {
  const Record record = imported(sound_map());
  const std::string file = folder_ / "run.h5";
  write_record(record, file);
  const MeasuredTable table = read_measured_table(file);
  ASSERT_EQ(table.columns.size(), record.signals.size());
  EXPECT_EQ(table.columns[1].name, "signal_1");
  EXPECT_EQ(table.columns[1].value, record.signals[1].value);
  const Record again = import_table(
      table,
      parse_import_map("[time]\nrate_hz = 1000\n" + signal("signal_1", "position", "X", "m"), "m"),
      "m", nullptr);
  EXPECT_EQ(again.signals[0].value, record.signals[1].value);
}

TEST_F(RecordFile, AFolderThatIsNotThereIsSaid) {
  try {
    write_record(imported(sound_map()), folder_ / "nowhere/run.h5");
    FAIL();
  } catch (const MeasurementError& e) {
    EXPECT_NE(std::string(e.what()).find("there is no folder"), std::string::npos) << e.what();
  }
}

TEST_F(RecordFile, AChangedOrForeignFileIsRefused) {
  const std::string file = folder_ / "run.h5";
  write_record(imported(sound_map()), file);
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(3000);
    bytes.put('\x55');
  }
  EXPECT_THROW(read_record(file), MeasurementError);
  EXPECT_THROW(load_record(file), InputError);
  std::ofstream(folder_ / "run.csv") << "t,q\n0,1\n";
  try {
    load_record(folder_ / "run.csv");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("a table needs --map"), std::string::npos) << e.what();
  }
}

TEST(ImportTable, RefusesAPositionThatStaysWhileItsCommandMoves) {
  MeasuredTable table = table_of(columns());
  for (MeasuredColumn& c : table.columns)
    if (c.name == "pos") std::fill(c.value.begin(), c.value.end(), 0.01);
  try {
    imported(kTime + signal("cmd", "command", "X", "m") + signal("pos", "position", "X", "m") +
                 signal("force", "force", "X", "N"),
             table);
    FAIL();
  } catch (const MeasurementError& e) {
    EXPECT_NE(std::string(e.what()).find("\"pos\" (position X) stays where it is while \"cmd\""),
              std::string::npos)
        << e.what();
  }
}

TEST(ImportTable, KnownForcesMayBeConstantAndNeedACommand) {
  auto all = columns();
  all["push"] = [](double t) { return t > 1 ? 40.0 : 0.0; };
  all["none"] = [](double) { return 0.0; };
  const std::string pushed = signal("push", "applied_force", "X", "N", "scale = 2");
  const Record r =
      imported(sound_map() + pushed + signal("none", "added_force", "X", "N"), table_of(all));
  ASSERT_TRUE(r.find(SignalKind::applied_force, kX));
  EXPECT_NEAR(r.find(SignalKind::applied_force, kX)->value.back(), 80, 1e-3);
  ASSERT_TRUE(r.find(SignalKind::added_force, kX));
  const auto speaks_of = [](const Record& run, const std::string& words) {
    return std::any_of(run.warnings.begin(), run.warnings.end(),
                       [&](const std::string& w) { return w.find(words) != std::string::npos; });
  };
  EXPECT_FALSE(speaks_of(r, "push") || speaks_of(r, "none"));
  const Record without =
      imported(kTime + signal("pos", "position", "X", "m") + pushed, table_of(all));
  EXPECT_TRUE(speaks_of(without, "not used: no command of X"));
}

}  // namespace
}  // namespace vcnc::import_table_test
