#include "model/probe/contact.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/model/s_eq1.hpp"

namespace vcnc::contact_test {
namespace {

constexpr double kStep = 100e-6;

PieceParams wall(const Vec3& direction) {
  PieceParams p;
  p.kind = PieceParams::Kind::plane;
  p.direction = direction;
  return p;
}

PieceParams ring() {
  PieceParams p;
  p.kind = PieceParams::Kind::ring;
  p.radius = 102.5e-3;
  return p;
}

/// The ball with effects on it and its contact.
Chain<TouchPort> touch(const Effects& effects) { return machine_chain<TouchPort>(effects, 1); }

ToolPose at(const Vec3& p, const Mat3& R = Mat3::Identity()) { return {p, R}; }

TEST(UsableRange, FormulaAndTable) {
  // SP600 table [mm]; it is printed in steps of 0.2 mm.
  struct Row {
    double stylus_g;
    double z_plus, z_minus, y_plus, y_minus;
  };
  const Row rows[] = {
      {4.6, 1.8, 1.6, 1.2, 2.0}, {20, 2.0, 1.4, 1.0, 2.2}, {50, 2.2, 1.2, 0.8, 2.4}};
  for (const Row& row : rows) {
    ProbeParams probe;
    probe.spring_rate = 1323.9;  // 135 gf/mm
    probe.moving_mass = 0.055;
    probe.stylus_mass = row.stylus_g * 1e-3;

    probe.mounting = ProbeParams::Mounting::vertical;
    probe.range = 1.7e-3;
    UsableRange range = usable_range(probe);
    const double dz = row.stylus_g / 135;
    EXPECT_NEAR(range.positive.z() * 1e3, 1.7 + dz, 1e-4);
    EXPECT_NEAR(range.negative.z() * 1e3, 1.7 - dz, 1e-4);
    EXPECT_NEAR(range.positive.z() * 1e3, row.z_plus, 0.17);
    EXPECT_NEAR(range.negative.z() * 1e3, row.z_minus, 0.17);
    EXPECT_EQ(range.positive.x(), probe.range);
    EXPECT_EQ(range.negative.y(), probe.range);

    probe.mounting = ProbeParams::Mounting::horizontal;
    probe.range = 1.6e-3;
    range = usable_range(probe);
    const double dy = (55 + row.stylus_g) / 135;
    EXPECT_NEAR(range.positive.y() * 1e3, 1.6 - dy, 1e-4);
    EXPECT_NEAR(range.negative.y() * 1e3, 1.6 + dy, 1e-4);
    EXPECT_NEAR(range.positive.y() * 1e3, row.y_plus, 0.05);
    EXPECT_NEAR(range.negative.y() * 1e3, row.y_minus, 0.05);
    EXPECT_EQ(range.positive.z(), probe.range);
  }
}

TEST(UsableRange, ShareTakesTheWorstDirection) {
  const UsableRange range{Vec3(2, 1, 4), Vec3(2, 3, 4)};
  EXPECT_DOUBLE_EQ(range.share(Vec3(1, 0, 0)), 0.5);
  EXPECT_DOUBLE_EQ(range.share(Vec3(1, 0.8, -1)), 0.8);
  EXPECT_DOUBLE_EQ(range.share(Vec3(0, -1.5, 0)), 0.5);
  EXPECT_TRUE(range.contains(Vec3(2, 1, -4)));
  EXPECT_FALSE(range.contains(Vec3(0, 1.01, 0)));
}

TEST(ProbeContact, FreeProbeReadsZeroAtRestAndAtConstantSpeed) {
  ProbeContact contact({}, {}, nullptr);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(contact.step(at({0.1, 0.2, 0.3})), Vec3::Zero());
  Vec3 delta;
  for (int i = 1; i < 20000; ++i) delta = contact.step(at(Vec3(0.1 + 0.05 * kStep * i, 0.2, 0.3)));
  EXPECT_LT(delta.norm(), 1e-12);
  EXPECT_FALSE(contact.touching());
}

// Released from a deflection the ball swings with 22.7 Hz and a damping of 0.3.
TEST(ProbeContact, FreeSwing) {
  const ProbeParams probe;
  ProbeContact contact(probe, {}, nullptr);
  contact.step(at(Vec3::Zero()));
  std::vector<double> x{0};
  x.push_back(contact.step(at(Vec3(-1e-3, 0, 0))).x());  // the tool jumps
  for (int i = 0; i < 3000; ++i) x.push_back(contact.step(at(Vec3(-1e-3, 0, 0))).x());
  const double w0 = std::sqrt(probe.spring_rate / (probe.moving_mass + probe.stylus_mass));
  EXPECT_NEAR(w0 / (2 * kPi), 22.7, 0.05);
  std::vector<std::size_t> extrema;
  for (std::size_t i = 2; i + 1 < x.size(); ++i)
    if ((x[i] - x[i - 1]) * (x[i + 1] - x[i]) < 0) extrema.push_back(i);
  ASSERT_GT(extrema.size(), 4u);
  const double half_period = static_cast<double>(extrema[3] - extrema[1]) / 2 * kStep;
  EXPECT_NEAR(kPi / half_period, w0 * std::sqrt(1 - 0.09), 0.01 * w0);
  const double decrement = std::log(x[extrema[1]] / x[extrema[3]]);
  EXPECT_NEAR(decrement, 2 * kPi * 0.3 / std::sqrt(1 - 0.09), 0.03);
}

// The heart of it: without friction the deflection is the penetration along the normal.
TEST(ProbeContact, DeflectionIsThePenetrationOnAPlane) {
  const Vec3 n = Vec3(1, -2, 0.5).normalized(), t = n.unitOrthogonal();
  const auto piece = make_piece(wall(n));
  ProbeContact contact({}, {}, piece.get());
  const Mat3 R = rot_z(0.4) * rot_x(0.2);
  for (int i = 0; i < 20000; ++i) {
    // Moves at constant speed along the wall while the depth swings.
    const double depth = 0.5e-3 + 0.2e-3 * std::sin(2 * kPi * 3 * i * kStep);
    const Vec3 delta = contact.step(at((3e-3 - depth) * n + 0.03 * kStep * i * t, R));
    ASSERT_TRUE(contact.touching());
    ASSERT_NEAR((R * delta).dot(n), depth, 1e-12);
    if (i > 10000) {
      ASSERT_LT((R * delta - depth * n).norm(), 1e-9);
    }
  }
}

TEST(ProbeContact, DeflectionIsThePenetrationInARing) {
  const auto piece = make_piece(ring());
  const ProbeParams params;
  ProbeContact contact(params, {}, piece.get());
  const double damping = 2 * params.damping_ratio *
                         std::sqrt(params.spring_rate * (params.moving_mass + params.stylus_mass));
  const double radius = 0.1, w = 0.05 / radius;
  for (int i = 0; i < 40000; ++i) {
    const double phi = w * kStep * i;
    const Vec3 radial(std::cos(phi), std::sin(phi), 0);
    const Vec3 delta = contact.step(at(radius * radial));
    ASSERT_NEAR(contact.ball().norm(), 0.0995, 1e-12);  // rests on the surface
    if (i > 20000) {
      ASSERT_NEAR(delta.dot(contact.surface().n), 0.5e-3, 1e-9);
      // The ball is on the smaller circle and slower than the tool: the damper draws it ahead.
      const double ahead = damping * 0.05 * (0.5e-3 / radius) / params.spring_rate;
      ASSERT_NEAR(delta.dot(Vec3::UnitZ().cross(radial)), ahead, 0.05 * ahead);
    }
  }
}

TEST(ProbeContact, ScansTheWholeS) {
  const auto piece = make_piece(s_eq1());
  const double interference = 0.5e-3, speed = 2000e-3 / 60;
  const auto path = piece->scan_path(3e-3, interference, 20e-3, speed * kStep * 4);
  ProbeContact contact({}, {}, piece.get());
  int touching = 0;
  double worst = 0;
  std::size_t steps = 0;
  for (std::size_t i = 1; i < path.size(); ++i)
    for (int j = 0; j < 4; ++j) {
      const Vec3 p = path[i - 1].centre + (path[i].centre - path[i - 1].centre) * (j / 4.0);
      const double truth = 3e-3 - piece->nearest(p, {}).distance;
      const Vec3 delta = contact.step(at(p));
      touching += contact.touching();
      ++steps;
      if (steps > 5000) worst = std::max(worst, std::abs(delta.dot(contact.surface().n) - truth));
    }
  EXPECT_EQ(static_cast<std::size_t>(touching), steps);
  // On the ends (radius 4 mm) the mass lags behind the turning normal; elsewhere it is nanometres.
  EXPECT_LT(worst, 2e-6);
}

// Steady sliding: the ball drags behind by mu F_n / k, across the normal only.
TEST(ProbeContact, SurfaceFrictionDragsAlongTheSurface) {
  const auto piece = make_piece(wall(Vec3::UnitX()));
  Effects effects;
  effects.get<SurfaceFriction>().coefficient = 0.15;
  ProbeContact contact({}, touch(effects), piece.get());
  Vec3 delta;
  for (int i = 0; i < 20000; ++i) delta = contact.step(at({2.5e-3, 0.03 * kStep * i, 0}));
  EXPECT_NEAR(delta.x(), 0.5e-3, 1e-12);
  EXPECT_NEAR(delta.y(), -0.15 * 0.5e-3, 1e-9);
  EXPECT_NEAR(contact.force().x(), ProbeParams().spring_rate * 0.5e-3, 1e-6);
  EXPECT_NEAR(contact.force().y(), -0.15 * contact.force().x(), 1e-6);
}

TEST(ProbeContact, SticksUntilTheSpringBreaksItLoose) {
  const auto piece = make_piece(wall(Vec3::UnitX()));
  Effects effects;
  effects.get<SurfaceFriction>().coefficient = 0.5;
  ProbeContact contact({}, touch(effects), piece.get());
  for (int i = 0; i < 1000; ++i) contact.step(at({2.5e-3, 0, 0}));
  for (int i = 0; i < 2000; ++i) {  // 0.2 mm slowly: below mu * 0.5 mm
    contact.step(at({2.5e-3, 1e-7 * i, 0}));
    ASSERT_LT(std::abs(contact.ball().y()), 1e-9);
  }
}

TEST(ProbeContact, LiftsOffFliesAndTouchesAgain) {
  const auto piece = make_piece(wall(Vec3::UnitX()));
  const ProbeParams probe;
  ProbeContact contact(probe, {}, piece.get());
  for (int i = 0; i < 2000; ++i) contact.step(at({2.5e-3, 0, 0}));
  EXPECT_TRUE(contact.touching());
  double x = 2.5e-3, fastest = 0, before = 0;
  for (int i = 0; i < 2000; ++i) {
    x += 0.2 * kStep;  // leaves at 200 mm/s, faster than the spring can follow
    const double deflection = contact.step(at({x, 0, 0})).x();
    if (i > 0) fastest = std::max(fastest, std::abs(contact.ball().x() - before) / kStep);
    before = contact.ball().x();
    ASSERT_GE(contact.ball().x(), 3e-3 - 1e-12);
    if (i == 1999) {
      EXPECT_NEAR(deflection, 0, 1e-6);
    }
  }
  EXPECT_FALSE(contact.touching());
  // Back to the surface at 20 mm/s: contact where the ball meets it, without a rebound.
  int since = -1;
  for (int i = 0; x > 2.6e-3; ++i) {
    x -= 0.02 * kStep;
    const double deflection = contact.step(at({x, 0, 0})).x();
    if (contact.touching() && since < 0) {
      since = i;
      EXPECT_NEAR(x, 3e-3, 5e-6);
    }
    if (since >= 0) {
      ASSERT_TRUE(contact.touching());
      ASSERT_NEAR(deflection, 3e-3 - x, 1e-12);
    }
  }
  EXPECT_GE(since, 0);
}

// Snap-back after the loss of contact: energy bounds the speed by x w0.
TEST(ProbeContact, SnapBackIsBoundedByTheStoredEnergy) {
  const ProbeParams probe;
  ProbeContact contact(probe, {}, nullptr);
  contact.step(at(Vec3::Zero()));
  contact.step(at(Vec3(-0.5e-3, 0, 0)));
  double before = contact.ball().x(), fastest = 0;
  const double w0 = std::sqrt(probe.spring_rate / (probe.moving_mass + probe.stylus_mass));
  for (int i = 0; i < 2000; ++i) {
    contact.step(at(Vec3(-0.5e-3, 0, 0)));
    if (i > 1) fastest = std::max(fastest, std::abs(contact.ball().x() - before) / kStep);
    before = contact.ball().x();
  }
  EXPECT_LT(fastest, 0.13);
  EXPECT_GT(fastest, 0.3 * 0.5e-3 * w0);
}

TEST(ProbeContact, SuspensionReturnsToZeroWithinItsHysteresis) {
  const auto piece = make_piece(wall(Vec3::UnitX()));
  Effects effects;
  effects.get<ReturnToZero>().half_width = 2e-6;
  ProbeContact contact({}, touch(effects), piece.get());
  for (int i = 0; i < 2000; ++i) contact.step(at({2.5e-3, 0, 0}));
  EXPECT_NEAR(contact.step(at({2.5e-3, 0, 0})).x(), 0.5e-3,
              1e-12);  // the surface decides in contact
  double x = 2.5e-3;
  Vec3 delta;
  for (int i = 0; i < 20000; ++i) {
    x = std::min(x + 0.01 * kStep, 5e-3);
    delta = contact.step(at({x, 0, 0}));
  }
  EXPECT_LE(std::abs(delta.x()), 2e-6 * 1.001);
  EXPECT_GT(std::abs(delta.x()), 1e-9);  // it did not come back exactly
}

TEST(ProbeContact, StartsOnTheSurfaceWhenItsZeroIsInside) {
  const auto piece = make_piece(wall(Vec3::UnitX()));
  ProbeContact contact({}, {}, piece.get());
  EXPECT_NEAR(contact.step(at({2.2e-3, 1, 1})).x(), 0.8e-3, 1e-12);
}

}  // namespace
}  // namespace vcnc::contact_test
