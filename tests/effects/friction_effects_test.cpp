#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "model/effects/chain.hpp"
#include "tests/effects/axis_bench.hpp"

namespace vcnc::friction_effects_test {
namespace {

using namespace axis_bench;

/// Drive force that holds a constant speed.
template <class... Effect>
double force_at(std::size_t axis, double velocity, const Effect&... effect) {
  return AxisBench(machine_with(axis, effect...), axis).at_speed(velocity, 1.5).force;
}

// What limits the levels below: rounding of set-points of 0.3 m, 3e-17 m, taken for an acceleration
// over 1 ms times 0.1 ms and fed forward with 3242 kg.
constexpr double kLevel = 5e-6;

TEST(FrictionEffects, CoulombIsTheSameForceAtEverySpeed) {
  for (const double v : {1e-4, 1e-3, 0.02, 0.2}) {
    EXPECT_NEAR(force_at(kX, v, Coulomb{250}), 250, kLevel) << v;
    EXPECT_NEAR(force_at(kX, -v, Coulomb{250}), -250, kLevel) << v;
    EXPECT_NEAR(force_at(kC, v, Coulomb{5}), 5, kLevel) << v;
  }
}

TEST(FrictionEffects, ViscousIsInProportionToTheSpeed) {
  for (const double v : {-0.2, 1e-3, 0.02, 0.2}) {
    EXPECT_NEAR(force_at(kY, v, Viscous{2000}), 2000 * v, kLevel) << v;
    EXPECT_NEAR(force_at(kA, v, Viscous{5}), 5 * v, kLevel) << v;
  }
}

// The integral follows a force that grows by B a per second: error Ti B a / (Kp Kv). The lag of the
// velocity observer with its poles at w_o = 4 Kp / J adds 3 B a / (J w_o^2) of velocity error, the
// share 3 / (16 Ti Kp / J).
TEST(FrictionEffects, ViscousLagsWhileAccelerating) {
  Machine machine = machine_with(kX, Viscous{2000});
  ServoParams& servo = machine.axes[kX].servo;
  servo.integral_time = 0.1;
  const double kp = 2 * kPi * servo.velocity_bandwidth * machine.axes[kX].mechanics.total_inertia();
  const double a = 0.3, expected = servo.integral_time * 2000 * a / (kp * servo.kv_per_s);
  const double observer = 3 / (16 * servo.integral_time * 2 * kPi * servo.velocity_bandwidth);
  AxisBench axis(machine, kX);
  const Reading end = axis.go(1.5, a);
  EXPECT_NEAR(expected, 0.921e-6, 0.001e-6);
  EXPECT_NEAR(observer, 0.0037, 0.0001);
  EXPECT_NEAR(axis.commanded() - end.position, expected * (1 + observer), 5e-4 * expected);
}

TEST(FrictionEffects, StribeckFallsWithTheSpeed) {
  const Coulomb coulomb{250};
  const Stribeck stribeck{.excess = 100, .velocity = 2e-3};
  // Gaussian over the speed: 100 N times 1, e^-1/4, e^-1, e^-4.
  EXPECT_NEAR(force_at(kX, 2e-6, coulomb, stribeck), 350, 1e-3);
  EXPECT_NEAR(force_at(kX, 1e-3, coulomb, stribeck), 250 + 77.88007830714049, kLevel);
  EXPECT_NEAR(force_at(kX, 2e-3, coulomb, stribeck), 250 + 36.78794411714423, kLevel);
  EXPECT_NEAR(force_at(kX, -4e-3, coulomb, stribeck), -250 - 1.831563888873418, kLevel);
}

// Bristles at rest, drawn slowly: dz/dx = 1 - sigma0 z / g, so F = g (1 - exp(-sigma0 x / g)), and
// after a reversal from sliding F = -g + 2 g exp(-sigma0 d / g) over the way back d. Limited by the
// time step: sigma0 v dt / g = 2.5e-4 of g.
TEST(FrictionEffects, PreslidingIsASpringThatBends) {
  const double g = 250, sigma0 = 2.5e7, v = 50e-6;
  AxisBench axis(machine_with(kX, Coulomb{g}, Presliding{.stiffness = sigma0, .damping = 0}), kX);
  axis.go(0.1, v / 0.1);
  for (const double x : {5e-6, 10e-6, 20e-6, 60e-6}) {
    const Reading r = axis.go((x - axis.commanded()) / v);
    EXPECT_NEAR(r.force, g * (1 - std::exp(-sigma0 * r.position / g)), 0.1) << x;
  }
  Reading top;
  for (int k = 0; k < 200; ++k) {
    const Reading r = axis.cycle(-v / 0.1);
    if (r.position > top.position) top = r;
  }
  EXPECT_NEAR(top.position, 62.5e-6, 0.5e-6);  // 60 um and v^2 / 2a while braking
  const double braking = Machine().axes[kX].mechanics.total_inertia() * v / 0.1;  // 1.6 N
  const double turned = top.force + braking;
  EXPECT_NEAR(turned, g * (1 - std::exp(-sigma0 * top.position / g)), 0.1);
  for (const double d : {5e-6, 10e-6, 30e-6, 60e-6}) {
    const Reading r = axis.go((d - (62.5e-6 - axis.commanded())) / v);
    const double back = top.position - r.position;
    EXPECT_NEAR(r.force, -g + (g + turned) * std::exp(-sigma0 * back / g), 0.2) << d;
  }
}

TEST(FrictionEffects, GreaseDragRisesToItsLimit) {
  const GreaseDrag drag{.level = 200, .velocity = 5e-3};
  EXPECT_NEAR(force_at(kX, 5e-3, drag), 152.31883119115297, kLevel);     // tanh 1
  EXPECT_NEAR(force_at(kX, -10e-3, drag), -192.80551601516339, kLevel);  // tanh 2
  EXPECT_NEAR(force_at(kX, 0.2, Coulomb{50}, drag), 250, kLevel);
  EXPECT_NEAR(force_at(kX, 1e-5, drag) / 1e-5, 200 / 5e-3, 2);  // viscous near rest
  EXPECT_NEAR(force_at(kC, 0.05, GreaseDrag{.level = 5, .velocity = 0.05}), 3.807970779778824,
              kLevel);
}

TEST(FrictionEffects, NonlinearViscousIsAPowerOfTheSpeed) {
  // 200 N at 100 mm/s; at 25 mm/s 200/2 (root), 200/16 (square), 200/64 (cube).
  const auto force = [](double v, double n) {
    return force_at(kX, v, NonlinearViscous{.force = 200, .exponent = n});
  };
  for (const double n : {0.3, 0.5, 1.0, 2.0, 3.0}) EXPECT_NEAR(force(0.1, n), 200, kLevel) << n;
  EXPECT_NEAR(force(0.025, 0.5), 100, kLevel);
  EXPECT_NEAR(force(0.025, 2), 12.5, kLevel);
  EXPECT_NEAR(force(-0.025, 3), -3.125, kLevel);
  EXPECT_NEAR(force(0.2, 0.3), 246.2288826689833, kLevel);  // 200 * 2^0.3
  const NonlinearViscous rotary{.force = 5, .exponent = 2};
  EXPECT_NEAR(force_at(kC, 50 * kDegree, rotary), 1.25, kLevel);
}

// Below 10 um/s a line to zero: nothing holds the axis at rest, however small n.
TEST(FrictionEffects, NonlinearViscousLetsTheAxisStart) {
  const NonlinearViscous effect{.force = 1000, .exponent = 0.3};
  const double at_10um_s = 1000 * std::pow(1e-4, 0.3);
  EXPECT_NEAR(force_at(kX, 1e-5, effect), at_10um_s, 1e-5);
  EXPECT_NEAR(force_at(kX, 2e-6, effect), 0.2 * at_10um_s, 1e-5);
}

TEST(FrictionEffects, AsymmetryShiftsTheLevels) {
  const Coulomb coulomb{250};
  const Viscous viscous{1000};
  const FrictionAsymmetry effect{.dry = 0.2, .viscous = 0.1};
  for (const double v : {1e-3, 0.05, 0.2}) {
    const double out = force_at(kX, v, coulomb, viscous, effect);
    const double back = force_at(kX, -v, coulomb, viscous, effect);
    EXPECT_NEAR(out, 300 + 1100 * v, kLevel) << v;
    EXPECT_NEAR(back, -200 - 900 * v, kLevel) << v;
  }
}

/// Friction of an axis with these effects on a free mass.
class Slider {
 public:
  explicit Slider(const Machine& machine)
      : chain_(axis_chain<FrictionPort>(machine.effects, kX, 1)) {}
  void push(double force) {
    constexpr double kMass = 500;
    const double v_free = v_ + kPlantTime * force / kMass;
    FrictionTerms terms;
    chain_.step(terms, {{}, x_, v_, v_free});
    v_ = friction_.step(terms, v_, v_free, kPlantTime, kPlantTime / kMass);
    x_ += kPlantTime * v_;
  }
  double position() const { return x_; }

