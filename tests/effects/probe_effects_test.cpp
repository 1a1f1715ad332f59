// The stylus ball, its contact and the probe, through ProbeContact and the probe node.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/effects/probe_bench.hpp"

namespace vcnc::probe_effects_test {
namespace {

constexpr double kUm = 1e-6;

ToolPose at(const Vec3& p, const Mat3& R = Mat3::Identity()) { return {p, R}; }

ProbeContact contact_with(const Effects& effects, const Piece* piece) {
  return ProbeContact({}, machine_chain<TouchPort>(effects, 1), piece);
}

/// Deflection with the ball 0.5 mm deep on a wall.
Vec3 resting_on(const Machine& machine, const Vec3& n) {
  const auto readings = wall_readings(
      machine, n, 110, [&](double) { return ball_at((machine.probe.ball_radius - 0.5e-3) * n); });
  return Vec3(readings.back().deflection.data());
}

TEST(ProbeEffects, NullEffectsDoNotChangeABit) {
  Machine ideal, null;
  null.effects.simulate_null = true;
  const auto q = [](double t) {
    return ball_at({2.5e-3 + 1e-4 * std::sin(20 * t), 0.03 * t, 0.01 * t}, 0.3 * t, t);
  };
  const auto a = wall_readings(ideal, Vec3(3, 1, 2).normalized(), 500, q);
  const auto b = wall_readings(null, Vec3(3, 1, 2).normalized(), 500, q);
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k].adc, b[k].adc);
    ASSERT_EQ(a[k].deflection, b[k].deflection);
    ASSERT_EQ(a[k].flags, b[k].flags);
  }
}

// ---------------------------------------------------------------------------- ball

TEST(TipRadius, AddsToThePenetration) {
  Effects effects;
  effects.get<TipRadius>() = {5 * kUm};
  const Vec3 n = Vec3(1, -2, 0.5).normalized();
  const auto piece = make_piece(wall(n));
  ProbeContact contact = contact_with(effects, piece.get());
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR(contact.step(at(2.5e-3 * n)).dot(n), 0.5e-3 + 5 * kUm, 1e-15);
}

// In a ring the lobes appear as they are.
TEST(TipLobing, HarmonicOfTheNormal) {
  for (const int lobes : {2, 3, 7}) {
    Effects effects;
    effects.get<TipLobing>() = {2 * kUm, lobes, 0.3};
    PieceParams params;
    params.kind = PieceParams::Kind::ring;
    params.radius = 102.5e-3;
    const auto ring = make_piece(params);
    ProbeContact contact = contact_with(effects, ring.get());
    const double R = 0.1, w = 0.5;
    for (int i = 0; i < 20000; ++i) {
      const double phi = w * kBenchStep * i;
      const Vec3 out(std::cos(phi), std::sin(phi), 0);
      const double radial = contact.step(at(R * out)).dot(contact.surface().n);
      if (i < 3000) continue;
      // The normal points inwards. Its age of one step is worth n w h A = 0.7 nm for 7 lobes; the
      // normal at the ball is turned against that at the tip by the damper's drag (1e-5 rad).
      const double expected = 0.5e-3 + 2 * kUm * std::cos(lobes * (phi + kPi - 0.3));
      ASSERT_NEAR(radial, expected, 1e-9);
    }
  }
}

// On the pole of the ball there is no lobe; in between it fades with rho^n.
TEST(TipLobing, FadesTowardsThePole) {
  Effects effects;
  effects.get<TipLobing>() = {2 * kUm, 3, 0};
  for (const double tilt : {0.0, 0.3, 1.0, 0.5 * kPi}) {
    const Vec3 n(std::sin(tilt), 0, std::cos(tilt));
    const auto piece = make_piece(wall(n));
    ProbeContact contact = contact_with(effects, piece.get());
    double depth = 0;
    // The first step knows no normal; what comes of its correction has died away then.
    for (int i = 0; i < 5000; ++i) depth = contact.step(at(2.5e-3 * n)).dot(n);
    EXPECT_NEAR(depth - 0.5e-3, 2 * kUm * std::pow(std::sin(tilt), 3), 1e-15);
  }
  // The lobes turn with the probe.
  const auto piece = make_piece(wall(Vec3::UnitX()));
  ProbeContact contact = contact_with(effects, piece.get());
  const Mat3 R = rot_z(kPi / 3);
  Vec3 delta;
  for (int i = 0; i < 5000; ++i) delta = contact.step(at(2.5e-3 * Vec3::UnitX(), R));
  EXPECT_NEAR((R * delta).x(), 0.5e-3 - 2 * kUm, 1e-15);
}

