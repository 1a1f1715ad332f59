// The touch trigger: its hysteresis, and the place of the contact for a plane in closed form.
#include "controller/touch_trigger.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "configs/config.hpp"
#include "model/geometry/kinematics.hpp"

namespace vcnc::touch_trigger_test {
namespace {

Machine machine_of(const std::string& name) {
  return load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/" + name + ".toml");
}

TEST(TouchTrigger, HasAHysteresis) {
  ProbeParams probe;
  probe.min_deflection = 10e-6;
  TouchTrigger trigger(probe);
  const auto reads = [&](double um) {
    trigger.step({0.6 * um * 1e-6, 0, -0.8 * um * 1e-6});
    return trigger.tripped();
  };
  EXPECT_FALSE(reads(199));
  EXPECT_TRUE(reads(201));
  EXPECT_TRUE(reads(21));
  EXPECT_FALSE(reads(19));
  EXPECT_FALSE(reads(199)) << "only above 200 um again";
  probe.min_deflection = 1e-3;
  EXPECT_DOUBLE_EQ(TouchTrigger(probe).on(), 0.5 * probe.range);
  EXPECT_DOUBLE_EQ(TouchTrigger(probe).off(), 0.25 * probe.range);
}

/// The tool is at c + s u, the ball slides on the plane: delta = s (-u . n) n.
TEST(TouchTrigger, FindsThePlaceOnAPlaneWhateverTheAngle) {
  const Machine machine = machine_of("trunnion");
  const Vec3 u = Vec3(-0.8, 0.6, 0), contact(10e-3, 20e-3, 30e-3);
  const Vec3 across = u.cross(Vec3(1, 2, 3)).normalized();
  for (const double angle : {0.0, 10.0, 30.0, 60.0, 80.0}) {
    const Vec3 n = -std::cos(angle * kDegree) * u + std::sin(angle * kDegree) * across;
    for (const double s : {0.2e-3, 1e-3, -0.3e-3}) {
      const Vec3 tool = contact + s * u;
      const ProbeReading reading{s * -u.dot(n) * n, {tool[0], tool[1], tool[2], 0.1, 0.2}};
      const AxisVector q = touch_point(machine, reading, u);
      EXPECT_LE((Vec3(q[0], q[1], q[2]) - contact).norm(), 1e-15) << angle;
      EXPECT_EQ(q[kA], 0.1);
    }
  }
}

TEST(TouchTrigger, TheProbeFrameTurnsWithTheHead) {
  const Machine machine = machine_of("head");
  const Vec3 u = Vec3::UnitY(), contact(1e-3, 2e-3, 3e-3), tool = contact + 0.4e-3 * u;
  ProbeReading reading{{}, {tool[0], tool[1], tool[2], 40 * kDegree, 25 * kDegree}};
  const Mat3 R_WT = Kinematics(machine.kinematics, machine.probe.length, Vec3::Zero())
                        .forward(reading.position)
                        .R_WT;
  reading.deflection = R_WT.transpose() * (-0.4e-3 * u);
  const AxisVector q = touch_point(machine, reading, u);
  EXPECT_LE((Vec3(q[0], q[1], q[2]) - contact).norm(), 1e-15);
}

TEST(TouchTrigger, AWayThatCannotBeFollowedBackIsNot) {
  const Machine machine = machine_of("trunnion");
  const ProbeReading reading{Vec3(0, 0.3e-3, 0), {1, 2, 3, 4, 5}};
  EXPECT_EQ(touch_point(machine, reading, Vec3::UnitX()), reading.position);
  EXPECT_EQ(touch_point(machine, reading, Vec3::Zero()), reading.position);
}

}  // namespace
}  // namespace vcnc::touch_trigger_test
