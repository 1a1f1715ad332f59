// Where the piece really is, through Kinematics::forward and the probe node.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/effects/probe_bench.hpp"

namespace vcnc::setup_effects_test {
namespace {

constexpr double kUm = 1e-6;

TEST(PieceOffset, IsConstantInThePiecesFrame) {
  Effects effects;
  effects.get<PieceOffset>().shift = Vec3(20, -10, 5) * kUm;
  Chain<PosePort> chain = machine_chain<PosePort>(effects, 1);
  GeometryErrors<double> errors;
  chain.step(errors, {});
  for (const auto type : {KinematicsParams::Type::trunnion, KinematicsParams::Type::head}) {
    KinematicsParams params;
    params.type = type;
    const Kinematics kinematics(params, 0.15, Vec3(0.1, 0, 0));
    for (double angle = -3; angle < 3; angle += 0.5) {
      const Vec3 ball(0.1, -0.2, 0.05);
      const AxisVector q = kinematics.inverse(ball, angle / 2, angle);
      EXPECT_LT((kinematics.forward(q, errors).p_WT - (ball - Vec3(20, -10, 5) * kUm)).norm(),
                1e-15);
    }
  }
}

// In a ring gauge that is off centre: the ball's deflection, closed form.
TEST(PieceOffset, MakesTheRingEccentric) {
  PieceParams ring;
  ring.kind = PieceParams::Kind::ring;
  ring.radius = 102.5e-3;
  Machine machine;
  const Vec3 shift = Vec3(20, -10, 0) * kUm;
  machine.effects.get<PieceOffset>().shift = shift;
  const double R = 0.1, w = 2 * kPi / 4;  // one turn in 4 s
  const auto angle = [&](double t) {      // starts gently, so that no period is lost
    const double u = std::max(0.0, t - 0.15);
    return w * (u - 0.2 * (1 - std::exp(-u / 0.2)));
  };
  const auto readings = probe_readings(machine, ring, Vec3(-1e-3, 0, 0), 5500, [&](double t) {
    return ball_at({R * std::cos(angle(t)), R * std::sin(angle(t)), 0});
  });
  for (std::size_t k = 2500; k < readings.size(); ++k) {  // the start has died away
    const double phi = angle(1e-3 * static_cast<double>(k));
    const Vec3 tip = R * Vec3(std::cos(phi), std::sin(phi), 0) - shift;
    const Vec3 n = -tip.normalized();
    // The rest is the damper's drag on the ball, which slides on a smaller circle than the tool:
    // it acts across the normal, and the normal at the ball is turned by 2 urad against that at
    // the tip.
    ASSERT_NEAR(Vec3(readings[k].deflection.data()).dot(n), tip.norm() - 99.5e-3, 2e-9);
  }
}

TEST(PieceTilt, LeansAWallByItsAngle) {
  Machine machine;
  machine.effects.get<PieceTilt>().tilt = Vec3(0, 1e-3, 0);
  const auto readings = wall_readings(machine, Vec3::UnitX(), 1100, [&](double t) {
    return ball_at({2.5e-3, 0, 0.05 * std::min(t, 0.8)});
  });
  // The normal becomes Ry(tilt) e_x = (cos, 0, -sin); the deflection stands on the wall.
  const double z = 0.04, c = std::cos(1e-3), s = std::sin(1e-3);
  const double depth = 3e-3 - (2.5e-3 * c - z * s);
  const Vec3 last(readings.back().deflection.data());
  EXPECT_NEAR(last.dot(Vec3(c, 0, -s)), depth, kReadingError);
  EXPECT_NEAR(depth - 0.5e-3, z * 1e-3, 2e-9);  // slope times height
}

// The slope turns with the piece: after half a turn of C it is reversed.
TEST(PieceTilt, TurnsWithC) {
  Machine machine;
  machine.effects.get<PieceTilt>().tilt = Vec3(0, 1e-3, 0);
  const auto top = [&](double x, double c) {
    // The same place of the machine over the table, whatever C.
    const auto readings = wall_readings(machine, Vec3::UnitZ(), 300, [&](double) {
      AxisVector q = ball_at({x, 0, 2.5e-3});
      q[kC] = c;
      return q;
    });
    return readings.back().deflection[2];
  };
  // Normal Ry(tilt) e_z = (s, 0, c): higher where x is negative; the projection is cos.
  const double slope = (top(0.1, 0) - top(-0.1, 0)) / 0.2;
  const double reversed = (top(0.1, kPi) - top(-0.1, kPi)) / 0.2;
  EXPECT_NEAR(slope, -std::sin(1e-3) * std::cos(1e-3), 2e-9);
  EXPECT_NEAR(reversed, -slope, 2e-9);
}

}  // namespace
}  // namespace vcnc::setup_effects_test
