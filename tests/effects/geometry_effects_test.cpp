// Errors of guides and rotary axes through Kinematics::forward, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "model/effects/chain.hpp"
#include "model/geometry/kinematics.hpp"
#include "tests/effects/probe_bench.hpp"

namespace vcnc::geometry_effects_test {
namespace {

using Type = KinematicsParams::Type;

constexpr double kUm = 1e-6, kUrad = 1e-6;
constexpr double kRounding = 1e-15;  // [m] on coordinates below 1 m

KinematicsParams trunnion() {
  KinematicsParams k;
  k.type = Type::trunnion;
  k.p_MA = Vec3(0, 0.03, -0.05);
  k.p_MC = Vec3(0.01, 0.025, -0.08);
  return k;
}
KinematicsParams head() {
  KinematicsParams k;
  k.type = Type::head;
  k.p_CA = Vec3(0.01, 0.005, 0.02);
  k.p_AG = Vec3(0.003, -0.005, -0.2);
  return k;
}
const Vec3 kWorkOffset(0.05, -0.02, 0.1);
constexpr double kTool = 0.15;

/// A machine whose bodies are off by what the effects say.
class Bent {
 public:
  explicit Bent(const KinematicsParams& params, const Effects& effects = {})
      : kinematics(params, kTool, kWorkOffset), chain_(machine_chain<PosePort>(effects, 1)) {}

  GeometryErrors<double> errors(const AxisVector& q) {
    context_.moment = {static_cast<double>(count_) * 1e-4, 1e-4, count_};
    ++count_;
    for (std::size_t i = 0; i < kAxisCount; ++i) context_.axes[i].position = q[i];
    context_.arm = kinematics.arms(q);
    GeometryErrors<double> e;
    chain_.step(e, context_);
    return e;
  }
  ToolPose pose(const AxisVector& q) { return kinematics.forward(q, errors(q)); }
  /// Error of the tip in the workpiece frame.
  Vec3 error(const AxisVector& q) { return pose(q).p_WT - kinematics.forward(q).p_WT; }

  Kinematics kinematics;

