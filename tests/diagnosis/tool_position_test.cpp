// Where the tool is against the table, from a grid encoder or an R-test, to what is wrong.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "apps/experiments.hpp"
#include "configs/config.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/laws/law_columns.hpp"
#include "diagnosis/records/import_table.hpp"
#include "diagnosis/records/record_file.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "diagnosis/screening/consequence.hpp"
#include "model/geometry/kinematics.hpp"
#include "model/probe/noise.hpp"
#include "tests/scratch.hpp"

namespace vcnc::tool_position_test {
namespace {

constexpr double kPeriod = 1e-3, kTurn = 8, kPause = 1;  // [s]
constexpr double kNoise = 0.1e-6;

Machine trunnion() { return declared(ideal_machine()); }

Kinematics kinematics_of(const Machine& m) {
  return Kinematics(m.kinematics, m.probe.length, m.setup.work_offset[0]);
}

/// Axis positions for every share of a motion of `turn` [s] that begins and ends at rest, there and
/// back `laps` times.
template <class PositionsAt>
Record there_and_back(int laps, const PositionsAt& at, double turn = kTurn) {
  Record record;
  record.source = "table";
  record.period = kPeriod;
  std::array<std::vector<double>, kAxisCount> q;
  const auto add = [&](double share) {
    const AxisVector now = at(share);
    for (std::size_t i = 0; i < kAxisCount; ++i) q[i].push_back(now[i]);
  };
  const auto pause = [&](double share) {
    for (int k = 0; k < std::lround(kPause / kPeriod); ++k) add(share);
  };
  for (int lap = 0; lap < laps; ++lap)
    for (const bool back : {false, true}) {
      pause(back ? 1 : 0);
      const std::size_t begin = q[0].size();
      const int n = static_cast<int>(std::lround(turn / kPeriod));
      for (int k = 0; k <= n; ++k) {
        const double u = static_cast<double>(k) / n;
        const double s = u * u * u * (10 - 15 * u + 6 * u * u);
        add(back ? 1 - s : s);
      }
      record.stretches.push_back({begin, q[0].size(), back ? 1 : 0, lap, back ? "back" : "there"});
    }
  pause(0);
  for (std::size_t i = 0; i < kAxisCount; ++i)
    record.signals.push_back({SignalKind::command, i, "q", q[i], 0});
  for (std::size_t c = 0; c < 3; ++c)
    record.signals.push_back(
        {SignalKind::tool_position, c, "p", std::vector<double>(q[0].size(), 0.0), 0});
  return record;
}

/// The ball of an R-test, held on the table while A tilts to 40 deg and C turns once.
Record ball_held(int laps, double turn = kTurn) {
  const Kinematics kinematics = kinematics_of(trunnion());
  const Vec3 p_WT(0.05, 0.02, 0.04);
  Record record = there_and_back(
      laps,
      [&](double share) {
        return kinematics.inverse(p_WT, 40 * kDegree * std::sin(kPi * share), 2 * kPi * share);
      },
      turn);
  const AxisVector begin = kinematics.inverse(p_WT, 0, 0);
  record.on_table = {Vec3(begin[kX], begin[kY], begin[kZ]), 0};
  return record;
}

/// A circle of 60 mm about where the grid reads zero, with a run-in from there.
constexpr double kRadius = 0.06;
Record on_the_grid(int laps) {
  const Vec3 zero(0.02, -0.01, 0.1);
  Record record = there_and_back(laps, [&](double share) {
    const double angle = 2 * kPi * share;
    AxisVector q = {};
    q[kX] = zero.x() + kRadius * (std::cos(angle) - 1);
    q[kY] = zero.y() + kRadius * std::sin(angle);
    q[kZ] = zero.z();
    return q;
  });
  record.on_table = {zero, 0};
  return record;
}

/// What `key` adds to the three readings, and the commands.
std::array<std::vector<double>, 3> change(const Record& run, const std::string& key, double value) {
  const Machine model = trunnion();
  const MachineReplica replica(run, model, std::nullopt);
  Machine machine = model;
  move_number(machine, key, value);
  const Prediction before = replica.predict(model), after = replica.predict(machine);
  std::array<std::vector<double>, 3> d;
  for (std::size_t c = 0; c < replica.channels().size(); ++c) {
    if (replica.channels()[c].kind != SignalKind::tool_position) continue;
    for (std::size_t k = 0; k < run.samples(); ++k)
      d[replica.channels()[c].axis].push_back(after[c][k] - before[c][k]);
  }
  return d;
}

/// A laser on X sees of Y what its mirror is tilted by, a thousandth at most: no cause is sought
/// there.
TEST(ToolPosition, OfOneComponentHasNoLawOfAnAxisThatItDoesNotSee) {
  Record run = on_the_grid(3);
  std::erase_if(run.signals, [](const MeasuredSignal& s) {
    return s.kind == SignalKind::tool_position && s.axis != 0;
  });
  const Machine model = trunnion();
  MachineReplica replica(run, model, std::nullopt);
  Evidence evidence(run, replica, model);
  FittedMachine at;
  at.machine = model;
  at.machine.effects.get<PieceTilt>().tilt.z() = 1e-3;
  at.prediction = evidence.predict(at.machine);
  std::set<std::size_t> displaced, pushed;
  for (const Law& law : LawColumns(evidence, at).all())
    (law.point == Law::Point::displacement ? displaced : pushed).insert(law.axis_index());
  EXPECT_EQ(displaced, std::set<std::size_t>{kX});
  EXPECT_EQ(pushed, (std::set<std::size_t>{kX, kY}));
}

TEST(ToolPosition, OfAHeldBallIsTheClosedFormOfAnAxisThatIsElsewhere) {
  const Record run = ball_held(1);
  const auto d = change(run, "effects.geometry.c_axis_offset.x_um", 20);
  const std::vector<double>& c = run.find(SignalKind::command, kC)->value;
  const std::vector<double>& a = run.find(SignalKind::command, kA)->value;
  ASSERT_EQ(d[0].size(), run.samples());
  // e_x = (1 - cos C) x,  e_y = -sin C x; what A does to it is of second order.
  double farthest = 0;
  for (std::size_t k = 0; k < run.samples(); ++k) {
    if (a[k] != 0) continue;
    EXPECT_NEAR(d[0][k], 20e-6 * (1 - std::cos(c[k])), 2e-8) << k;
    EXPECT_NEAR(d[1][k], -20e-6 * std::sin(c[k]), 2e-8) << k;
  }
  for (std::size_t k = 0; k < run.samples(); ++k) farthest = std::max(farthest, d[0][k]);
  EXPECT_NEAR(farthest, 40e-6, 1e-6);
}

/// Whatever C is when the run begins, the frame is that of X, Y and Z.
TEST(ToolPosition, IsToldInTheFrameOfTheAxesWhereTheRunBegins) {
  for (const double turned : {90 * kDegree, 180 * kDegree}) {
    Record run = on_the_grid(1);
    for (MeasuredSignal& s : run.signals)
      if (s.kind == SignalKind::command && s.axis == kC)
        std::fill(s.value.begin(), s.value.end(), turned);
    const MachineReplica replica(run, trunnion(), std::nullopt);
    const Prediction p = replica.predict(trunnion());
    for (std::size_t c = 0; c < p.size(); ++c) {
      const auto& [kind, axis] = replica.channels()[c];
      if (kind != SignalKind::tool_position) continue;
      const std::vector<double>& told = run.find(SignalKind::command, axis)->value;
      for (std::size_t k = 0; k < run.samples(); k += 10)
        EXPECT_NEAR(p[c][k], told[k] - run.on_table->zero[static_cast<Eigen::Index>(axis)], 2e-3);
    }
  }
}

/// What is declared of the probe that touches is none of a grid's.
TEST(ToolPosition, KnowsNothingOfTheDeclaredProbe) {
  const Record run = on_the_grid(1);
  Machine probing = trunnion();
  move_number(probing, "effects.probe.probe_gain.gain_percent.x", 1);
  const MachineReplica replica(run, probing, std::nullopt), plain(run, trunnion(), std::nullopt);
  const Prediction p = replica.predict(probing), q = plain.predict(trunnion());
  ASSERT_EQ(p.size(), q.size());
  for (std::size_t c = 0; c < p.size(); ++c)
    for (std::size_t k = 0; k < run.samples(); ++k) EXPECT_EQ(p[c][k], q[c][k]);
}

TEST(ToolPosition, OnAGridIsWhereTheAxesAre) {
  const Record run = on_the_grid(1);
  const MachineReplica replica(run, trunnion(), std::nullopt);
  const Prediction p = replica.predict(trunnion());
  const std::vector<double>&x = run.find(SignalKind::command, kX)->value,
        &y = run.find(SignalKind::command, kY)->value;
  const auto square = change(run, "effects.geometry.squareness.xy_urad", 50);
  const auto scale = change(run, "effects.Y.scale_error.error_ppm", 100);
  const auto moved = change(run, "effects.setup.piece_offset.shift_um.x", 10);
  for (std::size_t k = 0; k < run.samples(); ++k) {
    EXPECT_NEAR(square[0][k], 50e-6 * y[k], 2e-9);
    EXPECT_NEAR(square[1][k], 0, 2e-9);
    EXPECT_NEAR(scale[1][k], 100e-6 * y[k], 2e-9);
    EXPECT_NEAR(moved[0][k], -10e-6, 2e-9);
  }
  // The loops follow to some tens of micrometres.
  for (std::size_t c = 0; c < p.size(); ++c)
    if (replica.channels()[c].kind == SignalKind::tool_position && replica.channels()[c].axis < 2) {
      const Vec3& zero = run.on_table->zero;
      const bool is_x = replica.channels()[c].axis == 0;
      for (std::size_t k = 0; k < run.samples(); ++k)
        EXPECT_NEAR(p[c][k], is_x ? x[k] - zero.x() : y[k] - zero.y(), 2e-3);
    }
}

/// That it leans out of the plane shows by its square alone, which no fit may use.
TEST(ToolPosition, OnAGridTellsNothingOfWhatLiesAcrossIt) {
  Record run = on_the_grid(1);
  std::erase_if(run.signals, [](const MeasuredSignal& s) {
    return s.kind == SignalKind::tool_position && s.axis == kZ;
  });
  const auto leans = change(run, "effects.setup.piece_tilt.tilt_urad.x", 2000),
             higher = change(run, "effects.setup.piece_offset.shift_um.z", 500),
             turned = change(run, "effects.setup.piece_tilt.tilt_urad.z", 100);
  for (std::size_t k = 0; k < run.samples(); ++k)
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(leans[c][k], 0);
      EXPECT_EQ(higher[c][k], 0);
    }
  const auto [low, high] = std::minmax_element(turned[0].begin(), turned[0].end());
  EXPECT_NEAR(*high - *low, 100e-6 * 2 * kRadius, 1e-9);
}

TEST(ToolPosition, ContourErrorIsAcrossTheWay) {
  const Record run = on_the_grid(2);
  const Machine model = trunnion();
  MachineReplica replica(run, model, std::nullopt);
  const Evidence evidence(run, replica, model);
  const auto contour_of = [&](const std::string& key, double value) {
    Machine machine = model;
    move_number(machine, key, value);
    return consequence(evidence, replica.predict(machine), replica.predict(model)).contour_um;
  };
  // At 47 mm/s on average 1 ms is some 47 um along the circle, and v^2 t^2 / 2 R across it.
  EXPECT_LT(contour_of("effects.probe.sample_latency.latency_us", 1000), 1);
  // Whoever turns with the circle is off across it half of the time.
  EXPECT_NEAR(contour_of("effects.setup.piece_offset.shift_um.x", 10), 10 / std::sqrt(2), 2);
}

constexpr const char* kMap = R"(
[time]
column = "t"
unit = "s"

[[signals]]
column = "X"
kind = "command"
axis = "X"
unit = "mm"

[[signals]]
column = "px"
kind = "tool_position"
axis = "x"
unit = "mm"

[[signals]]
column = "py"
kind = "tool_position"
axis = "y"
unit = "um"

[tool_position]
zero_mm = [20, -10, 100]
)";

