#include "model/drive/friction.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace vcnc {
namespace {

constexpr double kDt = 50e-6, kMass = 500;

FrictionParams stribeck() {
  FrictionParams p;
  p.coulomb = 250;
  p.breakaway = 350;
  p.stribeck_velocity = 2e-3;
  p.viscous = 1000;
  return p;
}

FrictionParams lugre() {
  FrictionParams p = stribeck();
  p.presliding_stiffness = 2.5e7;
  p.presliding_damping = 1.5e4;
  return p;
}

// Force needed to hold a velocity, found by holding it.
double force_at(const FrictionParams& params, double v) {
  Friction friction(params);
  double force = 0;
  for (int i = 0; i < 200000; ++i) {
    // The drive force that keeps v: answer the friction of the last step.
    const double v1 = friction.step(v, v + kDt * force / kMass, kDt, kMass);
    force += 0.5 * (v - v1) * kMass / kDt;
  }
  return friction.force();
}

TEST(Friction, StribeckLawAtConstantSpeed) {
  for (const double v : {1e-4, 1e-3, 2e-3, 5e-3, 0.05, -0.05, -1e-3}) {
    const double expected =
        std::copysign(250 + 100 * std::exp(-(v / 2e-3) * (v / 2e-3)), v) + 1000 * v;
    EXPECT_NEAR(force_at(stribeck(), v), expected, 1e-6) << v;
  }
}

TEST(Friction, LuGreLawAtConstantSpeed) {
  for (const double v : {1e-4, 1e-3, 2e-3, 5e-3, 0.05, -0.05}) {
    const double expected =
        std::copysign(250 + 100 * std::exp(-(v / 2e-3) * (v / 2e-3)), v) + 1000 * v;
    EXPECT_NEAR(force_at(lugre(), v), expected, 1e-5) << v;
  }
}

TEST(Friction, SticksBelowBreakawayAndOnlyThere) {
  for (const double force : {349.0, -349.0, 351.0, -351.0}) {
    Friction friction(stribeck());
    double v = 0;
    for (int i = 0; i < 1000; ++i) v = friction.step(v, v + kDt * force / kMass, kDt, kMass);
    if (std::abs(force) < 350) {
      EXPECT_EQ(v, 0);
      EXPECT_NEAR(friction.force(), force, 1e-9);
    } else {
      EXPECT_GT(v * force, 0);
    }
  }
}

TEST(Friction, ComesToRestExactly) {
  Friction friction(stribeck());
  double v = 0.01;
  int steps = 0;
  while (v != 0 && steps < 100000) {
    const double v1 = friction.step(v, v, kDt, kMass);
    ASSERT_GE(v1, 0);
    ASSERT_LT(v1, v);
    v = v1;
    ++steps;
  }
  // Between the stopping times of the smallest and the largest friction.
  EXPECT_GT(steps * kDt, kMass * 0.01 / 360);
  EXPECT_LT(steps * kDt, kMass * 0.01 / 250);
}

// Viscous friction alone: v = v0 exp(-B t / m).
TEST(Friction, ViscousDecay) {
  FrictionParams params;
  params.viscous = 1e4;
  Friction friction(params);
  double v = 0.1;
  for (int i = 0; i < 1000; ++i) v = friction.step(v, v, kDt, kMass);
  EXPECT_NEAR(v, 0.1 * std::exp(-1.0), 1e-4);
}

TEST(Friction, LuGrePreslidingIsASpring) {
  Friction friction(lugre());
  double x = 0, v = 0;
  // A slow push to 50 N, far below Fc: the bristles bend by F / sigma0 = 2 um.
  for (int i = 0; i < 40000; ++i) {
    const double force = std::min(50.0, 50.0 * i / 20000);
    v = friction.step(v, v + kDt * force / kMass, kDt, kMass);
    x += kDt * v;
  }
  EXPECT_NEAR(x, 2e-6, 0.3e-6);  // the curve bends: 50 N is a seventh of Fs
  Friction soft(lugre());
  double x_small = 0;
  v = 0;
  for (int i = 0; i < 40000; ++i) {
    v = soft.step(v, v + kDt * 0.5 / kMass, kDt, kMass);
    x_small += kDt * v;
  }
  EXPECT_NEAR(0.5 / x_small, 2.5e7, 0.02 * 2.5e7);  // initial stiffness
}

// Friction takes energy, whatever the parameters and the motion.
TEST(Friction, NeverAddsKineticEnergyNorReverses) {
  std::mt19937_64 engine(5);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  for (int k = 0; k < 300; ++k) {
    FrictionParams params;
    params.coulomb = 1000 * uniform();
    params.breakaway = 2000 * uniform();
    params.viscous = 1e4 * uniform();
    params.stribeck_velocity = 1e-4 + 0.01 * uniform();
    Friction friction(params);
    const double mass = 1 + 1000 * uniform();
    double v = 0.2 * uniform() - 0.1;
    for (int i = 0; i < 300; ++i) {
      const double v_free = v + kDt * (4e3 * uniform() - 2e3) / mass;
      const double v1 = friction.step(v, v_free, kDt, mass);
      ASSERT_LE(std::abs(v1), std::abs(v_free));
      ASSERT_GE(v1 * v_free, 0);
      ASSERT_GE(friction.force() * v1, 0);
      v = v1;
    }
  }
}

// Over a closed cycle of motion the LuGre model takes energy; it only lends what its bristles
// store.
TEST(Friction, LuGreDissipatesOverCycles) {
  for (const double amplitude : {2e-6, 20e-6, 2e-3}) {
    Friction friction(lugre());
    double work = 0, lowest = 0;
    double v = 0;
    for (int i = 0; i < 40000; ++i) {
      const double v_free = amplitude * 2 * kPi * 5 * std::cos(2 * kPi * 5 * i * kDt);
      const double v1 = friction.step(v, v_free, kDt, 1e9);  // a mass that nothing stops
      work += friction.force() * v1 * kDt;
      lowest = std::min(lowest, work);
      v = v_free;
    }
    EXPECT_GT(work, 0) << amplitude;
    EXPECT_GT(lowest, -1e-9) << amplitude;
  }
}

TEST(Friction, StableForAnyStiffness) {
  for (const double stiffness : {1e6, 1e9, 1e12, 1e15}) {
    FrictionParams params = lugre();
    params.presliding_stiffness = stiffness;
    params.presliding_damping = 1e8;
    Friction friction(params);
    double v = 0;
    for (int i = 0; i < 20000; ++i) {
      const double force = 600 * std::sin(2 * kPi * 3 * i * kDt);
      v = friction.step(v, v + kDt * force / kMass, kDt, kMass);
      ASSERT_LT(std::abs(v), 0.1) << stiffness;
    }
  }
}

TEST(Friction, NullIsIdentity) {
  Friction friction(FrictionParams{});
  for (const double v : {-0.3, 0.0, 1e-9, 0.2}) EXPECT_EQ(friction.step(0.1, v, kDt, kMass), v);
}

}  // namespace
}  // namespace vcnc
