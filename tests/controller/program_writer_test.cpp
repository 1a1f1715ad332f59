#include "controller/program_writer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "configs/config.hpp"
#include "controller/player.hpp"
#include "model/geometry/kinematics.hpp"
#include "tests/controller/program_file.hpp"

namespace vcnc::program_writer_test {
namespace {

std::string config(const std::string& name) {
  return std::string(VCNC_SOURCE_DIR) + "/configs/" + name + ".toml";
}
Machine machine_of(const std::string& name) { return load_machine(config("machines/" + name)); }
std::unique_ptr<Piece> piece_of(const std::string& name) {
  return make_piece(load_piece(config("pieces/" + name)));
}

std::vector<PlayerStep> play(const std::string& text, const Machine& machine) {
  const ProgramFile file(text);
  Player player(file.path(), machine);
  std::vector<PlayerStep> steps;
  do {
    steps.push_back(player.step());
  } while (!steps.back().done && steps.size() < 1'000'000);
  EXPECT_TRUE(steps.back().done);
  return steps;
}

/// Steps of the run that moves fast along the surface, with their poses.
struct Lap {
  std::vector<PlayerStep> steps;
  std::vector<ToolPose> poses;
};

/// A lap is what lies between the second and the third dwell (settle before and after), the next
/// one between the fourth and the fifth.
Lap lap_of(const std::vector<PlayerStep>& steps, const Machine& machine, int which = 0) {
  const Kinematics kinematics(machine.kinematics, machine.tool_length(1),
                              machine.setup.work_offset[0]);
  Lap lap;
  int dwells = 0;
  bool waiting = false;
  for (const PlayerStep& step : steps) {
    if (step.dwell && !waiting) ++dwells;
    waiting = step.dwell;
    if (dwells != 2 + 2 * which || step.dwell) continue;
    lap.steps.push_back(step);
    lap.poses.push_back(kinematics.forward(step.position));
  }
  return lap;
}

double share_at_feed(const Lap& lap, double feed) {
  std::size_t full = 0;
  for (const PlayerStep& step : lap.steps) full += step.feed > 0.995 * feed;
  return static_cast<double>(full) / static_cast<double>(lap.steps.size());
}

void expect_home(const std::vector<PlayerStep>& steps, const Machine& machine) {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    EXPECT_NEAR(steps.back().position[i], machine.axes[i].limits.start, 1e-12);
}

TEST(ProgramWriter, SPieceLapFollowsTheSurface) {
  const auto piece = piece_of("s_eq1");
  for (const std::string name : {"trunnion", "head"}) {
    const Machine machine = machine_of(name);
    const ProgramOptions options;
    const auto steps = play(s_piece_program(machine, *piece, options), machine);
    expect_home(steps, machine);
    const Lap lap = lap_of(steps, machine);
    const double wanted = machine.probe.ball_radius - machine.setup.predeflection;
    SurfacePoint foot;
    double worst = 0, travelled = 0, axis_error = 0;
    for (std::size_t k = 0; k < lap.poses.size(); ++k) {
      const Vec3& p = lap.poses[k].p_WT;
      foot = piece->nearest(p, foot);
      worst = std::max(worst, std::abs(foot.distance - wanted));
      EXPECT_NEAR(p.z(), 0.020, 1e-7);
      EXPECT_LE(lap.steps[k].feed, 2000e-3 / 60 * 1.0005);
      if (k > 0) travelled += (p - lap.poses[k - 1].p_WT).norm();
      // The tool axis is the ruling, so it is nearly perpendicular to the normal.
      axis_error = std::max(axis_error, std::abs(foot.n.dot(lap.poses[k].R_WT.col(2))));
    }
    EXPECT_LE(worst, 0.7e-6);  // path tolerance and chord tolerance
    EXPECT_NEAR(travelled, 1.0948 + 0.020, 1e-3);
    EXPECT_LE(axis_error, 0.06);  // the twist between bottom and top normals
    EXPECT_GE(share_at_feed(lap, 2000e-3 / 60), 0.95) << name;
    RecordProperty(name + "_share_at_feed_permille",
                   static_cast<int>(1e3 * share_at_feed(lap, 2000e-3 / 60)));
    RecordProperty(name + "_lap_ms", static_cast<int>(lap.steps.size()));
  }
}

TEST(ProgramWriter, ALapOfSomeHundredPointsIsRunAtItsFeedToo) {
  const auto piece = piece_of("s_eq1");
  for (const std::string name : {"trunnion", "head"}) {
    const Machine machine = machine_of(name);
    ProgramOptions options;
    options.chord_tolerance_um = 20;
    options.tolerance_um = 30;
    const std::string text = s_piece_program(machine, *piece, options);
    EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 700);
    const Lap lap = lap_of(play(text, machine), machine);
    EXPECT_GE(share_at_feed(lap, 2000e-3 / 60), 0.95) << name;
    SurfacePoint foot;
    for (std::size_t k = 0; k < lap.poses.size(); k += 10) {
      foot = piece->nearest(lap.poses[k].p_WT, foot);
      EXPECT_NEAR(foot.distance, machine.probe.ball_radius - machine.setup.predeflection, 50e-6);
    }
  }
}

TEST(ProgramWriter, DirectionsAreOpposite) {
  const auto piece = piece_of("s_eq1");
  const Machine machine = machine_of("trunnion");
  for (const bool clockwise : {false, true}) {
    ProgramOptions options;
    options.direction = clockwise ? ProgramOptions::Direction::clockwise
                                  : ProgramOptions::Direction::counter_clockwise;
    const Lap lap = lap_of(play(s_piece_program(machine, *piece, options), machine), machine);
    double area = 0;  // signed, by the shoelace formula
    for (std::size_t k = 1; k < lap.poses.size(); ++k) {
      const Vec3 &a = lap.poses[k - 1].p_WT, &b = lap.poses[k].p_WT;
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }
    EXPECT_GT(std::abs(area), 1e-3);
    EXPECT_EQ(area < 0, clockwise);
  }
}

TEST(ProgramWriter, ReversedRotaryAxesGiveTheSameLap) {
  const auto piece = piece_of("s_eq1");
  Machine machine = machine_of("trunnion");
  machine.kinematics.a_reversed = machine.kinematics.c_reversed = true;
  const Lap lap = lap_of(play(s_piece_program(machine, *piece, {}), machine), machine);
  SurfacePoint foot;
  for (std::size_t k = 0; k < lap.poses.size(); k += 50) {
    foot = piece->nearest(lap.poses[k].p_WT, foot);
    EXPECT_LE(std::abs(foot.n.dot(lap.poses[k].R_WT.col(2))), 0.06);
  }
}

TEST(ProgramWriter, OptionsReachTheProgram) {
  const auto piece = piece_of("s_eq1");
  const Machine machine = machine_of("head");
  ProgramOptions options;
  options.feed_mm_min = 1234;
  options.height_mm = 15;
  options.predeflection_mm = 0.3;
  options.tolerance_um = 5;
  options.laps = 2;
  const std::string text = s_piece_program(machine, *piece, options);
  for (const char* part : {"F1234", "G64 P0.00500", "M19", "G43.4 H1", "pre-deflection 0.3 mm",
                           "height 15 mm", "G54 G90 G17 G21 G94 G40 G49", "G28 Z0", "M30"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
  const Lap lap = lap_of(play(text, machine), machine);
  SurfacePoint foot;
  for (std::size_t k = 0; k < lap.poses.size(); k += 20) {
    foot = piece->nearest(lap.poses[k].p_WT, foot);
    EXPECT_NEAR(foot.distance, machine.probe.ball_radius - 0.3e-3, 5.2e-6);
  }
  EXPECT_GE(lap.steps.size(), 1094.0 / 1234 * 60e3);
}

/// Every lap begins at rest, so that all are repetitions to the sample.
TEST(ProgramWriter, LapsAreTheSameMotion) {
  for (const std::string name : {"trunnion", "head"})
    for (const bool of_cone : {false, true}) {
      const Machine machine = machine_of(name);
      const auto piece = piece_of(of_cone ? "cone" : "s_eq1");
      ProgramOptions options;
      options.laps = 3;
      const auto steps = play(of_cone ? cone_program(machine, *piece, options)
                                      : s_piece_program(machine, *piece, options),
                              machine);
      expect_home(steps, machine);
      const Lap first = lap_of(steps, machine, 0), last = lap_of(steps, machine, 2);
      ASSERT_GT(first.steps.size(), 10'000U);
      ASSERT_EQ(first.steps.size(), last.steps.size());
      for (std::size_t k = 0; k < first.steps.size(); ++k)
        for (std::size_t i = 0; i < kAxisCount; ++i)
          ASSERT_NEAR(first.steps[k].position[i], last.steps[k].position[i], 1e-9) << k;
    }
}

TEST(ProgramWriter, ConeLapHasTheToolAlongTheRuling) {
  const auto piece = piece_of("cone");
  for (const std::string name : {"trunnion", "head"}) {
    const Machine machine = machine_of(name);
    const auto steps = play(cone_program(machine, *piece, {}), machine);
    expect_home(steps, machine);
    const Lap lap = lap_of(steps, machine);
    ASSERT_GT(lap.steps.size(), 10'000u);
    const double wanted = machine.probe.ball_radius - machine.setup.predeflection;
    for (const ToolPose& pose : lap.poses) {
      const SurfacePoint foot = piece->nearest(pose.p_WT, {});
      EXPECT_NEAR(foot.distance, wanted, 0.7e-6);
      EXPECT_NEAR(foot.n.dot(pose.R_WT.col(2)), 0, 5e-4);
    }
    EXPECT_GE(share_at_feed(lap, 2000e-3 / 60), 0.9);
  }
}

TEST(ProgramWriter, CircleInTheRingIsRunAtConstantSpeed) {
  const auto ring = piece_of("ring");
  for (const std::string name : {"trunnion", "head"}) {
    const Machine machine = machine_of(name);
    for (const bool clockwise : {false, true}) {
      ProgramOptions options;
      options.laps = 2;
      options.direction = clockwise ? ProgramOptions::Direction::clockwise
                                    : ProgramOptions::Direction::counter_clockwise;
      const std::string text = circle_program(machine, ring.get(), options);
      EXPECT_NE(text.find(clockwise ? "G2 X" : "G3 X"), std::string::npos);
      const ProgramFile file(text);
      std::vector<int> full_circles;
      for (const Move& move : read_moves(text, machine))
        if (move.kind == Move::Kind::arc && std::abs(std::abs(move.arc.sweep) - 2 * kPi) < 1e-9)
          full_circles.push_back(move.line);
      ASSERT_EQ(full_circles.size(), 2u);
      const auto steps = play(text, machine);
      expect_home(steps, machine);
      const Kinematics kinematics(machine.kinematics, machine.tool_length(1),
                                  machine.setup.work_offset[0]);
      double turned = 0, before = 0;
      for (const PlayerStep& step : steps) {
        if (step.line < full_circles.front() || step.line > full_circles.back()) continue;
        const Vec3 p = kinematics.forward(step.position).p_WT;
        EXPECT_NEAR(p.head<2>().norm(), 0.1, 0.12e-6);
        EXPECT_NEAR(p.z(), 0, 1e-12);
        EXPECT_NEAR(step.feed, 2000e-3 / 60, 1e-7);
        const double angle = std::atan2(p.y(), p.x());
        if (turned != 0 || before != 0) turned += std::remainder(angle - before, 2 * kPi);
        before = angle;
      }
      EXPECT_NEAR(turned, clockwise ? -4 * kPi : 4 * kPi, 2e-3);
    }
  }
}

TEST(ProgramWriter, FreeCirclesLieInTheirPlane) {
  const Machine machine = machine_of("head");
  for (const int plane : {17, 18, 19}) {
    ProgramOptions options;
    options.plane = plane;
    options.radius_mm = 30;
    options.feed_mm_min = 6000;
    const auto steps = play(circle_program(machine, nullptr, options), machine);
    expect_home(steps, machine);
    const std::size_t normal = static_cast<std::size_t>(19 - plane);
    double reach = 0;
    for (const PlayerStep& step : steps) {
      EXPECT_NEAR(step.position[normal], machine.axes[normal].limits.start, 1e-12);
      double radius2 = 0;
      for (std::size_t i = kX; i <= kZ; ++i)
        radius2 += std::pow(step.position[i] - machine.axes[i].limits.start, 2);
      reach = std::max(reach, std::sqrt(radius2));
    }
    EXPECT_NEAR(reach, 0.030, 0.3e-6);
  }
}

TEST(ProgramWriter, StepsGoForwardAndBack) {
  const Machine machine = machine_of("trunnion");
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    ProgramOptions options;
    options.axis = axis;
    options.steps = 4;
    options.step_size = -2.5;
    options.dwell_s = 0.05;
    options.laps = 2;
    const double scale = is_rotary(axis) ? kDegree : 1e-3;
    std::vector<double> stops;
    bool waiting = false;
    for (const PlayerStep& step : play(step_program(machine, options), machine)) {
      if (step.dwell && !waiting)
        stops.push_back((step.position[axis] - machine.axes[axis].limits.start) / scale);
      waiting = step.dwell;
    }
    std::vector<double> expected{0};  // the spindle's M19 and the first dwell are one wait
    for (int lap = 0; lap < 2; ++lap)
      for (const double at : {-2.5, -5.0, -7.5, -10.0, -7.5, -5.0, -2.5, 0.0})
        expected.push_back(at);
    ASSERT_EQ(stops.size(), expected.size());
    for (std::size_t i = 0; i < stops.size(); ++i) EXPECT_NEAR(stops[i], expected[i], 1e-9);
  }
}

TEST(ProgramWriter, WrongOptionsAreNamed) {
  const Machine machine = machine_of("trunnion");
  const auto rim = piece_of("s_eq1"), cone = piece_of("cone"), ring = piece_of("ring");
  const auto message = [](auto&& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto changed = [](auto change) {
    ProgramOptions options;
    change(options);
    return options;
  };
  const auto expect = [&](const std::string& part, auto change) {
    const std::string text = message([&] { s_piece_program(machine, *rim, changed(change)); });
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect("feed_mm_min", [](ProgramOptions& o) { o.feed_mm_min = 0; });
  expect("tolerance_um", [](ProgramOptions& o) { o.tolerance_um = -1; });
  expect("chord_tolerance_um", [](ProgramOptions& o) { o.chord_tolerance_um = 0; });
  expect("predeflection_mm", [](ProgramOptions& o) { o.predeflection_mm = 5; });
  expect("laps", [](ProgramOptions& o) { o.laps = 0; });
  expect("run_in_mm", [](ProgramOptions& o) { o.run_in_mm = -1; });
  expect("z:", [](ProgramOptions& o) { o.height_mm = 100; });
  EXPECT_NE(message([&] { s_piece_program(machine, *cone, {}); }).find("kind = ruled"),
            std::string::npos);
  EXPECT_NE(message([&] { cone_program(machine, *rim, {}); }).find("kind = cone"),
            std::string::npos);
  EXPECT_NE(message([&] { circle_program(machine, rim.get(), {}); }).find("kind = ring"),
            std::string::npos);
  EXPECT_NE(message([&] { circle_program(machine, nullptr, {}); }).find("radius_mm"),
            std::string::npos);
  EXPECT_NE(message([&] {
              circle_program(machine, ring.get(), changed([](ProgramOptions& o) { o.plane = 18; }));
            }).find("plane"),
            std::string::npos);
  EXPECT_NE(message([&] {
              step_program(machine, changed([](ProgramOptions& o) { o.steps = 1000; }));
            }).find("steps x step_size"),
            std::string::npos);
  EXPECT_NE(message([&] {
              step_program(machine, changed([](ProgramOptions& o) { o.step_size = 0; }));
            }).find("step_size"),
            std::string::npos);
}

}  // namespace
}  // namespace vcnc::program_writer_test