MeasuredTable table() {
  MeasuredTable t{.source = "grid.csv", .columns = {}, .line = {}};
  t.columns.resize(4);
  t.columns[0].name = "t";
  t.columns[1].name = "X";
  t.columns[2].name = "px";
  t.columns[3].name = "py";
  for (int k = 0; k < 3000; ++k) {
    const double angle = 1e-3 * k;
    t.columns[0].value.push_back(1e-3 * k);
    t.columns[1].value.push_back(20 + 60 * std::cos(angle));
    t.columns[2].value.push_back(60 * std::cos(angle) +
                                 1e-4 * gaussian_noise(1, 0, t.line.size())[0]);
    t.columns[3].value.push_back(6e4 * std::sin(angle) +
                                 0.1 * gaussian_noise(1, 1, t.line.size())[0]);
    t.line.push_back(t.line.size() + 2);
  }
  return t;
}

Record imported(const std::string& map) {
  return import_table(table(), parse_import_map(map, "map.toml"), "map.toml", nullptr);
}

TEST(ToolPosition, ComesFromATableAndIsInTheFileOfItsRecord) {
  const Record record = imported(kMap);
  ASSERT_TRUE(record.on_table.has_value());
  EXPECT_EQ(record.on_table->zero, Vec3(0.02, -0.01, 0.1));
  EXPECT_FALSE(record.on_table->is_bar());
  EXPECT_NEAR(record.find(SignalKind::tool_position, 1)->value[1571], 0.06, 1e-6);
  const Scratch scratch;
  write_record(record, scratch / "grid.h5");
  const Record back = read_record(scratch / "grid.h5");
  EXPECT_EQ(back.on_table, record.on_table);
  EXPECT_EQ(back.find(SignalKind::tool_position, 0)->value,
            record.find(SignalKind::tool_position, 0)->value);
}

