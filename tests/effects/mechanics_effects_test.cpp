#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "tests/effects/axis_bench.hpp"

namespace vcnc::mechanics_effects_test {
namespace {

using namespace axis_bench;
using Feedback = ServoParams::Feedback;

constexpr double kUm = 1e-6;

// The spring carries what moves the load: B v at constant speed, B v + m a while accelerating. The
// tool lags the motor by c times that.
TEST(MechanicsEffects, WindupIsComplianceTimesForce) {
  const double c = 10e-9, m = Machine().axes[kX].mechanics.load;
  ASSERT_EQ(m, 500);
  for (const Feedback feedback : {Feedback::motor, Feedback::load}) {
    AxisBench axis(machine_with(kX, feedback, Windup{.compliance = c, .damping_ratio = 0.2},
                                Coulomb{250}, Viscous{2000}),
                   kX);
    EXPECT_NEAR(axis.at_speed(0.1, 2).second, -c * 450, 1e-14);
    EXPECT_NEAR(axis.at_speed(-0.05, 2).second, c * 350, 1e-14);
  }
  AxisBench axis(machine_with(kX, Feedback::motor, Windup{.compliance = c, .damping_ratio = 0.2}),
                 kX);
  EXPECT_NEAR(axis.go(1, 0.5).second, -c * m * 0.5, 1e-14);
}

// Twist at constant speed: half the gap and the force on the sides of the gap, which with both
// masses are at 10,000 rad/s. So b + 2 F_c / K between the two directions, at any speed.
TEST(MechanicsEffects, BacklashIsAStepOfTheGap) {
  const double b = 10 * kUm, w = 1e4;
  const MechanicsParams mechanics = Machine().axes[kX].mechanics;
  const double m = mechanics.load, m_r = mechanics.reflected_inertia();
  const double contact = 250 / (w * w * m * m_r / (m + m_r));
  EXPECT_NEAR(contact, 0.0059 * kUm, 0.0001 * kUm);
  AxisBench axis(machine_with(kX, Feedback::motor, Backlash{b}, Coulomb{250}), kX);
  for (const double v : {1e-3, 0.1}) {
    const Reading out = axis.at_speed(v, 2);
    const double error_out = out.position - axis.commanded();
    EXPECT_NEAR(out.second, -b / 2 - contact, 1e-14) << v;
    const Reading back = axis.at_speed(-v, 2);
    const double error_back = back.position - axis.commanded();
    EXPECT_NEAR(back.second, b / 2 + contact, 1e-14) << v;
    EXPECT_NEAR(error_back - error_out, b + 2 * contact, 1e-13) << v;
  }
}

TEST(MechanicsEffects, WeightOfALinearAxisIsAConstantForce) {
  AxisBench axis(machine_with(kZ, WeightImbalance{.force = -300}), kZ);
  const Reading rest = axis.at_speed(0, 1);
  EXPECT_NEAR(rest.force, 300, 2e-6);
  EXPECT_NEAR(rest.position, 0, 1e-12);
  EXPECT_NEAR(axis.at_speed(0.1, 1).force, 300, 2e-6);
  EXPECT_NEAR(axis.at_speed(-0.1, 1).force, 300, 2e-6);
}

// The drive holds -G sin(q + q_0): at rest but for the rounding of angles (4e-16 rad through the
// observer and the loop: 1e-9 N m), while turning but for one step's way, G v 100 us.
TEST(MechanicsEffects, WeightOfARotaryAxisTurnsWithIt) {
  const WeightImbalance effect{.force = 10, .angle = 30 * kDegree};
  for (const double q : {-150.0, -30.0, 0.0, 60.0, 90.0}) {
    Machine machine = machine_with(kA, effect);
    machine.axes[kA].limits.start = q * kDegree;
    const Reading r = AxisBench(machine, kA).at_speed(0, 2);
    EXPECT_NEAR(r.force, -10 * std::sin((q + 30) * kDegree), 1e-8) << q;
  }
  AxisBench axis(machine_with(kA, effect), kA);
  for (const double v : {0.2, -0.2}) {
    axis.at_speed(v, 0.5);
    double worst = 0;
    for (int k = 0; k < 3000; ++k) {
      const Reading r = axis.cycle();
      worst = std::max(worst, std::abs(r.force + 10 * std::sin(r.position + 30 * kDegree)));
    }
    EXPECT_LT(worst, 10 * 0.2 * kDriveLoopTime) << v;
  }
}

// Force over position, the same there and back: 500 x + 5e4 x^3 about 20 mm, 400 N at 200 mm. A
// loop step's way limits it: slope 5400 N/m, 50 mm/s, 100 us.
TEST(MechanicsEffects, CableChainIsACubicSpring) {
  AxisBench axis(machine_with(kX, CableChain{.stiffness = 500, .cubic = 5e4, .rest = 0.02}), kX);
  const auto worst = [&](double v) {
    axis.at_speed(v, 0.8);
    double error = 0;
    for (int k = 0; k < 3200; ++k) {
      const Reading r = axis.cycle();
      const double x = r.position - 0.02;
      error = std::max(error, std::abs(r.force - 500 * x - 5e4 * x * x * x));
    }
    return error;
  };
  EXPECT_LT(worst(0.05), 0.027);
  EXPECT_LT(worst(-0.05), 0.027);
  const Reading r = axis.at_speed(0, 1);
  EXPECT_NEAR(r.position, 0, 1e-9);
  EXPECT_NEAR(r.force, -10.4, 1e-6);  // 500 * 0.02 + 5e4 * 8e-6
}

TEST(MechanicsEffects, LoadPlayIsAPlayOperator) {
  const double b = 8 * kUm;
  const auto motion = swing(kX, 2e-3, 1, 3, LoadPlay{b});
  // From the middle: the upper limit of the dragged body falls with the scale, the lower one rises.
  double dragged = motion.front().scale, lowest = 0, highest = 0;
  int there = 0, back = 0;
  for (const auto& [t, q, displacement] : motion) {
    dragged = std::clamp(dragged, q - b / 2, q + b / 2);
    ASSERT_NEAR(displacement, dragged - q, 1e-15) << t;
    lowest = std::min(lowest, displacement);
    highest = std::max(highest, displacement);
    there += std::abs(displacement + b / 2) < 1e-15;
    back += std::abs(displacement - b / 2) < 1e-15;
  }
  EXPECT_NEAR(highest - lowest, b, 1e-15);                            // the step
  EXPECT_GT(there + back, static_cast<int>(motion.size()) * 9 / 10);  // complete after b of travel
  // Neither the loops nor the encoders know of it.
  AxisBench with(machine_with(kX, LoadPlay{b}, Coulomb{100}), kX);
  AxisBench without(machine_with(kX, Coulomb{100}), kX);
  for (const double v : {0.01, -0.01}) {
    with.at_speed(v, 0.2);
    without.at_speed(v, 0.2);
    EXPECT_EQ(with.last().force, without.last().force);
    EXPECT_EQ(with.last().measured, without.last().measured);
    EXPECT_EQ(with.last().second, 0);
  }
}

// Displacement -c F of what moves the load.
TEST(MechanicsEffects, LostMotionFollowsTheForce) {
  const LostMotion effect{10e-9};
  const auto displacement = [](AxisBench& axis, const Reading& r) {
    return r.position - axis.last().measured;  // the scale on the load is ideal
  };
  AxisBench axis(machine_with(kX, effect, Coulomb{250}, Viscous{2000}), kX);
  Reading r = axis.at_speed(0.1, 1);
  EXPECT_NEAR(displacement(axis, r), -10e-9 * 450, 1e-15);
  r = axis.at_speed(-0.05, 1);
  EXPECT_NEAR(displacement(axis, r), 10e-9 * 350, 1e-15);
  // While accelerating m a; a weight bends it at rest.
  AxisBench free(machine_with(kX, effect), kX);
  r = free.go(1, 0.4);
  EXPECT_NEAR(displacement(free, r), -10e-9 * 500 * 0.4, 1e-15);
  AxisBench hanging(machine_with(kX, effect, WeightImbalance{-200}), kX);
  r = hanging.at_speed(0, 1);
  EXPECT_NEAR(displacement(hanging, r), -10e-9 * 200, 1e-14);
}

// On a circle of radius R an axis has the acceleration -w^2 q: q grows by the factor 1 + c m w^2.
TEST(MechanicsEffects, LostMotionWidensACircle) {
  const double w = 2 * kPi * 2;
  double error = 0;
  for (const auto& [t, q, displacement] : swing(kX, 5e-3, 2, 1.5, LostMotion{20e-9}))
    if (t > 0.5) error = std::max(error, std::abs(displacement - 20e-9 * 500 * w * w * q));
  EXPECT_LT(error, 20e-9 * 500 * w * w * 5e-3 * 1e-3);  // a is half a loop step old: w T / 2
}

// A jump of the acceleration from rest: z = -g a / w^2 (1 - exp(-zeta w t) (cos(w_d t) + zeta w /
// w_d sin(w_d t))) at every step, for the drive brings a about exactly.
TEST(MechanicsEffects, StructuralModeRingsAfterAJumpOfAcceleration) {
  const StructuralMode effect{.participation = 0.8, .frequency = 35, .damping_ratio = 0.04};
  const double a = 2, w = 2 * kPi * 35, w_d = w * std::sqrt(1 - 0.04 * 0.04);
  const double still = -0.8 * a / (w * w);
  EXPECT_NEAR(still, -33.08 * kUm, 0.01 * kUm);
  AxisBench axis(machine_with(kX, effect), kX);
  double worst = 0, lowest = 0;
  double last = 0;
  std::vector<double> crossings;  // of the deflection at rest, downwards
  for (int k = 0; k < 1000; ++k) {
    axis.cycle(a);
    for (std::size_t i = 0; i < kDriveLoopSteps; ++i) {
      const double t = kDriveLoopTime * (10 * k + static_cast<int>(i) + 1);
      const double z = axis.last().truth[i] - 0.5 * a * t * t;
      const double ringing =
          std::exp(-0.04 * w * t) * (std::cos(w_d * t) + 0.04 * w / w_d * std::sin(w_d * t));
      worst = std::max(worst, std::abs(z - still * (1 - ringing)));
      lowest = std::min(lowest, z);
      if (last >= still && z < still)
        crossings.push_back(t - kDriveLoopTime * (z - still) / (z - last));
      last = z;
    }
  }
  EXPECT_LT(worst, 1e-13);
  EXPECT_NEAR(lowest / still, 1 + std::exp(-kPi * 0.04 / std::sqrt(1 - 0.04 * 0.04)), 1e-6);
  ASSERT_GT(crossings.size(), 20u);
  const double period = (crossings[20] - crossings[0]) / 20;
  EXPECT_NEAR(1 / period, w_d / (2 * kPi), 1e-6 * 35);
  EXPECT_NEAR(last, still, 1e-3 * std::abs(still));
}

// Forced by a swing: amplitude g W^2 / |w^2 - W^2 + 2 i zeta w W| of the motion's.
TEST(MechanicsEffects, StructuralModeFollowsItsFrequencyResponse) {
  const double w = 2 * kPi * 20;
  for (const double f : {5.0, 15.0, 20.0, 30.0}) {
    const double W = 2 * kPi * f, amplitude = 20e-6;
    const double expected =
        amplitude * W * W / std::abs(std::complex<double>(w * w - W * W, 2 * 0.1 * w * W));
    double reached = 0;
    for (const auto& [t, q, z] :
         swing(kX, amplitude, f, 1.5,
               StructuralMode{.participation = 1, .frequency = 20, .damping_ratio = 0.1}))
      if (t > 1) reached = std::max(reached, std::abs(z));
    EXPECT_NEAR(reached, expected, 1e-4 * expected) << f;  // sampled every 100 us
  }
}

// Far beyond what an explicit rule would bear, 1.2 rad a step: an undamped mode neither grows nor
// fades over 20 s.
TEST(MechanicsEffects, StructuralModeIsStableAtAnyFrequency) {
  const StructuralMode effect{.participation = 1, .frequency = 1900, .damping_ratio = 0};
  AxisBench with(machine_with(kX, effect), kX), without(machine_with(kX), kX);
  const auto largest = [&](int cycles, double acceleration) {
    double z = 0;
    for (int k = 0; k < cycles; ++k) {
      with.cycle(acceleration);
      without.cycle(acceleration);
      for (std::size_t i = 0; i < kDriveLoopSteps; ++i)
        z = std::max(z, std::abs(with.last().truth[i] - without.last().truth[i]));
    }
    return z;
  };
  largest(1, 1);
  const double first = largest(1000, 0);
  largest(18000, 0);
  const double w =
      2 * kPi * 1900;  // after a pulse of 1 m/s^2 over 1 ms: 2 a / w^2 |sin(w 1 ms / 2)|
  EXPECT_NEAR(first, 2 / (w * w) * std::abs(std::sin(w * 0.5e-3)), 1e-6 / (w * w));
  EXPECT_NEAR(largest(1000, 0), first, 1e-6 * first);
}

}  // namespace
}  // namespace vcnc::mechanics_effects_test
