#include "controller/path_return.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace vcnc::path_return_test {
namespace {

TEST(PathReturn, ReversesARetraction) {
  const Machine machine;
  const AxisVector path{0.01, 0.02, 0.03, 0.1, -0.2};
  const Retract retract(machine, path, {0.3e-3, -0.4e-3, 0});
  const PathReturn back(machine, retract.position(retract.duration()), path);
  EXPECT_NEAR(back.duration(), retract.duration(), 1e-12) << "1.5 mm with a peak of 10 mm/s";
  for (int i = 0; i <= 20; ++i) {
    const double t = retract.duration() * i / 20;
    const AxisVector out = retract.position(t), in = back.position(retract.duration() - t);
    for (std::size_t a = 0; a < kAxisCount; ++a) EXPECT_NEAR(in[a], out[a], 1e-15);
  }
}

// From rest to rest, whatever the way: peaks of the sampled motion against the limits of the
// machine and of the class.
TEST(PathReturn, KeepsSpeedsAndHalfOfTheLimits) {
  std::mt19937_64 random(3);
  const Machine machine;
  for (int n = 0; n < 200; ++n) {
    const double scale = std::pow(10, -static_cast<double>(random() % 7));
    AxisVector from{}, to{};
    for (std::size_t i = 0; i < kAxisCount; ++i)
      to[i] = scale * (static_cast<double>(random() % 2001) / 1000 - 1);
    const PathReturn way(machine, from, to);
    EXPECT_EQ(way.position(way.duration()), to);
    EXPECT_EQ(way.velocity(way.duration()), AxisVector{});
    const double dt = way.duration() / 2000;
    double speed = 0, turn = 0;
    for (int k = 1; k < 2000; ++k) {
      const AxisVector v = way.velocity(k * dt), before = way.velocity((k - 1) * dt),
                       after = way.velocity((k + 1) * dt), q = way.position(k * dt),
                       next = way.position((k + 1) * dt);
      speed = std::max(speed, std::hypot(v[0], v[1], v[2]));
      turn = std::max({turn, std::abs(v[3]), std::abs(v[4])});
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        const AxisLimits& limits = machine.axes[i].limits;
        EXPECT_LE(std::abs(after[i] - before[i]) / (2 * dt), 0.501 * limits.acceleration);
        EXPECT_LE(std::abs(after[i] - 2 * v[i] + before[i]) / (dt * dt), 0.501 * limits.jerk);
        EXPECT_NEAR((next[i] - q[i]) / dt, 0.5 * (v[i] + after[i]), 1e-3 * kRetractSpeed + 1e-12);
      }
    }
    EXPECT_LE(speed, kRetractSpeed * (1 + 1e-9));
    EXPECT_LE(turn, kReturnTurn * (1 + 1e-9));
  }
}

TEST(PathReturn, NoWayTakesNoTime) {
  const AxisVector here{1, 2, 3, 4, 5};
  const PathReturn stay(Machine{}, here, here);
  EXPECT_EQ(stay.duration(), 0);
  EXPECT_EQ(stay.position(0), here);
}

}  // namespace
}  // namespace vcnc::path_return_test
