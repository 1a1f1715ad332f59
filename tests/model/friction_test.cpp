#include "model/drive/friction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "model/effects/chain.hpp"
#include "model/math.hpp"

namespace vcnc::friction_test {
namespace {

constexpr double kDt = 50e-6, kMass = 500;

struct Guide {
  Coulomb coulomb;
  Stribeck stribeck;
  Viscous viscous;
  Presliding presliding;
};

/// Friction with the terms that the effects of an axis give.
class Rubbing {
 public:
  explicit Rubbing(const Guide& guide) {
    Effects effects;
    effects.axis[kX].get<Coulomb>() = guide.coulomb;
    effects.axis[kX].get<Stribeck>() = guide.stribeck;
    effects.axis[kX].get<Viscous>() = guide.viscous;
    effects.axis[kX].get<Presliding>() = guide.presliding;
    chain_ = axis_chain<FrictionPort>(effects, kX, 1);
  }
  double step(double v, double v_free, double dt, double inertia) {
    FrictionTerms terms;
    chain_.step(terms, {{}, 0, v, v_free});
    return friction_.step(terms, v, v_free, dt, dt / inertia);
  }
  double force() const { return friction_.force(); }

 private:
  Chain<FrictionPort> chain_;
  Friction friction_;
};

Guide stribeck() {
  return {.coulomb = {250},
          .stribeck = {.excess = 100, .velocity = 2e-3},
          .viscous = {1000},
          .presliding = {}};
}

Guide lugre() {
  Guide guide = stribeck();
  guide.presliding = {.stiffness = 2.5e7, .damping = 1.5e4};
  return guide;
}

// Once it has slid, friction that slides at w +- g is that which slides at +-g, and w: also while
// the motion reverses, where a level by sgn v alone would bend the bristles otherwise.
TEST(Friction, SkewIsAForceOnceItHasSlid) {
  constexpr double kHeavy = 1e6, kLevel = 250, kSkew = 75;
  const FrictionTerms even{.dry = kLevel, .viscous = 1000, .stiffness = 2.5e7, .damping = 1.5e4};
  FrictionTerms skewed = even;
  skewed.skew = kSkew;
  Friction a, b;
  double bent = 0;  // least and most of the bristles' force
  for (int i = 0; i < 40000; ++i) {
    const auto velocity = [](int k) { return 2e-3 * std::sin(2 * kPi * k / 10000.0); };
    a.step(even, velocity(i), velocity(i + 1), kDt, kDt / kHeavy);
    b.step(skewed, velocity(i), velocity(i + 1), kDt, kDt / kHeavy);
    if (i < 4000) continue;
    EXPECT_NEAR(b.force() - a.force(), kSkew, 0.01) << i;
    bent = std::max(bent, std::abs(a.force()));
  }
  EXPECT_NEAR(bent, kLevel + 2, 1);
}

// Force needed to hold a velocity, found by holding it.
double force_at(const Guide& guide, double v) {
  Rubbing friction(guide);
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
    Rubbing friction(stribeck());
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
  Rubbing friction(stribeck());
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
  Guide guide;
  guide.viscous.coefficient = 1e4;
  Rubbing friction(guide);
  double v = 0.1;
  for (int i = 0; i < 1000; ++i) v = friction.step(v, v, kDt, kMass);
  EXPECT_NEAR(v, 0.1 * std::exp(-1.0), 1e-4);
}

TEST(Friction, LuGrePreslidingIsASpring) {
  Rubbing friction(lugre());
  double x = 0, v = 0;
  // A slow push to 50 N, far below Fc: the bristles bend by F / sigma0 = 2 um.
  for (int i = 0; i < 40000; ++i) {
    const double force = std::min(50.0, 50.0 * i / 20000);
    v = friction.step(v, v + kDt * force / kMass, kDt, kMass);
    x += kDt * v;
  }
  EXPECT_NEAR(x, 2e-6, 0.3e-6);  // the curve bends: 50 N is a seventh of Fs
  Rubbing soft(lugre());
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
    Guide guide;
    guide.coulomb.level = 1000 * uniform();
    guide.stribeck.excess = std::max(2000 * uniform() - guide.coulomb.level, 0.0);
    guide.viscous.coefficient = 1e4 * uniform();
    guide.stribeck.velocity = 1e-4 + 0.01 * uniform();
    Rubbing friction(guide);
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
    Rubbing friction(lugre());
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
    Guide guide = lugre();
    guide.presliding = {.stiffness = stiffness, .damping = 1e8};
    Rubbing friction(guide);
    double v = 0;
    for (int i = 0; i < 20000; ++i) {
      const double force = 600 * std::sin(2 * kPi * 3 * i * kDt);
      v = friction.step(v, v + kDt * force / kMass, kDt, kMass);
      ASSERT_LT(std::abs(v), 0.1) << stiffness;
    }
  }
}

TEST(Friction, NullIsIdentity) {
  Rubbing friction(Guide{});
  for (const double v : {-0.3, 0.0, 1e-9, 0.2}) EXPECT_EQ(friction.step(0.1, v, kDt, kMass), v);
}

}  // namespace
}  // namespace vcnc::friction_test