 private:
  Chain<FrictionPort> chain_;
  Friction friction_;
  double x_ = 0, v_ = 0;
};

// At rest the direction of the push decides: 300 N one way, 200 N the other, without creep below.
TEST(FrictionEffects, AsymmetryHoldsAtRest) {
  const Machine machine = machine_with(kX, Coulomb{250}, FrictionAsymmetry{.dry = 0.2});
  for (const double limit : {300.0, -200.0}) {
    Slider slider(machine);
    for (int i = 0; i < 2000; ++i) slider.push(0.999 * limit);
    EXPECT_EQ(slider.position(), 0);
    for (int i = 0; i < 2000; ++i) slider.push(1.001 * limit);
    EXPECT_GT(slider.position() / limit, 0);
  }
}

// Slowly through a zone and back: F = 250 (1 + 0.4 b(q)) along the motion, within the way of one
// loop step on the steepest flank, 3e4 N/m times 1 um.
TEST(FrictionEffects, ZoneIsAPlateauWithFlanks) {
  const FrictionZone zone{.height = 0.4, .centre = 0.03, .width = 0.02, .edge = 0.005};
  AxisBench axis(machine_with(kX, Coulomb{250}, zone), kX);
  const auto shape = [](double q) {  // written out once more
    const double x = (0.01 - std::abs(q - 0.03)) / 0.005;
    return x <= -0.5 ? 0 : x >= 0.5 ? 1 : 0.5 + x * (1.5 - 2 * x * x);
  };
  EXPECT_EQ(shape(0.0225), 1);
  EXPECT_NEAR(shape(0.02), 0.5, 1e-15);
  EXPECT_EQ(shape(0.0175), 0);
  axis.at_speed(0.01, 0.5);
  double out = 0, back = 0;
  for (int k = 0; k < 5000; ++k) {
    const Reading r = axis.cycle();
    out = std::max(out, std::abs(r.force - 250 * (1 + 0.4 * shape(r.position))));
  }
  axis.at_speed(-0.01, 0.3);
  for (int k = 0; k < 5000; ++k) {
    const Reading r = axis.cycle();
    back = std::max(back, std::abs(r.force + 250 * (1 + 0.4 * shape(r.position))));
  }
  EXPECT_LT(out, 0.035);
  EXPECT_LT(back, 0.035);
}

TEST(FrictionEffects, ZoneBeyondTheTravelIsAStep) {
  const FrictionZone beyond{.height = -0.5, .centre = 5.008, .width = 10, .edge = 1e-3};
  AxisBench axis(machine_with(kX, Coulomb{200}, beyond), kX);
  EXPECT_NEAR(axis.at_speed(0.01, 0.7).force, 200, kLevel);  // 7 mm
  EXPECT_NEAR(axis.at_speed(0.01, 0.7).force, 100, kLevel);  // 14 mm
}

// g = 250 (1 - 0.3 (1 - exp(-t / 0.5 s))): at the start, after one and after four time constants.
// Limited by one loop step, in which it falls by 0.01 N.
TEST(FrictionEffects, FadeFallsExponentially) {
  AxisBench axis(machine_with(kX, Coulomb{250}, FrictionFade{.share = 0.3, .time_constant = 0.5}),
                 kX);
  const Reading early = axis.at_speed(0.01, 0.25);
  EXPECT_NEAR(early.force, 250 * (0.7 + 0.3 * std::exp(-0.5)), 0.01);
  EXPECT_NEAR(axis.go(0.25).force, 202.5909580878582, 0.01);
  EXPECT_NEAR(axis.go(1.5).force, 176.3736729166551, 0.01);
  EXPECT_NEAR(axis.at_speed(-0.01, 20).force, -175, kLevel);
}

// What constant effects add is summed up beforehand: to the bit what all effects make one after the
// other, as the library lists them.
TEST(FrictionEffects, ConstantOnesMaySumUpBeforehand) {
  Machine machine;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if constexpr (std::is_same_v<typename Effect::Port, FrictionPort>)
      machine.effects.axis[kX].get<Effect>() = Effect::nominal(false);
  });
  auto chain = axis_chain<FrictionPort>(machine.effects, kX, 1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-0.1, 0.1);
  for (int i = 0; i < 2000; ++i) {
    const double q = number(random), v = std::pow(number(random), 3);
    const FrictionPort::Context<double> context{{.t = 1e-3 * i}, q, v, v + 1e-4 * number(random)};
    FrictionTerms one_by_one, at_once;
    for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
      if constexpr (std::is_same_v<typename Effect::Port, FrictionPort>) {
        NoState none;
        step_effect<double>(machine.effects.axis[kX].get<Effect>(), one_by_one, context, none,
                            Seat{kX, false, NoiseStream(1, Effect::text.name, kX)});
      }
    });
    chain.step(at_once, context);
    for (double FrictionTerms::*term :
         {&FrictionTerms::dry, &FrictionTerms::skew, &FrictionTerms::viscous,
          &FrictionTerms::stiffness, &FrictionTerms::damping})
      ASSERT_EQ(at_once.*term, one_by_one.*term) << i;
  }
}

