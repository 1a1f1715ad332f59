// The bound that planners are measured against: closed forms, motions that attain it or come close,
// and that nothing admissible goes below.
#include "tests/bench/jerk_bound.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "controller/planner.hpp"
#include "tests/controller/planned_moves.hpp"

namespace vcnc::jerk_bound_test {
namespace {

constexpr double kV = 0.5, kA = 5, kJ = 50;  ///< of planned_moves.hpp
constexpr double kP = 10e-6;
constexpr PieceEnd kRest{}, kFree{0, kA};

double travel(double distance, const PieceEnd& from, const PieceEnd& to) {
  return shortest_travel(distance, kV, kA, kJ, from, to);
}

TEST(JerkBound, FromRestToRestHasTheClosedForm) {
  for (const double length : {1e-5, 1e-3, 1e-2, 0.1, 0.15, 0.3, 0.9})
    EXPECT_NEAR(travel(length, kRest, kRest), shortest_time(length), 1e-9) << length;
}

TEST(JerkBound, BetweenReversalsAccelerationIsThereFromTheStart) {
  for (const double length : {1e-5, 1e-3, 0.03})  // a = JT/2 reaches A at (2/3) A^3 / J^2 = 0.0333
    EXPECT_NEAR(travel(length, kFree, kFree), std::cbrt(12 * length / kJ), 1e-9) << length;
  for (const double held : {0.005, 0.01}) {  // a = A for this time, -J through zero, a = -A as long
    const double length =
        kA * held * held + 2 * kA * kA / kJ * held + 2.0 / 3 * std::pow(kA, 3) / (kJ * kJ);
    EXPECT_NEAR(travel(length, kFree, kFree), 2 * held + 2 * kA / kJ, 1e-9) << held;
  }
  // V reached: from A to 0 and constant; v = V takes V / A + A / 2J and 0.0958 m on either side.
  const double ramp = kV / kA + 0.5 * kA / kJ, held = kV / kA - 0.5 * kA / kJ;
  const double way = 0.5 * kA * held * held + kV * kA / kJ - std::pow(kA, 3) / (6 * kJ * kJ);
  EXPECT_NEAR(travel(2 * way + 0.1, kFree, kFree), 2 * ramp + 0.1 / kV, 1e-9);
}

TEST(JerkBound, MixedEndsHaveTheClosedForm) {
  // From rest, braking with all at the end: +J for t, -J for (1 + sqrt 2) t, v = 0 with a = -sqrt2
  // J t.
  const double t = 0.05, behind = (1 + std::sqrt(2.0)) * t;
  const double v = 0.5 * kJ * t * t, a = kJ * t;
  const double length = kJ * t * t * t / 6 + behind * (v + behind * (0.5 * a - kJ * behind / 6));
  EXPECT_NEAR(travel(length, kRest, kFree), t + behind, 1e-9);
  EXPECT_NEAR(travel(length, kFree, kRest), t + behind, 1e-9);
}

double uniform(std::mt19937_64& random, double from, double to) {
  return from + (to - from) * static_cast<double>(random() >> 11) * 0x1p-53;
}

TEST(JerkBound, NoMotionIsShorter) {
  std::mt19937_64 random(11);
  double closest = 1e9;
  for (int run = 0; run < 20000; ++run) {
    double q = 0, v = uniform(random, 0, 0.1), a = uniform(random, -1, 2), time = 0;
    const PieceEnd from{v, std::max(a, 0.0)};
    const int phases = 2 + run % 4;
    bool within = true;
    for (int i = 0; i < phases && within; ++i) {
      // Mostly as the optimum does it: up, down, up.
      const double j = run % 3 ? (i == 1 ? -kJ : kJ) : uniform(random, -kJ, kJ);
      const double t = uniform(random, 0, i == 1 ? 0.1 : 0.05);
      for (int k = 0; k < 20; ++k) {
        const double dt = t / 20;
        q += dt * (v + dt * (0.5 * a + j * dt / 6));
        v += dt * (a + 0.5 * j * dt);
        a += j * dt;
        within = within && std::abs(a) <= kA && v <= kV && v >= 0;
      }
      time += t;
    }
    if (!within || q <= 1e-6) continue;
    const double least = travel(q, from, {v, std::max(-a, 0.0)});
    EXPECT_LE(least, time * (1 + 1e-9)) << run;
    closest = std::min(closest, time / least);
  }
  EXPECT_LT(closest, 1.02);
}

TEST(JerkBound, ChebyshevsCubicAttainsTheTube) {
  const double length = 2 * std::cbrt(24 * kP / kJ);  // R T_3(2 t / length - 1): third derivative J
  const PieceEnd end = within_tube(kP, kJ, 1);
  EXPECT_NEAR(end.velocity, 9 * kP * 2 / length, 1e-12);
  EXPECT_NEAR(end.acceleration, 24 * kP * 4 / (length * length), 1e-10);
  // A shorter stay says less.
  EXPECT_GT(within_tube(kP, kJ, 0.5 * length).acceleration, end.acceleration);
}

TEST(JerkBound, OneLineIsTheClosedForm) {
  const Machine machine = test_machine();
  for (const double length : {1e-3, 0.05, 0.4})
    EXPECT_NEAR(jerk_bound({line(at(0, 0), at(length, 0), 1)}, machine),
                shortest_time(length - 2 * kP), 1e-9);
}

TEST(JerkBound, ThereAndBackTurnsWithAllAcceleration) {
  const Coordinates start = at(0, 0), end = at(0.03, 0.03);
  EXPECT_NEAR(jerk_bound({line(start, end, 1), line(end, start, 1)}, test_machine()),
              2 * travel(0.03 - 2 * kP, kRest, kFree), 1e-9);
}

TEST(JerkBound, ASquareCornerComesCloseToRampsThatOverlap) {
  // x stops as y starts, both with constant jerk J, for a time T: J (T / 2)^3 / 6 off in the
  // middle.
  const double length = 0.03;
  const double overlap = 2 * std::cbrt(6 * kP / std::sqrt(2.0) / kJ);
  const double time = 2 * shortest_time(length) - overlap;
  const double bound =
      jerk_bound({line(at(0, 0), at(length, 0), 1), line(at(length, 0), at(length, length), 1)},
                 test_machine());
  EXPECT_LT(bound, time);
  EXPECT_GT(bound, 0.95 * time);
}

TEST(JerkBound, NoPlannedMotionIsShorter) {
  const Machine machine = test_machine();
  std::mt19937_64 random(4);
  for (int run = 0; run < 60; ++run) {
    std::vector<Move> moves;
    Coordinates last = Coordinates::Zero();
    double heading = 0;
    const double size = std::pow(10, uniform(random, -3, -1.7));
    for (int i = 0; i < 5; ++i) {
      heading += uniform(random, -2.5, 2.5);
      const double way = size * uniform(random, 0.3, 1);
      const Coordinates next =
          last + at(way * std::cos(heading), way * std::sin(heading), way * uniform(random, -1, 1));
      moves.push_back(line(last, next, 0.2));
      moves.back().dynamics = NcParams::Dynamics::fast;
      last = next;
    }
    const double bound = jerk_bound(moves, machine);
    const double time = Trajectory(Path(moves, 0.01 * kDegree), machine).duration();
    EXPECT_LE(bound, time) << run;
    EXPECT_GE(bound, 0.4 * time) << run;
  }
}

}  // namespace
}  // namespace vcnc::jerk_bound_test