// Steady sliding: drag mu F_n / k against the motion, in both directions.
TEST(SurfaceFriction, DragsByItsCoefficient) {
  Effects effects;
  effects.get<SurfaceFriction>() = {0.15};
  const auto piece = make_piece(wall(Vec3::UnitX()));
  for (const double speed : {0.03, -0.01}) {
    ProbeContact contact = contact_with(effects, piece.get());
    Vec3 delta;
    for (int i = 0; i < 20000; ++i) delta = contact.step(at({2.5e-3, speed * kBenchStep * i, 0}));
    EXPECT_NEAR(delta.x(), 0.5e-3, 1e-15);
    EXPECT_NEAR(delta.y(), (speed > 0 ? -1 : 1) * 0.15 * 0.5e-3, 1e-12);
  }
}

// Drawn off slowly, the ball leaves the wall where the spring no longer moves the guides: at h.
TEST(ReturnToZero, FreeBallStaysAtTheEdgeOfTheBand) {
  const double h = 3 * kUm;
  Effects effects;
  effects.get<ReturnToZero>() = {h};
  const auto piece = make_piece(wall(Vec3::UnitX()));
  ProbeContact contact = contact_with(effects, piece.get());
  const double speed = 0.2e-3;
  double x = 2.95e-3;
  Vec3 delta;
  for (int i = 0; i < 10000; ++i) {
    x = std::min(x + speed * kBenchStep, 3.1e-3);
    delta = contact.step(at({x, 0, 0}));
  }
  EXPECT_FALSE(contact.touching());
  // It keeps the speed of the suspension, v, until spring and guides stop it: less than v/w0.
  const double w0 = std::sqrt(ProbeParams().spring_rate / 0.065);
  EXPECT_LE(delta.x(), h);
  EXPECT_GT(delta.x(), h - speed / w0);
}

TEST(ContactLoss, BallSwingsFreelyAndComesBackWithoutABlow) {
  Machine machine;
  machine.effects.get<ContactLoss>() = {.start = 0.3, .duration = 0.3};
  const auto readings = wall_readings(machine, Vec3::UnitX(), 1000, [](double) {
    return ball_at({2.5e-3, 0, 0});
  });
  const ProbeParams probe;
  const double w0 = std::sqrt(probe.spring_rate / (probe.moving_mass + probe.stylus_mass));
  const double zeta = probe.damping_ratio, wd = w0 * std::sqrt(1 - zeta * zeta);
  for (std::size_t k = kApproach; k < readings.size(); ++k) {
    const double x = readings[k].deflection[0], t = 1e-3 * static_cast<double>(k) - 0.3;
    EXPECT_FALSE(readings[k].flags & ProbeSample::kSlip) << k;
    if (t < -1e-9) {
      ASSERT_NEAR(x, 0.5e-3, kReadingError);
    } else if (t < 0.3 - 1e-9) {
      const double u = t + kBenchStep;  // free since the step before
      const double swing = 0.5e-3 * std::exp(-zeta * w0 * u) *
                           (std::cos(wd * u) + zeta * w0 / wd * std::sin(wd * u));
      // Symplectic Euler is half a step of time off, w0 h/2 = 0.7 % of the swing.
      ASSERT_NEAR(x, swing, 0.007 * 0.5e-3) << t;
    } else {
      // The surface comes back with 20 ms; after 0.3 s there is nothing left.
      const double back = 0.5e-3 * (1 - std::exp(-(t - 0.3 + 1e-4) / 20e-3));
      ASSERT_NEAR(x, back, 2e-9) << t;
    }
  }
  EXPECT_NEAR(readings.back().deflection[0], 0.5e-3, 2e-9);
}

// ---------------------------------------------------------------------------- sensor

// Carbide, 50 mm x 2 mm, E = 600 GPa: L^3/(3 E I) = 88.4 um/N; two springs in series.
TEST(StylusBending, SensorSeesTheRestOfTwoSprings) {
  const double L = 0.05, d = 2e-3, E = 600e9, I = kPi * std::pow(d, 4) / 64;
  const double lateral = L * L * L / (3 * E * I), axial = L / (E * kPi * d * d / 4);
  EXPECT_NEAR(lateral, 88.42e-6, 0.01e-6);
  EXPECT_NEAR(axial, 0.02653e-6, 0.00001e-6);
  Machine machine;
  machine.effects.get<StylusBending>() = {lateral, axial};
  const double k = machine.probe.spring_rate;
  // Series: the whole 0.5 mm is the sum of the suspension's and the stylus' share at one force.
  const double force = 0.5e-3 / (1 / k + lateral), along = 0.5e-3 / (1 / k + axial);
  EXPECT_NEAR(resting_on(machine, Vec3::UnitX()).x(), force / k, kReadingError);
  EXPECT_NEAR(resting_on(machine, -Vec3::UnitY()).y(), -force / k, kReadingError);
  EXPECT_NEAR(resting_on(machine, Vec3::UnitZ()).z(), along / k, kReadingError);
}

