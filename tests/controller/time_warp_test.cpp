#include "controller/time_warp.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::time_warp_test {
namespace {

/// q = amplitude sin(tau) of X at grid points a step apart, limits 1.
std::vector<WarpNode> sine(double amplitude, double step, int count) {
  std::vector<WarpNode> nodes;
  for (int i = 0; i <= count; ++i) {
    const double tau = step * i;
    const double q1 = amplitude * std::cos(tau), q2 = -amplitude * std::sin(tau), q3 = -q1;
    WarpNode node;
    node.c_max = 1e8;
    node.a1 = q1 / (2 * step) * Coordinates::Unit(kX);
    node.a0_low = node.a0_high = q2 * Coordinates::Unit(kX);
    node.j0_low = node.j0_high = q3 * Coordinates::Unit(kX);
    node.j1 = 1.5 * q2 / step * Coordinates::Unit(kX);
    node.j2 = 0.5 * q1 / (step * step) * Coordinates::Unit(kX);
    nodes.push_back(node);
  }
  return nodes;
}

struct Use {
  double c, a, j;
};
Use use_of(const WarpNode& node, const double* c) {
  const double value = (c[0] + 4 * c[1] + c[2]) / 6, first = 0.5 * (c[2] - c[0]),
               second = c[0] - 2 * c[1] + c[2];
  return {value, std::abs(node.a0_low[kX] * value + node.a1[kX] * first),
          std::abs(node.j0_low[kX] * value + node.j1[kX] * first + node.j2[kX] * second) *
              std::sqrt(value)};
}

TEST(TimeWarp, TheSpeedLimitIsReachedWhereNothingElseLimits) {
  std::vector<WarpNode> nodes = sine(0, 0.1, 100);
  for (WarpNode& node : nodes) node.c_max = 4;
  const auto c = time_warp(nodes, WarpAim::fastest, 1e-6, false, false);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    EXPECT_NEAR(use_of(nodes[i], &c[i]).c, 4, 1e-3) << i;
}

TEST(TimeWarp, KeepsTheLimitsAndUsesThem) {
  // Too fast by 3 to begin with: c must fall below 1 everywhere where |q'''| or |q''| is large.
  const std::vector<WarpNode> nodes = sine(3, 0.05, 400);
  const auto c = time_warp(nodes, WarpAim::fastest, 1e-6, false, false);
  double least = 1e9;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Use use = use_of(nodes[i], &c[i]);
    EXPECT_GT(use.c, 0);
    EXPECT_LE(use.a, 1.001) << i;
    EXPECT_LE(use.j, 1.001) << i;
    least = std::min(least, std::max(use.a, use.j));
  }
  // A time-optimal motion is everywhere at one of its limits, but where the jerk changes its sign.
  int at_limit = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Use use = use_of(nodes[i], &c[i]);
    at_limit += std::max(use.a, use.j) > 0.99;
  }
  EXPECT_GE(at_limit, 350);
}

TEST(TimeWarp, HeldEndsStayAsTheyAre) {
  const auto c = time_warp(sine(0.3, 0.05, 200), WarpAim::fastest, 1e-5, true, true);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(c[i], 1);
    EXPECT_EQ(c[c.size() - 1 - i], 1);
  }
  EXPECT_GT(c[c.size() / 2], 1.5);
}

TEST(TimeWarp, TheNearestMotionIsLeftAloneWhereItIsWithinLimits) {
  std::vector<WarpNode> nodes = sine(0.5, 0.02, 400);
  nodes[200].exceeded({1, 1, 1.2});
  EXPECT_NEAR(nodes[200].use(), 1.2, 1e-12);
  const auto c = time_warp(nodes, WarpAim::nearest, 1e-6, true, true);
  EXPECT_LE(use_of(nodes[200], &c[200]).j, 1.001);
  for (const std::size_t far : {50u, 120u, 280u, 350u}) EXPECT_NEAR(c[far], 1, 1e-3);
}

TEST(TimeWarp, UseIsTheLargestShare) {
  std::vector<WarpNode> nodes = sine(0.5, 0.1, 1);
  EXPECT_DOUBLE_EQ(nodes[0].use(), 0.5);
  nodes[0].exceeded({1.1, 1, 1});
  EXPECT_DOUBLE_EQ(nodes[0].use(), 1.1);
}

}  // namespace
}  // namespace vcnc::time_warp_test
