#include "controller/planner_law.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::planner_law_test {
namespace {

MotionLimits limits() {
  Machine machine;
  for (std::size_t i = 0; i < kAxisCount; ++i) machine.axes[i].limits = {-1, 1, 0, 0.5, 5, 50};
  return MotionLimits(machine, 1);
}

/// Nodes of a straight path along X with the speed limit v(s).
template <class Limit>
std::vector<LimitNode> nodes(double length, int count, Limit v) {
  std::vector<LimitNode> result;
  for (int j = 0; j <= count; ++j) {
    LimitNode node;
    node.s = length * j / count;
    node.v_max = v(node.s);
    node.d1 = Coordinates::Unit(kX);
    node.d2 = node.d3 = Coordinates::Zero();
    result.push_back(node);
  }
  return result;
}

TEST(SpeedLaw, OfALineIsTheClosedForm) {
  // Window T: acceleration a = min(5, J T / 2); duration L/v + v/a + T.
  const double window = 0.1, v = 0.2, length = 0.3, a = 50 * window / 2;
  const SpeedLaw law(nodes(length, 3000, [&](double) { return v; }), limits(), window);
  EXPECT_NEAR(law.duration(), length / v + v / a + window, 1e-3);
  EXPECT_EQ(law.at(0).s, 0);
  EXPECT_EQ(law.at(law.duration()).s, length);
  EXPECT_NEAR(law.at(law.duration() / 2).s, length / 2, 1e-12);
  EXPECT_NEAR(law.at(law.duration() / 2).ds, v, 1e-12);
}

TEST(SpeedLaw, TheSpeedIsTheDerivativeAndTheJerkIsBounded) {
  const SpeedLaw law =
      SpeedLaw::fastest(nodes(0.2, 800, [](double s) { return s < 0.1 ? 0.3 : 0.05; }), limits());
  const double e = 1e-4;
  for (double t = 3 * e; t < law.duration() - 3 * e; t += 1.3e-3) {
    EXPECT_NEAR((law.at(t + e).s - law.at(t - e).s) / (2 * e), law.at(t).ds, 50 * e * e);
    const double jerk = (law.at(t + e).ds - 2 * law.at(t).ds + law.at(t - e).ds) / (e * e);
    EXPECT_LE(std::abs(jerk), 50 * 1.001);
    const double acceleration = (law.at(t + e).ds - law.at(t - e).ds) / (2 * e);
    EXPECT_LE(std::abs(acceleration), 5 * 1.001);
  }
}

TEST(SpeedLaw, TheAverageKeepsANarrowSpeedLimit) {
  const auto limit = [](double s) { return std::abs(s - 0.1) < 1e-4 ? 0.01 : 0.4; };
  const SpeedLaw law(nodes(0.2, 4000, limit), limits(), 0.08);
  bool passed = false;
  for (double t = 0; t < law.duration(); t += 2e-4) {
    const LawPoint point = law.at(t);
    if (std::abs(point.s - 0.1) > 1e-4) continue;
    passed = true;
    EXPECT_LE(point.ds, 0.01 * 1.0001);
  }
  EXPECT_TRUE(passed);
}

TEST(SpeedLaw, NeverRunsBackwards) {
  const SpeedLaw law = SpeedLaw::fastest(
      nodes(0.1, 500, [](double s) { return 0.02 + 0.1 * std::pow(std::sin(300 * s), 2); }),
      limits());
  double before = 0;
  for (double t = 0; t <= law.duration(); t += 1e-3) {
    const LawPoint point = law.at(t);
    EXPECT_GE(point.s, before);
    EXPECT_GE(point.ds, 0);
    before = point.s;
  }
}

TEST(SpeedLaw, SlowingDownStretchesTime) {
  SpeedLaw law(nodes(0.1, 500, [](double) { return 0.1; }), limits(), 0.05);
  const double duration = law.duration(), t = 0.4 * duration;
  const LawPoint before = law.at(t);
  law.slow_down(0.8);
  EXPECT_NEAR(law.duration(), duration / 0.8, 1e-12);
  EXPECT_NEAR(law.at(t / 0.8).s, before.s, 1e-15);
  EXPECT_NEAR(law.at(t / 0.8).ds, 0.8 * before.ds, 1e-15);
}

}  // namespace
}  // namespace vcnc::planner_law_test