TEST(ProbeGain, ScalesEachChannel) {
  Machine machine;
  machine.effects.get<ProbeGain>().gain = Vec3(0.01, -0.02, 0.03);
  const Vec3 n = Vec3(1, -2, 2) / 3;
  const Vec3 delta = resting_on(machine, n);
  EXPECT_NEAR(delta.x(), 1.01 * 0.5e-3 * n.x(), kReadingError);
  EXPECT_NEAR(delta.y(), 0.98 * 0.5e-3 * n.y(), kReadingError);
  EXPECT_NEAR(delta.z(), 1.03 * 0.5e-3 * n.z(), kReadingError);
}

TEST(CrossTalk, CopiesOneChannelIntoAnother) {
  Machine machine;
  machine.effects.get<CrossTalk>() = {.x_from_y = 0.01,
                                      .x_from_z = 0.02,
                                      .y_from_x = 0.03,
                                      .y_from_z = -0.01,
                                      .z_from_x = -0.02,
                                      .z_from_y = -0.03};
  const Vec3 n = Vec3(1, -2, 2) / 3, d = 0.5e-3 * n;
  const Vec3 delta = resting_on(machine, n);
  EXPECT_NEAR(delta.x(), d.x() + 0.01 * d.y() + 0.02 * d.z(), kReadingError);
  EXPECT_NEAR(delta.y(), 0.03 * d.x() + d.y() - 0.01 * d.z(), kReadingError);
  EXPECT_NEAR(delta.z(), -0.02 * d.x() - 0.03 * d.y() + d.z(), kReadingError);
}

// Along the normal: (c_xy + c_yx)/2 sin 2 theta of the deflection.
TEST(CrossTalk, ShowsAsTwoPeriodsPerTurnOfTheNormal) {
  Machine machine;
  machine.effects.get<CrossTalk>() = {.x_from_y = 0.02, .y_from_x = 0.01};
  for (double theta = 0; theta < 2 * kPi; theta += 0.7) {
    const Vec3 n(std::cos(theta), std::sin(theta), 0);
    EXPECT_NEAR(resting_on(machine, n).dot(n), 0.5e-3 * (1 + 0.015 * std::sin(2 * theta)),
                2 * kReadingError);
  }
}

TEST(ProbeDrift, LinearAndTowardsAnEnd) {
  Machine machine;
  const Vec3 rate = Vec3(60, -30, 0) * kUm / 60;  // per minute
  for (const double tau : {0.0, 0.7}) {
    machine.effects.get<ProbeDrift>() = {rate, tau};
    const auto readings = wall_readings(machine, Vec3::UnitZ(), 2000, [](double) {
      return ball_at({0, 0, 2.5e-3});
    });
    for (const std::size_t k : {100u, 500u, 2000u}) {
      const double t = 1e-3 * static_cast<double>(k);
      const double grown = tau > 0 ? tau * (1 - std::exp(-t / tau)) : t;
      EXPECT_NEAR(readings[k].deflection[0], 1 * kUm * grown, kReadingError);
      EXPECT_NEAR(readings[k].deflection[1], -0.5 * kUm * grown, kReadingError);
      EXPECT_NEAR(readings[k].deflection[2], 0.5e-3, kReadingError);
    }
  }
}

TEST(RangeClip, ReadsTheEndOfTheRange) {
  Machine machine;
  machine.effects.get<RangeClip>() = {0.4e-3};
  for (const double depth : {0.1e-3, 0.4e-3, 0.6e-3}) {
    for (const double side : {1.0, -1.0}) {
      const Vec3 n = side * Vec3::UnitX();
      const auto readings =
          wall_readings(machine, n, 110, [&](double) { return ball_at((3e-3 - depth) * n); });
      EXPECT_NEAR(readings.back().deflection[0], side * std::min(depth, 0.4e-3), kReadingError);
    }
  }
}

}  // namespace
}  // namespace vcnc::probe_effects_test
