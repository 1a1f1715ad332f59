#include "controller/retract.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "model/geometry/kinematics.hpp"

namespace vcnc::retract_test {
namespace {

TEST(Retract, TakesTheToolAlongItsDeflectionAndALittleFurther) {
  Machine machine;
  const AxisVector from{0.1, 0.05, 0.02, 0.3, 0.7};
  const Retract retract(machine, from, {-2e-3, 0, 1e-3});
  const AxisVector end = retract.position(retract.duration());
  const Vec3 way(end[kX] - from[kX], end[kY] - from[kY], end[kZ] - from[kZ]);
  EXPECT_NEAR(way.norm(), std::hypot(2e-3, 1e-3) + kRetractClearance, 1e-12);
  EXPECT_NEAR(way.normalized().dot(Vec3(-2, 0, 1).normalized()), 1, 1e-12);
  EXPECT_EQ(end[kA], from[kA]);
  double fastest = 0;
  for (double t = 0; t <= retract.duration(); t += 1e-3) {
    const double h = 1e-6;
    const AxisVector v = retract.velocity(t);
    if (t > h && t < retract.duration() - h) {
      EXPECT_NEAR(v[kX], (retract.position(t + h)[kX] - retract.position(t - h)[kX]) / (2 * h),
                  1e-8);
    }
    fastest = std::max(fastest, std::hypot(v[kX], v[kZ]));
  }
  EXPECT_NEAR(fastest, kRetractSpeed, 1e-4 * kRetractSpeed);
}

TEST(Retract, TurnsWithAHeadAndStaysWithinTheTravel) {
  Machine head;
  head.kinematics.type = KinematicsParams::Type::head;
  const AxisVector q{0, 0, 0, 0.4, 1.1};
  const Retract turned(head, q, {0, 0, 2e-3});  // along the tool
  const AxisVector end = turned.position(10);
  const Vec3 d = tool_axis(0.4, 1.1);
  EXPECT_NEAR(Vec3(end[kX], end[kY], end[kZ]).normalized().dot(d), 1, 1e-12);

  Machine narrow;
  narrow.axes[kX].limits.max = 1e-3;
  const Retract clipped(narrow, {}, {3e-3, 0, 0});
  EXPECT_NEAR(clipped.position(10)[kX], 1e-3, 1e-15);
  EXPECT_EQ(Retract(narrow, {}, Vec3::Zero()).duration(), 0);
}

}  // namespace
}  // namespace vcnc::retract_test