TEST(ToolPosition, RefusesWithKeyAndReason) {
  const auto refusal = [](const std::string& map) -> std::string {
    try {
      imported(map);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const auto replaced = [](const std::string& what, const std::string& with) {
    std::string map = kMap;
    return map.replace(map.find(what), what.size(), with);
  };
  const std::vector<std::pair<std::string, std::string>> cases{
      {replaced("zero_mm = [20, -10, 100]", ""), "tool_position.zero_mm: is missing"},
      {replaced("kind = \"tool_position\"\naxis = \"y\"", "kind = \"deflection\"\naxis = \"y\""),
       "signals.kind: a tool_position was read as well"},
      {replaced("kind = \"tool_position\"\naxis = \"y\"", "kind = \"tool_position\"\naxis = \"Y\""),
       "allowed x, y, z of the table"},
      {replaced("unit = \"um\"", "unit = \"deg\""), "allowed for the tool_position of the tool"},
      {R"([time]
column = "t"
unit = "s"
[[signals]]
column = "X"
kind = "position"
axis = "X"
unit = "mm"
[tool_position]
zero_mm = [1, 2, 3]
)",
       "tool_position.zero_mm: no column is of kind tool_position"}};
  for (const auto& [map, reason] : cases)
    EXPECT_NE(refusal(map).find(reason), std::string::npos) << reason << "\n" << refusal(map);
}

/// Two laps of an R-test of a machine whose C axis is elsewhere and leans.
TEST(ToolPositionDiagnosis, NamesWhereTheRotaryAxisIs) {
  Record run = ball_held(2, 2);
  const Machine model = trunnion();
  MachineReplica replica(run, model, std::nullopt);
  Machine truth = model;
  move_number(truth, "effects.geometry.c_axis_offset.x_um", 12);
  move_number(truth, "effects.geometry.c_axis_offset.y_um", -8);
  move_number(truth, "effects.geometry.a_axis_tilt.about_z_urad", 30);
  move_number(truth, "effects.setup.piece_offset.shift_um.y", -15);
  const Prediction reading = replica.predict(truth);
  for (std::size_t c = 0; c < reading.size(); ++c)
    for (MeasuredSignal& s : run.signals)
      for (std::size_t k = 0; k < run.samples() && s.kind == SignalKind::tool_position &&
                              s.axis == replica.channels()[c].axis;
           ++k)
        s.value[k] = reading[c][k] + kNoise * gaussian_noise(11, c, k)[0];
  std::vector<Candidate> some = candidates(model);
  std::erase_if(some, [](const Candidate& c) {
    return !std::set<std::string>{"a_axis_offset", "a_axis_tilt",   "c_axis_offset",
                                  "c_axis_tilt",   "squareness",    "rotary_runout",
                                  "backlash",      "sample_latency"}
                .contains(c.effect);
  });
  const Diagnosis d = diagnose({run, replica, model, some});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  std::set<std::string> names;  // how the sensor stands, one place of the ball does not tell
  for (const FoundEffect& e : d.effects)
    if (e.place != "setup") names.insert(e.name);
  EXPECT_EQ(names, (std::set<std::string>{"a_axis_tilt", "c_axis_offset"}));
  EXPECT_NEAR(number_of(d.found, "effects.geometry.c_axis_offset.x_um"), 12, 0.1);
  EXPECT_NEAR(number_of(d.found, "effects.geometry.c_axis_offset.y_um"), -8, 0.1);
  EXPECT_NEAR(number_of(d.found, "effects.geometry.a_axis_tilt.about_z_urad"), 30, 1);
}

}  // namespace
}  // namespace vcnc::tool_position_test
