// The compensation of set-points against closed forms, without a machine.
#include "controller/compensation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace vcnc::compensation_test {
namespace {

constexpr double kUm = 1e-6, kNm = 1e-9;

/// A motion of one axis; the others stand.
struct Course {
  std::vector<double> q, v;
};

Course course_of(int cycles, const std::function<double(double)>& q,
                 const std::function<double(double)>& v) {
  Course course;
  for (int k = 0; k < cycles; ++k) {
    course.q.push_back(q(k * kCycle));
    course.v.push_back(v(k * kCycle));
  }
  return course;
}

/// There and back: v = V sin(2 pi t / period).
Course there_and_back(double speed, double period, int cycles) {
  const double w = 2 * kPi / period;
  return course_of(
      cycles, [=](double t) { return speed / w * (1 - std::cos(w * t)); },
      [=](double t) { return speed * std::sin(w * t); });
}

Course play(const Machine& machine, const Course& planned, std::size_t moves = kX,
            std::size_t looks = kX) {
  const CompensationRules rules(machine);
  CompensationState state(rules);
  Course sent;
  for (std::size_t k = 0; k < planned.q.size(); ++k) {
    AxisVector q{}, v{};
    q[moves] = planned.q[k];
    v[moves] = planned.v[k];
    const Compensated c = compensated(rules, q, v, state);
    sent.q.push_back(c.position[looks]);
    sent.v.push_back(c.velocity[looks]);
  }
  return sent;
}

/// An X axis with wide limits, so that switching on is over soon.
Machine machine_with(const std::function<void(CompensationParams&)>& set) {
  Machine machine;
  for (AxisParams& axis : machine.axes) {
    axis.limits.min = -10;
    axis.limits.max = 10;
  }
  set(machine.nc.compensation);
  return machine;
}

CompensationTable table(std::vector<double> at, std::vector<double> error,
                        std::vector<double> reverse = {}) {
  CompensationTable t;
  t.at = std::move(at);
  t.error = std::move(error);
  t.error_reverse = std::move(reverse);
  return t;
}

constexpr std::size_t kEntered = 500;  ///< cycles after which everything is switched on

TEST(Compensation, NothingSetIsEmpty) {
  EXPECT_TRUE(CompensationRules(Machine()).empty());
  EXPECT_TRUE(CompensationRules(machine_with([](CompensationParams& c) {
                c.tables.push_back(table({0, 1}, {0, 0}));
              })).empty());
  EXPECT_FALSE(CompensationRules(machine_with([](CompensationParams& c) {
                 c.axes[kC].lead = 1e-6;
               })).empty());
}

TEST(Compensation, ASignIsSmoothedByAQuadraticSpline) {
  constexpr int kN = 10;
  SmoothedSign sign(3 * kN * kCycle);
  std::vector<double> value, rate;
  for (int k = 0; k < 40; ++k) {
    sign.step(1);
    value.push_back(sign.value());
    rate.push_back(sign.rate());
  }
  EXPECT_EQ(value.front(), 0);
  EXPECT_EQ(value.back(), 1) << "exactly, its sums are whole numbers";
  EXPECT_EQ(rate.back(), 0);
  EXPECT_LT(value[3 * kN - 3], 1);
  EXPECT_EQ(value[3 * kN - 2], 1);
  // In the middle of a quadratic B-spline of the width 3 N T: a half, and the peak 3/(4 N T).
  const double peak = *std::max_element(rate.begin(), rate.end());
  EXPECT_NEAR(peak, 0.75 / (kN * kCycle), 0.01 * peak);
  for (std::size_t k = 1; k < value.size(); ++k) EXPECT_GE(value[k], value[k - 1]);
}

TEST(Compensation, TheShortestTransitionMeetsTheTightestLimit) {
  EXPECT_NEAR(shortest_transition(10 * kUm, 1e3, 1e6, 50), std::cbrt(54 * 10 * kUm / 50), 1e-12);
  EXPECT_NEAR(shortest_transition(-10 * kUm, 1e3, 0.1, 1e9), std::sqrt(9 * 10 * kUm / 0.1), 1e-12);
  EXPECT_NEAR(shortest_transition(10 * kUm, 1e-3, 1e6, 1e9), 2.25 * 10e-3, 1e-12);
}

TEST(Compensation, ATableIsTakenOffLinearBetweenPointsAndHeldBeyondThem) {
  const Machine machine = machine_with([](CompensationParams& c) {
    c.tables.push_back(table({-0.1, 0.1, 0.2}, {-4 * kUm, 6 * kUm, 1 * kUm}));
  });
  for (const auto& [q, error] : std::vector<std::pair<double, double>>{{-0.5, -4},
                                                                       {-0.1, -4},
                                                                       {0, 1},
                                                                       {0.05, 3.5},
                                                                       {0.1, 6},
                                                                       {0.15, 3.5},
                                                                       {0.2, 1},
                                                                       {0.7, 1}}) {
    const Course standing{std::vector<double>(kEntered, q), std::vector<double>(kEntered, 0)};
    EXPECT_NEAR(play(machine, standing).q.back() - q, -error * kUm, 1e-15) << q;
  }
}

TEST(Compensation, ATableOfAnotherAxisAndAModuloOneAreReadWhereTheyBelong) {
  const Machine machine = machine_with([](CompensationParams& c) {
    CompensationTable across = table({0, 1}, {0, 10 * kUm});
    across.axis = CompensationTable::OfAxis::Y;
    CompensationTable turn = table({0, 1, 2, 4}, {0, 8 * kUm, 2 * kUm, 0});
    turn.modulo = true;
    c.tables = {across, turn};
  });
  const auto at = [&](double q, std::size_t looks) {
    const Course standing{std::vector<double>(kEntered, q), std::vector<double>(kEntered, 0)};
    return play(machine, standing, kX, looks).q.back();
  };
  EXPECT_NEAR(at(0.25, kY), -2.5 * kUm, 1e-15);
  EXPECT_NEAR(at(0.5, kX) - 0.5, -4 * kUm, 1e-15);
  EXPECT_NEAR(at(4.5, kX) - 4.5, -4 * kUm, 1e-15);
  EXPECT_NEAR(at(-1, kX) + 1, -1 * kUm, 1e-15);
}

TEST(Compensation, ScaleAndSquarenessAreLinear) {
  const Machine machine = machine_with([](CompensationParams& c) {
    c.axes[kX].scale = 100e-6;
    c.axes[kX].scale_reference = 0.1;
    c.squareness = {20e-6, 30e-6, -40e-6};
  });
  const CompensationRules rules(machine);
  CompensationState state(rules);
  Compensated c;
  for (std::size_t k = 0; k < kEntered; ++k)
    c = compensated(rules, {0.3, 0.2, 0.5, 0, 0}, {0, 0, 0, 0, 0}, state);
  EXPECT_NEAR(c.position[kX], 0.3 - 100e-6 * 0.2 - 20e-6 * 0.2 - 30e-6 * 0.5, 1e-15);
  EXPECT_NEAR(c.position[kY], 0.2 + 40e-6 * 0.5, 1e-15);
  EXPECT_EQ(c.position[kZ], 0.5);
  EXPECT_NEAR(c.correction[kX], c.position[kX] - 0.3, 1e-15);
}

/// Peaks of what was added to the planned motion, and where it ends.
struct Added {
  double last = 0, velocity = 0, acceleration = 0, jerk = 0;
};

Added added(const Course& planned, const Course& sent, std::size_t from) {
  Added a;
  std::vector<double> d;
  for (std::size_t k = from; k < sent.q.size(); ++k) d.push_back(sent.q[k] - planned.q[k]);
  for (std::size_t k = 3; k < d.size(); ++k) {
    a.velocity = std::max(a.velocity, std::abs(d[k] - d[k - 1]) / kCycle);
    a.acceleration =
        std::max(a.acceleration, std::abs(d[k] - 2 * d[k - 1] + d[k - 2]) / (kCycle * kCycle));
    a.jerk = std::max(a.jerk, std::abs(d[k] - 3 * d[k - 1] + 3 * d[k - 2] - d[k - 3]) /
                                  (kCycle * kCycle * kCycle));
  }
  a.last = d.back();
  return a;
}

TEST(Compensation, BacklashLeadsInTheDirectionOfMotionWithinHalfOfTheLimits) {
  constexpr double kGap = 12 * kUm;
  const Machine machine = machine_with([](CompensationParams& c) { c.axes[kX].backlash = kGap; });
  const AxisLimits& limits = machine.axes[kX].limits;
  const Course forward = there_and_back(0.05, 1.0, 250), back = there_and_back(0.05, 1.0, 750);
  EXPECT_NEAR(added(forward, play(machine, forward), 0).last, 0.5 * kGap, 1e-15);
  const Added a = added(back, play(machine, back), 0);
  EXPECT_NEAR(a.last, -0.5 * kGap, 1e-15);
  EXPECT_LE(a.velocity, 0.5 * limits.velocity);
  EXPECT_LE(a.acceleration, 0.5 * limits.acceleration);
  EXPECT_LE(a.jerk, 0.5 * limits.jerk * 1.001);
  EXPECT_GE(a.jerk, 0.35 * limits.jerk) << "the limit that counts is used; whole cycles round it";
}

TEST(Compensation, ADeclaredTransitionLastsAsLongAsDeclared) {
  constexpr double kGap = 10 * kUm;
  const Machine machine = machine_with([](CompensationParams& c) {
    c.axes[kX].backlash = kGap;
    c.axes[kX].transition = 0.09;
  });
  const Course planned = there_and_back(0.05, 1.0, 700);
  const Course sent = play(machine, planned);
  // The reversal at 0.5 s is noticed in the cycle after it.
  EXPECT_NEAR(sent.q[501] - planned.q[501], 0.5 * kGap, 1e-15);
  EXPECT_NEAR(sent.q[501 + 45] - planned.q[501 + 45], 0, 0.04 * kGap);
  EXPECT_GT(sent.q[501 + 85] - planned.q[501 + 85], -0.5 * kGap);
  EXPECT_NEAR(sent.q[501 + 91] - planned.q[501 + 91], -0.5 * kGap, 1e-15);
}

TEST(Compensation, ReversalsWithinATransitionAddUpAndEndExactly) {
  const Machine machine = machine_with([](CompensationParams& c) {
    c.axes[kX].backlash = 20 * kUm;
    c.axes[kX].transition = 0.1;
  });
  Course planned = there_and_back(0.002, 0.014, 500);
  planned.q.resize(700, planned.q.back());
  planned.v.resize(700, 0);
  const Course sent = play(machine, planned);
  const double last_sign = planned.v[499] > 0 ? 1 : -1;
  EXPECT_EQ(sent.q.back() - planned.q.back(), 10 * kUm * last_sign);
  const Added a = added(planned, sent, 0);
  EXPECT_LT(a.acceleration, 9 * 20 * kUm / (0.1 * 0.1));
}

TEST(Compensation, ATwoWayTableHasBothItsSides) {
  const Machine machine = machine_with([](CompensationParams& c) {
    c.tables.push_back(table({-1, 1}, {3 * kUm, 5 * kUm}, {-1 * kUm, -3 * kUm}));
  });
  const Course back = there_and_back(0.1, 1.0, 900), forward = there_and_back(0.1, 1.0, 400);
  const auto error = [&](const Course& planned) {
    return planned.q.back() - play(machine, planned).q.back();
  };
  EXPECT_NEAR(error(forward), (4 + forward.q.back()) * kUm, 1e-12);
  EXPECT_NEAR(error(back), (-2 - back.q.back()) * kUm, 1e-12);
}

double worst_velocity(const Course& sent) {
  double worst = 0;
  for (std::size_t k = 2; k + 1 < sent.q.size(); ++k)
    worst = std::max(worst, std::abs((sent.q[k + 1] - sent.q[k - 1]) / (2 * kCycle) - sent.v[k]));
  return worst;
}

TEST(Compensation, TheSentVelocityIsTheDerivativeOfTheSentPosition) {
  constexpr double kLead = 1e-3, kSpeed = 0.05, kPeriod = 0.6;
  const Course planned = there_and_back(kSpeed, kPeriod, 1200);
  const double jerk = kSpeed * std::pow(2 * kPi / kPeriod, 2);
  const Machine errors = machine_with([](CompensationParams& c) {
    c.axes[kX].backlash = 200 * kUm;
    c.axes[kX].scale = 1e-3;
    c.axes[kX].lead = kLead;
    c.tables.push_back(table({-1, 1}, {-4000 * kUm, 5000 * kUm}, {-3000 * kUm, 2000 * kUm}));
  });
  EXPECT_LT(worst_velocity(play(errors, planned)),
            1.1 * jerk * (0.5 * kLead * (kLead + kCycle) + kCycle * kCycle / 6));
  const ReversalPulse pulse{.amplitude = 1e-3, .decay = 10e-3, .rise = 4e-3};
  const Machine friction =
      machine_with([&](CompensationParams& c) { c.axes[kX].friction = pulse; });
  // Where the pulse begins within a cycle, two cycles round its corner off.
  EXPECT_LT(worst_velocity(play(friction, planned)),
            0.5 * kCycle * pulse.amplitude * (1 / pulse.rise - 1 / pulse.decay));
}

TEST(Compensation, ALeadPredictsTheMotion) {
  const Machine machine = machine_with([](CompensationParams& c) { c.axes[kX].lead = 1e-3; });
  // Constant acceleration: exact.
  const Course even = course_of(
      200, [](double t) { return 0.5 * 2 * t * t; }, [](double t) { return 2 * t; });
  const Course sent = play(machine, even);
  EXPECT_NEAR(sent.q[150], 0.151 * 0.151, 1e-15);
  EXPECT_NEAR(sent.v[150], 2 * 0.151, 1e-15);
  // A sine: off by j l^3/6 + j T l^2/4 at most.
  const double w = 2 * kPi / 0.5, speed = 0.1;
  const Course wave = there_and_back(speed, 0.5, 1000);
  const Course early = play(machine, wave);
  const double jerk = speed * w * w, bound = jerk * 1e-9 * (1.0 / 6 + 1.0 / 4);
  double worst = 0;
  for (std::size_t k = 10; k + 1 < wave.q.size(); ++k)
    worst = std::max(worst, std::abs(early.q[k] - wave.q[k + 1]));
  EXPECT_LT(worst, bound * 1.01);
  EXPECT_GT(worst, bound * 0.5);
}

TEST(Compensation, TheAmplitudeFollowsTheFourRangesOfItsCharacteristic) {
  ReversalPulse pulse{.amplitude = 4, .least = 1, .a1 = 1, .a2 = 3, .a3 = 5};
  EXPECT_EQ(pulse.amplitude_at(0.25), 1);
  EXPECT_EQ(pulse.amplitude_at(1), 4);
  EXPECT_EQ(pulse.amplitude_at(3), 4);
  EXPECT_EQ(pulse.amplitude_at(4), 2.5);
  EXPECT_EQ(pulse.amplitude_at(5), 1);
  EXPECT_EQ(pulse.amplitude_at(50), 1);
  pulse.a3 = 0;
  EXPECT_EQ(pulse.amplitude_at(50), 4);
}

/// What the velocity controller feels, Kv p + Kff p', is u from the zero of the velocity on: the
/// set-point against an integration in steps of a hundredth of a cycle.
TEST(Compensation, AFrictionPulseIsThatVelocityOffset) {
  constexpr double kA = 2e-3, kDecay = 8e-3, kRise = 3e-3, kKv = 40, kFf = 0.8;
  for (const double rise : {0.0, kRise}) {
    Machine machine = machine_with([&](CompensationParams& c) {
      c.axes[kX].friction = {.amplitude = kA, .decay = kDecay, .rise = rise};
    });
    machine.axes[kX].servo.kv_per_s = kKv;
    machine.axes[kX].servo.velocity_ff = kFf;
    const double zero = 0.3004;  // between two cycles
    const Course planned = course_of(
        600, [=](double t) { return 0.1 * (t - zero) * (t - zero); },
        [=](double t) { return 0.2 * (t - zero); });
    const Course sent = play(machine, planned);
    EXPECT_EQ(sent.q[300], planned.q[300]);
    double p = 0, t = zero, largest = 0;
    constexpr double kStep = kCycle / 100;
    for (std::size_t k = 301; k < 600; ++k) {
      for (; t < static_cast<double>(k) * kCycle - 0.5 * kStep; t += kStep) {
        const double middle = t + 0.5 * kStep - zero;
        const double u =
            kA * (std::exp(-middle / kDecay) - (rise > 0 ? std::exp(-middle / rise) : 0));
        p += kStep * (u - kKv * p) / kFf;
      }
      ASSERT_NEAR(sent.q[k] - planned.q[k], p, 3e-3 * kA * kDecay) << k;
      largest = std::max(largest, p);
    }
    EXPECT_GT(largest, 1 * kUm);
    EXPECT_LT(std::abs(sent.q.back() - planned.q.back()), 0.5 * kNm) << "nothing is left behind";
  }
}

TEST(Compensation, NoPulseAtTheFirstMotionNorWhereAnAxisGoesOnInItsDirection) {
  const Machine machine = machine_with(
      [](CompensationParams& c) { c.axes[kX].friction = {.amplitude = 1e-3, .decay = 8e-3}; });
  Course planned = there_and_back(0.02, 2.0, 900);
  for (std::size_t k = 400; k < 500; ++k) planned.v[k] = 0;
  const Course sent = play(machine, planned);
  for (std::size_t k = 0; k < planned.q.size(); ++k) ASSERT_EQ(sent.q[k], planned.q[k]) << k;
}

TEST(Compensation, SwitchingOnIsSmoothAndStartsFromWhereTheAxisStands) {
  const Machine machine = machine_with([](CompensationParams& c) {
    c.tables.push_back(table({0, 1}, {100 * kUm, 100 * kUm}));
  });
  const Course standing{std::vector<double>(kEntered, 0.5), std::vector<double>(kEntered, 0)};
  const Course sent = play(machine, standing);
  EXPECT_EQ(sent.q.front(), 0.5);
  EXPECT_EQ(sent.q.back(), 0.5 - 100 * kUm);
  const Added a = added(standing, sent, 0);
  EXPECT_LE(a.acceleration, 0.5 * machine.axes[kX].limits.acceleration);
  EXPECT_LE(a.jerk, 0.5 * machine.axes[kX].limits.jerk * 1.001);
}

TEST(Compensation, NothingIsSentBeyondTheTravel) {
  Machine machine = machine_with([](CompensationParams& c) {
    c.tables.push_back(table({0, 1}, {-100 * kUm, -100 * kUm}));
  });
  machine.axes[kX].limits.max = 0.5;
  for (const double q : {0.5, 0.49995}) {
    const Course standing{std::vector<double>(kEntered, q), std::vector<double>(kEntered, 0)};
    EXPECT_EQ(play(machine, standing).q.back(), 0.5);
  }
}

}  // namespace
}  // namespace vcnc::compensation_test
