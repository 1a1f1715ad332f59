#include "model/geometry/kinematics.hpp"

#include <gtest/gtest.h>

#include <random>

namespace vcnc::kinematics_test {
namespace {

constexpr double kMm = 1e-3;
constexpr double kA20 = 20 * kDegree, kC30 = 30 * kDegree;
const Vec3 kPoint = Vec3(10, 20, 30) * kMm;

using Type = KinematicsParams::Type;

// Controlled point in machine coordinates [mm]: the linear axes without the tool length.
Vec3 point_mm(const AxisVector& q, double tool_length) {
  return Vec3(q[kX], q[kY], q[kZ] - tool_length) / kMm;
}

void expect_near(const Vec3& actual, const Vec3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance) << "component " << i;
}

struct Golden {
  const char* name;
  KinematicsParams params;
  double tool_length;
  Vec3 p_MW_mm;
  Vec3 expected_mm;
};

std::vector<Golden> golden_vectors() {
  KinematicsParams head, offset_head, trunnion, offset_trunnion;
  head.type = offset_head.type = Type::head;
  head.p_AG = Vec3(0, 0, -50) * kMm;
  offset_head.p_CA = Vec3(0, 5, 0) * kMm;
  offset_head.p_AG = Vec3(0, -5, -50) * kMm;
  trunnion.p_MA = trunnion.p_MC = Vec3(0, 0, -50) * kMm;
  offset_trunnion.p_MA = Vec3(0, 0, -50) * kMm;
  offset_trunnion.p_MC = Vec3(0, 25, -80) * kMm;
  return {
      {"head, pivot 200 mm", head, 0.150, Vec3::Zero(), {44.202014, -39.239627, 17.938524}},
      {"head with offsets", offset_head, 0.150, Vec3::Zero(), {44.352783, -39.500765, 19.648625}},
      {"trunnion", trunnion, 0.150, Vec3::Zero(), {18.660254, 38.939102, 20.961548}},
      {"trunnion with offset", offset_trunnion, 0, Vec3::Zero(), {6.160254, 42.086475, 19.815997}}};
}

TEST(Kinematics, ToolAxisAtA20C30) {
  expect_near(tool_axis(kA20, kC30), {0.171010072, -0.296198133, 0.939692621}, 1e-9);
}

TEST(Kinematics, GoldenVectorsAtA20C30) {
  for (const Golden& g : golden_vectors()) {
    SCOPED_TRACE(g.name);
    const Kinematics machine(g.params, g.tool_length, g.p_MW_mm * kMm);
    const AxisVector q = machine.inverse(kPoint, kA20, kC30);
    expect_near(point_mm(q, g.tool_length), g.expected_mm, 1e-6);
    EXPECT_EQ(q[kA], kA20);
    EXPECT_EQ(q[kC], kC30);
    const ToolPose pose = machine.forward(q);
    expect_near(pose.p_WT, kPoint, 1e-15);
    expect_near(pose.R_WT.col(2), tool_axis(kA20, kC30), 1e-15);
  }
}

TEST(Kinematics, WorkOffsetIsAddedAtZero) {
  for (Golden g : golden_vectors()) {
    SCOPED_TRACE(g.name);
    const Kinematics machine(g.params, g.tool_length, Vec3(100, -200, 300) * kMm);
    const Vec3 p = point_mm(machine.inverse(kPoint, 0, 0), g.tool_length);
    expect_near(p, {110, -180, 330}, 1e-9);
  }
}

// The tool length of a trunnion only shifts Z; that of a head swings with the tool.
TEST(Kinematics, LongerToolOfATrunnionOnlyLiftsZ) {
  const KinematicsParams params = golden_vectors()[3].params;
  const AxisVector q0 = Kinematics(params, 0, Vec3::Zero()).inverse(kPoint, kA20, kC30);
  const AxisVector q1 = Kinematics(params, 0.1, Vec3::Zero()).inverse(kPoint, kA20, kC30);
  EXPECT_NEAR(q1[kX], q0[kX], 1e-15);
  EXPECT_NEAR(q1[kY], q0[kY], 1e-15);
  EXPECT_NEAR(q1[kZ], q0[kZ] + 0.1, 1e-15);
}

TEST(Kinematics, HeadJacobianGolden) {
  const Golden g = golden_vectors()[0];
  const Kinematics machine(g.params, g.tool_length, Vec3::Zero());
  const auto J = machine.jacobian(machine.inverse(kPoint, kA20, kC30));
  expect_near(J.col(kA) / kMm, {-93.969262, 162.759536, 68.404029}, 1e-6);
  expect_near(J.col(kC) / kMm, {-59.239627, -34.202014, 0}, 1e-6);
  EXPECT_EQ(Mat3(J.leftCols<3>()), Mat3::Identity());
}

KinematicsParams random_params(std::mt19937_64& engine) {
  const auto uniform = [&](double half) {
    return half * (2 * static_cast<double>(engine() >> 11) * 0x1p-53 - 1);
  };
  const auto point = [&] { return Vec3(uniform(0.3), uniform(0.3), uniform(0.3)); };
  KinematicsParams params;
  params.type = engine() % 2 == 0 ? Type::head : Type::trunnion;
  params.p_MA = point();
  params.p_MC = point();
  params.p_CA = point();
  params.p_AG = point();
  params.a_reversed = engine() % 2 == 0;
  params.c_reversed = engine() % 2 == 0;
  return params;
}

TEST(Kinematics, RoundTripAndJacobianOverRandomMachines) {
  std::mt19937_64 engine(20);
  const auto uniform = [&](double half) {
    return half * (2 * static_cast<double>(engine() >> 11) * 0x1p-53 - 1);
  };
  for (int i = 0; i < 5000; ++i) {
    const Kinematics machine(random_params(engine), 0.1 + uniform(0.1),
                             Vec3(uniform(0.2), uniform(0.2), uniform(0.2)));
    const Vec3 p(uniform(0.5), uniform(0.5), uniform(0.5));
    const double a = uniform(2), c = uniform(7);
    const AxisVector q = machine.inverse(p, a, c);
    const ToolPose pose = machine.forward(q);
    ASSERT_LT((pose.p_WT - p).norm(), 1e-14);
    const RotaryPair iso = machine.counted({a, c});
    ASSERT_LT((pose.R_WT - rot_z(iso.c) * rot_x(iso.a)).norm(), 1e-15);

    const auto J = machine.jacobian(q);
    for (std::size_t k = 0; k < kAxisCount; ++k) {
      const double h = 1e-6;
      AxisVector high = q, low = q;
      high[k] += h;
      low[k] -= h;
      const Vec3 slope = (machine.forward(high).p_WT - machine.forward(low).p_WT) / (2 * h);
      ASSERT_LT((J.col(static_cast<Eigen::Index>(k)) - slope).norm(), 1e-8) << kAxisNames[k];
    }
  }
}

TEST(Kinematics, ReversedCountingOnlyChangesTheSigns) {
  KinematicsParams iso = golden_vectors()[3].params, reversed = iso;
  reversed.a_reversed = reversed.c_reversed = true;
  const AxisVector q = Kinematics(iso, 0.1, kPoint).inverse(kPoint, kA20, kC30);
  const AxisVector r = Kinematics(reversed, 0.1, kPoint).inverse(kPoint, -kA20, -kC30);
  for (std::size_t k = kX; k <= kZ; ++k) EXPECT_EQ(q[k], r[k]);
}

TEST(RotaryFromAxis, GoldenAnglesOfTheS) {
  struct Row {
    Vec3 d;
    double a_deg, c_deg;
  };
  const Row rows[] = {{{0.047977, 0.170797, 0.984137}, 10.21879, 164.31001},
                      {{-0.117571, 0.030845, 0.992585}, 6.98157, 255.29953},
                      {{-0.053576, -0.082568, 0.995144}, 5.64859, 327.02157},
                      {{0.139206, -0.109977, 0.984137}, 10.21879, 51.69014}};
  for (const Row& row : rows) {
    // The vectors are rounded to 6 digits: that is worth up to 4e-4 deg of C at A = 6 deg.
    const RotaryPair r =
        rotary_from_axis(row.d.normalized(), {row.a_deg * kDegree, row.c_deg * kDegree});
    EXPECT_NEAR(r.a / kDegree, row.a_deg, 1e-4);
    EXPECT_NEAR(r.c / kDegree, row.c_deg, 6e-4);
  }
}

TEST(RotaryFromAxis, InvertsTheToolAxisNearAnyPrevious) {
  std::mt19937_64 engine(7);
  const auto uniform = [&](double half) {
    return half * (2 * static_cast<double>(engine() >> 11) * 0x1p-53 - 1);
  };
  for (int i = 0; i < 5000; ++i) {
    const double a = uniform(1.5), c = uniform(20);
    if (std::abs(std::sin(a)) < 0.2) continue;
    const RotaryPair r = rotary_from_axis(tool_axis(a, c), {a + uniform(0.05), c + uniform(0.05)});
    ASSERT_NEAR(r.a, a, 1e-12);
    ASSERT_NEAR(r.c, c, 1e-12);
  }
}

TEST(RotaryFromAxis, FollowsCThroughManyTurns) {
  RotaryPair r{0.15, 0};
  for (int i = 0; i <= 5000; ++i) {
    const double c = 0.005 * i;
    const RotaryPair next = rotary_from_axis(tool_axis(0.15, c), r);
    ASSERT_NEAR(next.a, 0.15, 1e-12);
    ASSERT_NEAR(next.c, c, 1e-12);
    r = next;
  }
}

TEST(RotaryFromAxis, GoesStraightThroughThePole) {
  RotaryPair r{0.01, 0.7};
  for (int i = 100; i >= -100; --i) {
    const double a = 1e-4 * i;
    const RotaryPair next = rotary_from_axis(tool_axis(a, 0.7), r);
    ASSERT_NEAR(next.a, a, 1e-11);
    ASSERT_NEAR(next.c, 0.7, 1e-9);
    r = next;
  }
}

TEST(RotaryFromAxis, KeepsCAtThePole) {
  const RotaryPair r = rotary_from_axis(Vec3::UnitZ(), {0.2, 12.5});
  EXPECT_EQ(r.a, 0);
  EXPECT_EQ(r.c, 12.5);
  const Vec3 d = tool_axis(5e-5, 1.0);
  const RotaryPair s = rotary_from_axis(d, {0, 2.3});
  EXPECT_EQ(s.c, 2.3);
  EXPECT_LT((tool_axis(s.a, s.c) - d).norm(), 1e-4);
}

}  // namespace
}  // namespace vcnc::kinematics_test
