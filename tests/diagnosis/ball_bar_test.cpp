// A ball bar from its table to what is wrong with the machine.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "apps/experiments.hpp"
#include "configs/config.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/records/bar_course.hpp"
#include "diagnosis/records/import_table.hpp"
#include "diagnosis/records/record_file.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "model/probe/noise.hpp"
#include "tests/scratch.hpp"

namespace vcnc::ball_bar_test {
namespace {

constexpr double kPeriod = 1e-3, kRadius = 0.1, kFeed = 0.1;  // 6000 mm/min
constexpr double kSpeed = kFeed / kRadius, kLap = 2 * kPi / kSpeed;
constexpr double kPause = 10;  // [s] of the table between its two arcs

constexpr const char* kSound = R"(
[time]
column = "t"
unit = "s"

[[signals]]
column = "r"
kind = "bar"
unit = "um"

[bar]
centre_mm = [20, -10, 100]
radius_mm = 100
feed_mm_min = 6000
)";

std::string arc(double from, double start_deg, double sweep_deg) {
  return fmt::format("[[arcs]]\nfrom_s = {}\nstart_deg = {}\nsweep_deg = {}\n", from, start_deg,
                     sweep_deg);
}

/// Some laps each way, with noise for a length.
MeasuredTable table(int laps) {
  MeasuredTable t{.source = "bar.csv", .columns = {}, .line = {}};
  t.columns.resize(2);
  t.columns[0].name = "t";
  t.columns[1].name = "r";
  for (const double begin : {0.0, laps * kLap + kPause})
    for (double s = 0; s <= laps * kLap; s += kPeriod) {
      t.columns[0].value.push_back(std::round((begin + s) / kPeriod) * kPeriod);
      t.columns[1].value.push_back(0.1 * gaussian_noise(3, 0, t.columns[0].value.size())[0]);
      t.line.push_back(t.line.size() + 2);
    }
  return t;
}

Record record(int laps, const std::string& plane = "") {
  const std::string map = kSound + (plane.empty() ? "" : "plane = \"" + plane + "\"\n") +
                          arc(0, 0, 360 * laps) + arc(laps * kLap + kPause, 360, -360 * laps);
  return import_table(table(laps), parse_import_map(map, "map.toml"), "map.toml", nullptr);
}

Machine trunnion() { return declared(ideal_machine()); }

/// The reading of `machine` less that of the declared one, and the angle of each sample.
struct Effect {
  std::vector<double> reading, angle;
};
Effect effect(const std::string& plane, const std::string& key, double value) {
  const Record run = record(1, plane);
  MachineReplica replica(run, trunnion(), std::nullopt);
  Machine machine = trunnion();
  move_number(machine, key, value);
  Effect e;
  std::size_t c = 0;
  while (replica.channels()[c].kind != SignalKind::bar) ++c;
  const Prediction before = replica.predict(trunnion()), after = replica.predict(machine);
  const std::size_t one = plane == "ZX"   ? kZ
                          : plane == "YZ" ? kY
                                          : kX,
                    other = plane == "ZX"   ? kX
                            : plane == "YZ" ? kZ
                                            : kY;
  const auto from_centre = [&](std::size_t axis, std::size_t k) {
    return run.find(SignalKind::command, axis)->value[k] -
           run.on_table->zero[static_cast<Eigen::Index>(axis)];
  };
  for (std::size_t k = 0; k < run.samples(); ++k) {
    if (!std::isfinite(run.find(SignalKind::bar, 0)->value[k])) continue;
    e.reading.push_back(after[c][k] - before[c][k]);
    e.angle.push_back(std::atan2(from_centre(other, k), from_centre(one, k)));
  }
  return e;
}

/// Amplitudes of the cosine and of the sine with so many waves per lap; of none, the mean.
std::pair<double, double> harmonic(const Effect& e, int waves) {
  double cosine = 0, sine = 0;
  for (std::size_t k = 0; k < e.reading.size(); ++k) {
    cosine += e.reading[k] * std::cos(waves * e.angle[k]);
    sine += e.reading[k] * std::sin(waves * e.angle[k]);
  }
  const double n = static_cast<double>(e.reading.size()) / (waves > 0 ? 2 : 1);
  return {cosine / n, sine / n};
}

TEST(BarCourse, IsAtItsAngleAndSpeedInEveryArc) {
  const MeasuredTable t = table(1);
  const BarCourse course = bar_course({{0, 0, 2 * kPi}, {kLap + kPause, 2 * kPi, -2 * kPi}}, kSpeed,
                                      t.columns[0].value, kPeriod);
  EXPECT_NEAR(course.later, 0, 1e-9);
  std::size_t rows = 0;
  for (std::size_t i = 0; i < t.rows(); ++i) {
    if (course.sample[i] == BarCourse::kNone) continue;
    ++rows;
    const double s = t.columns[0].value[i], at = course.angle[course.sample[i]];
    const double there = s <= kLap + 1e-9 ? kSpeed * s : 2 * kPi - kSpeed * (s - kLap - kPause);
    EXPECT_NEAR(std::remainder(at - there, 2 * kPi), 0, 1e-6) << s;
    EXPECT_NEAR(course.begin + static_cast<double>(course.sample[i]) * kPeriod, s, 1e-9);
  }
  EXPECT_GT(rows, t.rows() - 3);  // an end may fall between two
  double fastest = 0, hardest = 0;
  for (std::size_t k = 2; k < course.angle.size(); ++k) {
    const double v = (course.angle[k] - course.angle[k - 1]) / kPeriod,
                 u = (course.angle[k - 1] - course.angle[k - 2]) / kPeriod;
    fastest = std::max(fastest, std::abs(v));
    hardest = std::max(hardest, std::abs(v - u) / kPeriod);
  }
  EXPECT_NEAR(fastest, kSpeed, 1e-6);
  EXPECT_LT(hardest, 4 * kSpeed);  // 1.5 w / 0.5 s in the ramps
  EXPECT_EQ(course.angle[1], course.angle[0]);
}

TEST(BarCourse, TurnsRoundBetweenArcsThatTheTableHasNoTimeBetween) {
  const MeasuredTable t = table(1);
  const BarCourse course =
      bar_course({{0, 0, 2 * kPi}, {kLap + 0.5, 0, -2 * kPi}}, kSpeed, t.columns[0].value, kPeriod);
  EXPECT_GT(course.later, 1.5);
  double hardest = 0;
  for (std::size_t k = 2; k < course.angle.size(); ++k)
    hardest = std::max(hardest,
                       std::abs(course.angle[k] - 2 * course.angle[k - 1] + course.angle[k - 2]));
  EXPECT_LT(hardest / kPeriod / kPeriod, 4 * kSpeed);
}

TEST(BallBar, ReadsWhatTheGeometrySays) {
  const Effect off = effect("XY", "effects.setup.piece_offset.shift_um.x", 10);
  ASSERT_GT(off.reading.size(), 10000U);
  EXPECT_NEAR(harmonic(off, 1).first, -10e-6, 5e-9);
  EXPECT_NEAR(harmonic(off, 1).second, 0, 5e-9);
  // dr = a x y / R = (a R / 2) sin 2 phi, about the centre
  const Effect square = effect("XY", "effects.geometry.squareness.xy_urad", 50);
  EXPECT_NEAR(std::abs(harmonic(square, 2).second), 0.5 * kRadius * 50e-6, 5e-9);
  EXPECT_NEAR(harmonic(square, 2).first, 0, 5e-9);
  // dr = s z^2 / R = (s R / 2) (1 - cos 2 phi), phi from Y to Z
  const Effect scale = effect("YZ", "effects.Z.scale_error.error_ppm", 100);
  EXPECT_NEAR(harmonic(scale, 2).first, -0.5 * kRadius * 100e-6, 5e-9);
  EXPECT_NEAR(harmonic(scale, 0).first, 0.5 * kRadius * 100e-6, 5e-9);
  const Effect zero = effect("ZX", "effects.probe.tip_radius.larger_um", 3);
  EXPECT_NEAR(harmonic(zero, 0).first, 3e-6, 1e-9);
  EXPECT_NEAR(harmonic(zero, 1).first, 0, 1e-9);
}

TEST(BallBar, IsInTheFileOfARecord) {
  const Scratch scratch;
  const std::string file = scratch / "bar.h5";
  const Record written = record(1);
  write_record(written, file);
  const Record back = read_record(file);
  ASSERT_TRUE(back.on_table.has_value());
  EXPECT_EQ(*back.on_table, *written.on_table);
  ASSERT_NE(back.find(SignalKind::bar, 0), nullptr);
  EXPECT_EQ(back.find(SignalKind::command, kX)->value,
            written.find(SignalKind::command, kX)->value);
}

std::string refusal(const MeasuredTable& t, const std::string& map) {
  try {
    import_table(t, parse_import_map(map, "map.toml"), "map.toml", nullptr);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}
std::string refusal(const std::string& map) { return refusal(table(1), map); }

std::string with(std::string map, const std::string& line, const std::string& instead) {
  return map.replace(map.find(line), line.size(), instead);
}

TEST(BallBar, RefusesWithKeyAndReason) {
  const auto without = [](const std::string& line) {
    std::string map = kSound;
    return map.erase(map.find(line), line.size() + 1);
  };
  const std::vector<std::pair<std::string, std::string>> cases{
      {without("radius_mm = 100"), "bar.radius_mm: is missing"},
      {without("centre_mm = [20, -10, 100]"), "bar.centre_mm: is missing"},
      {without("feed_mm_min = 6000") + arc(0, 0, 360), "bar.feed_mm_min: is missing; arcs need"},
      {kSound, "signals.kind: a bar needs how the axes moved"},
      {kSound + arc(0, 0, 360) + "[[laps]]\nfrom_s = 0\nto_s = 2\n",
       "map.toml:19: laps: arcs say already"},
      {"lap_column = \"time\"\n" + (kSound + arc(0, 0, 360)),
       "map.toml:1: lap_column: arcs say already"},
      {std::string(kSound) + arc(0, 0, 5), "arcs.sweep_deg: 5 is too short an arc"},
      {std::string(kSound) + arc(0, 0, 360) + arc(2, 0, 360),
       "arcs.from_s: the arc begins before the one above it ends"},
      {std::string(kSound) + arc(90, 0, 360),
       "arcs.from_s: from 90.000 to 96.283 s there are 0 of"},
      {std::string(kSound) + "[[signals]]\ncolumn = \"x\"\nkind = \"deflection\"\naxis = \"x\"\n"
                             "unit = \"um\"\n",
       "signals.kind: a bar was read as well"},
      {std::string(kSound) + arc(0, 0, 360) +
           "[[signals]]\ncolumn = \"x\"\nkind = \"command\"\naxis = \"X\"\nunit = \"mm\"\n",
       "signals.kind: with arcs the bar alone can be read, no command"},
      {R"([time]
column = "t"
unit = "s"
[[signals]]
column = "r"
kind = "position"
axis = "X"
unit = "um"
[bar]
radius_mm = 100
)",
       "bar.radius_mm: no column is of kind bar"}};
  for (const auto& [map, reason] : cases)
    EXPECT_NE(refusal(map).find(reason), std::string::npos) << reason << "\n" << refusal(map);
}

TEST(BallBar, AnArcIsWhereItsReadingsAre) {
  const std::string both = arc(0, 0, 360) + arc(kLap + kPause, 360, -360), map = kSound + both,
                    feed = "feed_mm_min = 6000";
  EXPECT_EQ(refusal(map), "");
  const std::vector<std::pair<std::string, std::string>> cases{
      {with(map, feed, "feed_mm_min = 6050"),
       "ends by sweep, radius and feed at 6.231 s, but they go on without a break to 6.283 s; if "
       "these are of it a feed of 6000.18 mm/min fits"},
      {with(map, feed, "feed_mm_min = 5950"), "the last reading of this arc is at 6.283 s"},
      {kSound + arc(0, 0, 350), "go on without a break to 6.283 s"},
      {kSound + arc(kLap, 0, -360), "there are 1 of"},
      {kSound + arc(kLap + kPause - 0.3, 360, -360), "the first reading of this arc is at 16.283"},
      {kSound + arc(0.3, 0, 342.8), "come without a break from 0.000 s on"}};
  for (const auto& [wrong, reason] : cases)
    EXPECT_NE(refusal(wrong).find(reason), std::string::npos) << reason << "\n" << refusal(wrong);
  // A bar that is read all the time: what is before and after an arc is none of it.
  EXPECT_EQ(refusal(kSound + arc(0.5, 30, 300)), "");
}

TEST(BallBar, MissingReadingsOfAnArcAreTold) {
  MeasuredTable t = table(1);
  for (std::size_t i = 2000; i < 2100; ++i) t.columns[1].value[i] = std::nan("");
  const std::string map = kSound + arc(0, 0, 360) + arc(kLap + kPause, 360, -360);
  const Record told = import_table(t, parse_import_map(map, "map.toml"), "map.toml", nullptr);
  EXPECT_TRUE(
      std::any_of(told.warnings.begin(), told.warnings.end(), [](const std::string& warning) {
        return warning.find("100 of 6284 readings are missing") != std::string::npos;
      }));
  for (double& v : t.columns[1].value) v = std::nan("");
  EXPECT_NE(refusal(t, map).find("\"r\" has no value at all"), std::string::npos);
}

TEST(BallBar, ReadsNoMoreThanABarMovesBy) {
  const std::string map = kSound + arc(0, 0, 360) + arc(kLap + kPause, 360, -360);
  MeasuredTable t = table(1);
  for (double& v : t.columns[1].value) v += 12;
  EXPECT_NE(refusal(t, with(map, "\"um\"", "\"mm\"")).find("check its unit and scale"),
            std::string::npos);
  for (double& v : t.columns[1].value) v = 100 + 1e-3 * v;
  EXPECT_NE(refusal(t, with(map, "\"um\"", "\"mm\"")).find("this is its whole length"),
            std::string::npos);
}

/// Two laps each way of a machine that is as declared but for two faults.
TEST(BallBarDiagnosis, NamesPlayAndSquareness) {
  Record run = record(2);
  const Machine model = trunnion();
  MachineReplica replica(run, model, std::nullopt);
  Machine truth = model;
  move_number(truth, "effects.X.load_play.width_um", 6);
  move_number(truth, "effects.geometry.squareness.xy_urad", 40);
  move_number(truth, "effects.setup.piece_offset.shift_um.y", -15);
  const std::vector<double> reading = replica.predict(truth)[0];
  for (MeasuredSignal& s : run.signals)
    for (std::size_t k = 0; s.kind == SignalKind::bar && k < reading.size(); ++k)
      if (std::isfinite(s.value[k])) s.value[k] = reading[k] + 0.1e-6 * gaussian_noise(11, 1, k)[0];
  std::vector<Candidate> some = candidates(model);
  std::erase_if(some, [](const Candidate& c) {
    return !std::set<std::string>{"backlash",   "load_play",         "lost_motion", "coulomb",
                                  "kv_error",   "pitch_progressive", "squareness",  "straightness",
                                  "probe_gain", "sample_latency"}
                .contains(c.effect);
  });
  const Diagnosis d = diagnose({run, replica, model, some});
  EXPECT_EQ(d.verdict, DiagnosisVerdict::explained);
  std::set<std::string> names;
  for (const FoundEffect& e : d.effects) names.insert(e.name);
  EXPECT_EQ(names, (std::set<std::string>{"piece_offset", "load_play", "squareness"}));
  EXPECT_NEAR(number_of(d.found, "effects.setup.piece_offset.shift_um.y"), -15, 0.1);
  EXPECT_NEAR(number_of(d.found, "effects.X.load_play.width_um"), 6, 0.1);
  EXPECT_NEAR(number_of(d.found, "effects.geometry.squareness.xy_urad"), 40, 1);
}

}  // namespace
}  // namespace vcnc::ball_bar_test