// At the ends of their ranges what changes friction takes it away, but never makes it drive.
TEST(FrictionEffects, NeverNegative) {
  const auto terms = [](const auto& effect, double q, double v, double t) {
    auto chain = axis_chain<FrictionPort>(
        machine_with(kX, Coulomb{250}, Viscous{1000}, effect).effects, kX, 1);
    FrictionTerms result;
    chain.step(result, {{.t = t}, q, v, v});
    return result;
  };
  for (const double d : {-1.0, 1.0})
    for (const double v : {-0.1, 0.1}) {
      const FrictionTerms t = terms(FrictionAsymmetry{.dry = d, .viscous = d}, 0, v, 0);
      EXPECT_EQ(t.dry + std::copysign(t.skew, d * v), d * v > 0 ? 500 : 0);
      EXPECT_EQ(t.viscous, d * v > 0 ? 2000 : 0);
    }
  double lowest = 1;
  for (int i = -100; i <= 100; ++i) {
    const FrictionZone zone{.height = -1, .centre = 0, .width = 0.05, .edge = 0.03};
    lowest = std::min(lowest, terms(zone, 1e-3 * i, 0.1, 0).dry);
  }
  EXPECT_EQ(lowest, 0);
  EXPECT_EQ(terms(FrictionFade{.share = 1, .time_constant = 1}, 0, 0.1, 1e9).dry, 0);
}

}  // namespace
}  // namespace vcnc::friction_effects_test