 private:
  Chain<PosePort> chain_;
  PosePort::Context<double> context_;
  std::int64_t count_ = 0;
};

AxisVector random_axes(std::mt19937& random) {
  const auto in = [&](double most) {
    return most * (2.0 * static_cast<double>(random()) / 4294967295.0 - 1);
  };
  return {in(0.4), in(0.3), in(0.3), in(2), in(6)};
}

void expect_near(const Vec3& actual, const Vec3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance) << "component " << i;
}

/// Amplitude of cos(n phi) and sin(n phi) in samples f(phi) around a turn.
template <class F>
std::array<double, 2> harmonic(int n, F&& f) {
  constexpr int kCount = 720;
  double c = 0, s = 0;
  for (int i = 0; i < kCount; ++i) {
    const double phi = 2 * kPi * i / kCount, value = f(phi);
    c += 2 * value * std::cos(n * phi) / kCount;
    s += 2 * value * std::sin(n * phi) / kCount;
  }
  return {c, s};
}

TEST(PoseErrors, AllNullEffectsAreTheIdealMachineToTheLastBit) {
  Effects effects;
  effects.simulate_null = true;
  std::mt19937 random(7);
  const auto point = [&] {
    const AxisVector q = random_axes(random);
    return Vec3(q[kX], q[kY], q[kZ]);
  };
  for (int i = 0; i < 2000; ++i) {
    KinematicsParams params;
    params.type = i % 2 == 0 ? Type::trunnion : Type::head;
    params.p_MA = point();
    params.p_MC = point();
    params.p_CA = point();
    params.p_AG = point();
    params.a_reversed = i % 3 == 0;
    Bent machine(params, effects);
    const AxisVector q = random_axes(random);
    const ToolPose bent = machine.pose(q), ideal = machine.kinematics.forward(q);
    ASSERT_TRUE(bent.p_WT == ideal.p_WT) << bent.p_WT - ideal.p_WT;
    ASSERT_TRUE(bent.R_WT == ideal.R_WT);
  }
}

// Whatever the errors of rotary axes, tool and piece: distances and angles stay what they are.
TEST(PoseErrors, ComposeToARigidMotion) {
  Effects effects;
  effects.get<AAxisOffset>() = {1e-3, 2e-3};
  effects.get<AAxisTilt>() = {5e-3, -4e-3};
  effects.get<CAxisOffset>() = {-1e-3, 2e-3};
  effects.get<CAxisTilt>() = {3e-3, 4e-3};
  effects.get<PivotLength>() = {1e-3};
  effects.get<PieceOffset>().shift = Vec3(1, 2, 3) * 1e-3;
  effects.get<PieceTilt>().tilt = Vec3(0.01, 0.02, 0.03);
  effects.axis[kA].get<RotaryRunout>() = {.first = 1e-4, .second = 2e-4, .axial = 1e-4};
  effects.axis[kC].get<RotaryRunout>() = {.first = 1e-4, .second = 2e-4, .axial = 1e-4};
  std::mt19937 random(3);
  for (const KinematicsParams& params : {trunnion(), head()}) {
    Bent machine(params, effects);
    for (int i = 0; i < 200; ++i) {
      const AxisVector q = random_axes(random);
      AxisVector r = random_axes(random);
      r[kA] = q[kA];
      r[kC] = q[kC];
      const ToolPose one = machine.pose(q), two = machine.pose(r);
      const Vec3 way(q[kX] - r[kX], q[kY] - r[kY], q[kZ] - r[kZ]);
      EXPECT_NEAR((one.p_WT - two.p_WT).norm(), way.norm(), 5 * kRounding);
      EXPECT_LT((one.R_WT.transpose() * one.R_WT - Mat3::Identity()).norm(), 5e-15);
      EXPECT_NEAR(one.R_WT.determinant(), 1, 5e-15);
      // A tool of another length ends on the same line.
      Kinematics longer(params, kTool + 0.01, kWorkOffset);
      const ToolPose end = longer.forward(q, machine.errors(q));
      expect_near(end.p_WT, one.p_WT - 0.01 * one.R_WT.col(2), 5 * kRounding);
    }
  }
}

// ---------------------------------------------------------------------------- linear axes

TEST(Straightness, BowAndWaveInBothDirections) {
  const int across[3][2] = {{1, 2}, {0, 2}, {0, 1}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Effects effects;
    effects.axis[axis].get<Straightness>() = {.first_bow = 5 * kUm,
                                              .second_bow = -3 * kUm,
                                              .first_wave = 1 * kUm,
                                              .second_wave = 2 * kUm,
                                              .wavelength = 0.04,
                                              .phase = 0.3};
    Bent machine(trunnion(), effects);
    for (const double at : {-0.2, -0.1, 0.0, 0.03, 0.1}) {
      AxisVector q{0.01, 0.02, 0.03, 0, 0};
      q[axis] = at;
      const double wave = std::sin(2 * kPi * at / 0.04 + 0.3);
      Vec3 expected = Vec3::Zero();
      expected[across[axis][0]] = (500 * at * at + wave) * kUm;
      expected[across[axis][1]] = (-300 * at * at + 2 * wave) * kUm;
      expect_near(machine.error(q), expected, kRounding);
    }
  }
}

// A bow of X makes a first and a third harmonic of b/4 (R/100 mm)^2 on a circle.
TEST(Straightness, ThirdHarmonicOnACircle) {
  Effects effects;
  effects.axis[kX].get<Straightness>().first_bow = 8 * kUm;
  Bent machine(trunnion(), effects);
  const double R = 0.15;
  const auto radial = [&](double phi) {
    const Vec3 out(std::cos(phi), std::sin(phi), 0);
    return machine.error({R * out.x(), R * out.y(), 0, 0, 0}).dot(out);
  };
  const double expected = 8 * kUm / 4 * 1.5 * 1.5;
  EXPECT_NEAR(harmonic(1, radial)[1], expected, kRounding);
  EXPECT_NEAR(harmonic(3, radial)[1], expected, kRounding);
  EXPECT_NEAR(harmonic(3, radial)[0], 0, kRounding);
  EXPECT_NEAR(harmonic(2, radial)[0], 0, kRounding);
}

// Homogeneous transformations of the column Y on X, Z on Y, tool on Z: the same to eps^2 arm.
TEST(AngularErrors, AgreeWithTheChainOfRigidCarriages) {
  Effects effects;
  effects.axis[kX].get<AngularErrors>() = {10 * kUrad, 20 * kUrad, -15 * kUrad};
  effects.axis[kY].get<AngularErrors>() = {-12 * kUrad, 7 * kUrad, 9 * kUrad};
  effects.axis[kZ].get<AngularErrors>() = {5 * kUrad, -8 * kUrad, 11 * kUrad};
  const AxisVector q{0.4, -0.3, 0.25, 0, 0};
  const Vec3 eps[3]{4.0 * Vec3(10, 20, -15) * kUrad, -3.0 * Vec3(7, -12, 9) * kUrad,
                    2.5 * Vec3(-8, 11, 5) * kUrad};
  Bent machine(trunnion(), effects);
  const auto turn = [](const Vec3& t) {
    return Mat3(Eigen::AngleAxisd(t.norm(), t.normalized()).toRotationMatrix());
  };
  const Mat3 X = turn(eps[0]), Y = turn(eps[1]), Z = turn(eps[2]);
  const Vec3 tool(0, 0, -kTool);
  const Vec3 tip =
      q[kX] * Vec3::UnitX() + X * (q[kY] * Vec3::UnitY() + Y * (q[kZ] * Vec3::UnitZ() + Z * tool));
  const Vec3 nominal(q[kX], q[kY], q[kZ] - kTool);
  EXPECT_GT((tip - nominal).norm(), 10 * kUm);
  // (100 urad)^2 on 0.3 m is 3 nm.
  expect_near(machine.error(q), tip - nominal, 5e-9);
  expect_near(machine.pose(q).R_WT.col(2), X * Y * Z * Vec3::UnitZ(), 1e-8);
}

// The same angle at two heights: d = eps x arm.
TEST(AngularErrors, GrowWithTheArm) {
  Effects effects;
  effects.axis[kX].get<AngularErrors>() = {.pitch = 20 * kUrad};
  Bent machine(trunnion(), effects);
  for (const double z : {0.0, 0.2})
    expect_near(machine.error({0.3, 0, z, 0, 0}), Vec3(3 * 20 * kUrad * (z - kTool), 0, 0),
                kRounding);
  // On a head the arm reaches to the tip of the swivelled tool.
  Bent swivelled(head(), effects);
  const AxisVector q{0.3, 0.1, 0.2, 1.1, 0.7};
  const Vec3 tip = swivelled.kinematics.forward(q).p_WT + kWorkOffset;
  const Vec3 arm = tip - 0.3 * Vec3::UnitX();
  expect_near(swivelled.error(q), Vec3(0, 60 * kUrad, 0).cross(arm), kRounding);
}

TEST(LateralPlay, ShiftsByItsSizeAcrossTheReversingAxis) {
  Effects effects;
  effects.axis[kX].get<LateralPlay>() = {
      .first = 4 * kUm, .second = -2 * kUm, .crossing = 10 * kUm};
  Bent machine(trunnion(), effects);
  const auto at = [&](double x) { return machine.error({x, 0.1, 0, 0, 0}); };
  expect_near(at(0), Vec3::Zero(), kRounding);  // has not moved yet
  at(1e-3);
  expect_near(at(2e-3), Vec3(0, 2, -1) * kUm, kRounding);
  expect_near(at(2e-3), Vec3(0, 2, -1) * kUm, kRounding);  // standstill
  expect_near(at(2e-3 - 2.5e-6), Vec3(0, 1, -0.5) * kUm, kRounding);
  expect_near(at(2e-3 - 10e-6), Vec3(0, -2, 1) * kUm, kRounding);
  expect_near(at(-5e-3), Vec3(0, -2, 1) * kUm, kRounding);
  expect_near(at(-5e-3 + 1e-9), Vec3(0, -2 + 4e-4, 1 - 2e-4) * kUm, kRounding);  // no chatter
}

// ---------------------------------------------------------------------------- geometry

TEST(Squareness, LeansByItsAngles) {
  Effects effects;
  effects.get<Squareness>() = {50 * kUrad, -30 * kUrad, 20 * kUrad};
  Bent machine(trunnion(), effects);
  expect_near(machine.error({0.3, 0.2, 0.1, 0, 0}), Vec3(50 * 0.2 - 30 * 0.1, 20 * 0.1, 0) * kUrad,
              kRounding);
}

// ISO 230-4: dR = R/2 S sin 2 phi.
TEST(Squareness, MakesAnEllipseAt45Degrees) {
  Effects effects;
  effects.get<Squareness>().xy = 50 * kUrad;
  Bent machine(trunnion(), effects);
  const double R = 0.1;
  const auto radial = [&](double phi) {
    const Vec3 out(std::cos(phi), std::sin(phi), 0);
    return machine.error({R * out.x(), R * out.y(), 0, 0, 0}).dot(out);
  };
  EXPECT_NEAR(harmonic(2, radial)[1], R / 2 * 50 * kUrad, kRounding);
  for (const int n : {1, 3, 4})
    EXPECT_NEAR(std::hypot(harmonic(n, radial)[0], harmonic(n, radial)[1]), 0, kRounding);
}

// Under RTCP the ball is held at one point of the piece while C turns.
TEST(CAxisOffset, BallTracesACircle) {
  Effects effects;
  effects.get<CAxisOffset>() = {10 * kUm, -4 * kUm};
  for (const KinematicsParams& params : {trunnion(), head()}) {
    Bent machine(params, effects);
    for (const Vec3& ball : {Vec3(0.1, 0, 0), Vec3(0, -0.2, 0.3)})
      for (double c = -7; c < 7; c += 0.37) {
        const AxisVector q = machine.kinematics.inverse(ball, 0, c);
        const double C = std::cos(c), S = std::sin(c);
        expect_near(machine.error(q), Vec3((1 - C) * 10 - S * 4, -(1 - C) * 4 - S * 10, 0) * kUm,
                    kRounding);
      }
  }
}

TEST(AAxisOffset, BallMovesBySineAndVersine) {
  Effects effects;
  effects.get<AAxisOffset>() = {10 * kUm, -4 * kUm};
  for (const KinematicsParams& params : {trunnion(), head()}) {
    Bent machine(params, effects);
    for (double a = -2; a < 2; a += 0.13) {
      const AxisVector q = machine.kinematics.inverse(Vec3(0.1, -0.02, 0.05), a, 0);
      const double C = std::cos(a), S = std::sin(a);
      expect_near(machine.error(q), Vec3(0, (1 - C) * 10 - S * 4, -(1 - C) * 4 - S * 10) * kUm,
                  kRounding);
      const AxisVector turned = machine.kinematics.inverse(Vec3(0.1, -0.02, 0.05), a, 0.9);
      expect_near(machine.error(turned), rot_z(0.9) * machine.error(q), kRounding);
    }
  }
}

TEST(PivotLength, TipSwingsAboutAnotherPivot) {
  Effects effects, as_offset;
  effects.get<PivotLength>() = {20 * kUm};
  as_offset.get<AAxisOffset>().z = 20 * kUm;
  for (const KinematicsParams& params : {trunnion(), head()}) {
    Bent machine(params, effects), offset(params, as_offset);
    const auto error = [&](double a, double c) {
      return machine.error(machine.kinematics.inverse(Vec3(0.1, -0.02, 0.05), a, c));
    };
    expect_near(error(0, 0), Vec3(0, 0, -20 * kUm), kRounding);
    for (double a = -2; a < 2; a += 0.13) {
      expect_near(error(a, 0) - error(0, 0), 20 * kUm * Vec3(0, std::sin(a), 1 - std::cos(a)),
                  kRounding);
      expect_near(error(a, 0.7), -20 * kUm * tool_axis(a, 0.7), kRounding);
      // What its text says: a_axis_offset in z is the same but for a constant height.
      const AxisVector q = machine.kinematics.inverse(Vec3(0.1, -0.02, 0.05), a, 0.7);
      expect_near(offset.error(q), machine.error(q) + Vec3(0, 0, 20 * kUm), kRounding);
    }
  }
}

// e = (t - Rz t) x r, and exactly the rotation about the tilted line.
TEST(CAxisTilt, ZGrowsWithTheRadiusAndXyWithTheHeight) {
  const Vec3 t(30 * kUrad, -20 * kUrad, 0);
  Effects effects;
  effects.get<CAxisTilt>() = {t.x(), t.y()};
  const Vec3 line = Eigen::AngleAxisd(t.norm(), t.normalized()) * Vec3::UnitZ();
  const Vec3 ball(0.1, -0.2, 0.3);
  Bent machine(trunnion(), effects);
  for (double c = -7; c < 7; c += 0.37) {
    const AxisVector q = machine.kinematics.inverse(ball, 0, c);
    const Vec3 r = ball + kWorkOffset - trunnion().p_MC;
    // What second order leaves: at most 2 t^2 r, 1.5 nm of up to 20 um.
    expect_near(machine.error(q), (t - rot_z(c) * t).cross(r), 2 * t.squaredNorm() * r.norm());
    const Vec3 exact = Eigen::AngleAxisd(c, line) * (rot_z(-c) * r);
    expect_near(machine.error(q), exact - r, 2 * kRounding);
  }
  // A head: the tool's arm r from the C axis' point to the tip turns about the tilted line.
  Bent swivel(head(), effects);
  for (double c = -7; c < 7; c += 0.37) {
    const Vec3 arm = head().p_CA + head().p_AG - kTool * Vec3::UnitZ();
    const AxisVector q = swivel.kinematics.inverse(ball, 0, c);
    expect_near(swivel.error(q), Vec3(Eigen::AngleAxisd(c, line) * arm) - rot_z(c) * arm,
                2 * kRounding);
  }
}

TEST(AAxisTilt, TurnsAboutTheTiltedLine) {
  const Vec3 t(0, 30 * kUrad, -20 * kUrad);
  Effects effects;
  effects.get<AAxisTilt>() = {t.y(), t.z()};
  const Vec3 line = Eigen::AngleAxisd(t.norm(), t.normalized()) * Vec3::UnitX();
  const Vec3 ball(0.1, -0.2, 0.3);
  Bent machine(trunnion(), effects);
  for (double a = -2; a < 2; a += 0.13) {
    const AxisVector q = machine.kinematics.inverse(ball, a, 0.6);
    const Vec3 r =
        rot_z(-0.6) * (ball + kWorkOffset - trunnion().p_MC) + trunnion().p_MC - trunnion().p_MA;
    expect_near(machine.error(q), rot_z(0.6) * (t - rot_x(a) * t).cross(r),
                2 * t.squaredNorm() * r.norm());
    const Vec3 exact = Eigen::AngleAxisd(a, line) * (rot_x(-a) * r);
    expect_near(machine.error(q), rot_z(0.6) * (exact - r), 2 * kRounding);
  }
}

TEST(RotaryRunout, HarmonicsOfTheAngle) {
  const double psi = 0.4;
  for (const int k : {1, 2, 3, 8}) {
    Effects of_c, of_a;
    of_c.axis[kC].get<RotaryRunout>() = {3 * kUm, 5 * kUm, 2 * kUm, k, psi};
    of_a.axis[kA].get<RotaryRunout>() = {3 * kUm, 5 * kUm, 2 * kUm, k, psi};
    Bent table(trunnion(), of_c), spindle_head(head(), of_c);
    Bent cradle(trunnion(), of_a), fork(head(), of_a);
    for (double angle = -4; angle < 4; angle += 0.31) {
      const double c = std::cos(k * angle + psi), s = std::sin(k * angle + psi);
      const Vec3 r = Vec3(3 * c, 5 * s, 2 * c) * kUm, r_a = Vec3(2 * c, 3 * c, 5 * s) * kUm;
      const Vec3 ball(0.1, -0.2, 0.3);
      // The table runs away from the ball, the head takes it along.
      expect_near(table.error(table.kinematics.inverse(ball, 0, angle)), -(rot_z(angle) * r),
                  kRounding);
      expect_near(spindle_head.error(spindle_head.kinematics.inverse(ball, 0.5, angle)), r,
                  kRounding);
      expect_near(cradle.error(cradle.kinematics.inverse(ball, angle, 0.8)),
                  -(rot_z(0.8) * rot_x(angle) * r_a), kRounding);
      expect_near(fork.error(fork.kinematics.inverse(ball, angle, 0.8)), rot_z(0.8) * r_a,
                  kRounding);
    }
  }
  // What its text says: once per turn, backwards, is a piece off centre.
  Effects effects;
  effects.axis[kC].get<RotaryRunout>() = {.first = 3 * kUm, .second = -3 * kUm, .harmonic = 1};
  Bent table(trunnion(), effects);
  for (double c = -4; c < 4; c += 0.31)
    expect_near(table.error(table.kinematics.inverse(Vec3::Zero(), 0, c)), Vec3(-3 * kUm, 0, 0),
                kRounding);
}

// ------------------------------------------------------------- through the whole probe node

// Y accelerates along a wall that faces X: the tip moves across by k a.
TEST(CrossInertia, AccelerationAlongTheWallMovesTheTipAcross) {
  Machine machine;
  machine.effects.get<CrossInertia>() = {.x_per_y = 2e-6};
  const double a = 0.5, predeflection = 0.5e-3;
  const auto q = [&](double t) {
    // At rest, 0.1 s of a, 0.1 s of -a, at rest.
    const double u = std::clamp(t - 0.15, 0.0, 0.2), v = std::max(0.0, u - 0.1);
    return ball_at({3e-3 - predeflection, 0.5 * a * u * u - a * v * v, 0});
  };
  const auto readings = wall_readings(machine, Vec3::UnitX(), 500, q);
  const auto x = [&](int ms) { return readings[static_cast<std::size_t>(ms)].deflection[0]; };
  EXPECT_NEAR(x(140), predeflection, kReadingError);
  EXPECT_NEAR(x(200), predeflection - 2e-6 * a, kReadingError);  // away from the wall
  EXPECT_NEAR(x(300), predeflection + 2e-6 * a, kReadingError);
  EXPECT_NEAR(x(499), predeflection, kReadingError);
}

TEST(FrameVibration, ShowsAtStandstill) {
  Machine machine;
  machine.effects.get<FrameVibration>() = {
      .amplitude = Vec3(1, 0.5, -2) * kUm, .frequency = 37, .phase = 0.5};
  for (const int axis : {0, 1, 2}) {
    const Vec3 n = Vec3::Unit(axis);
    const auto readings =
        wall_readings(machine, n, 300, [&](double) { return ball_at(2.5e-3 * n); });
    for (std::size_t k = kApproach; k < readings.size(); ++k) {
      const double swing = std::sin(2 * kPi * 37 * 1e-3 * static_cast<double>(k) + 0.5);
      const double A = Vec3(1, 0.5, -2)[axis] * kUm;
      ASSERT_NEAR(readings[k].deflection[static_cast<std::size_t>(axis)], 0.5e-3 - A * swing,
                  kReadingError);
    }
  }
}

}  // namespace
}  // namespace vcnc::geometry_effects_test
