#include "analysis/dynamic_error.hpp"

#include <gtest/gtest.h>

#include "synthetic.hpp"

namespace vcnc::dynamic_error_test {
namespace {

using synthetic::SyntheticRun;

/// A plane that faces +x, in front of a head machine; the closed forms below are then obvious.
PieceParams wall() {
  PieceParams p;
  p.name = "wall";
  p.kind = PieceParams::Kind::plane;
  p.centre = Vec3::Zero();
  p.direction = Vec3::UnitX();
  return p;
}

struct OnTheWall : testing::Test {
  SyntheticRun run{synthetic::machine(), wall()};
  DynamicError evaluator{run.machine(), &run.piece()};
  double scan_x = run.machine().probe.ball_radius - run.machine().setup.predeflection;

  /// Tip commanded at x (from the scan distance) and y, with the tool tilted by a about X.
  AxisVector at(double x, double y, double a = 0) {
    return run.kinematics().inverse(Vec3(scan_x + x, y, 10e-3), a, 0);
  }
};

TEST_F(OnTheWall, PerfectContactHasNoErrorAndSeedDifferenceIsThePredeflection) {
  const AxisVector q = at(0, 0, 0.3);
  const ErrorSample s = evaluator.evaluate(run.add(q, q, Vec3::Zero()));
  ASSERT_TRUE(s.near_piece);
  EXPECT_EQ(s.contact, Contact::ok);
  EXPECT_NEAR(s.e_n, 0, 1e-12);
  EXPECT_NEAR(s.e_plan, 0, 1e-12);
  EXPECT_NEAR((s.actual - s.theoretical - Vec3(0.5e-3, 0, 0)).norm(), 0, 1e-12);
}

TEST_F(OnTheWall, EachCauseGoesIntoItsOwnPart) {
  const AxisVector cmd = at(2e-6, 0), act = at(2e-6 + 3e-6, 0);
  const ErrorSample s = evaluator.evaluate(run.add(cmd, act, Vec3(4e-6, 7e-6, 0)));
  EXPECT_NEAR(s.e_plan, 2e-6, 1e-12);
  EXPECT_NEAR(s.e_servo, 3e-6, 1e-12);
  EXPECT_NEAR(s.e_rest, 4e-6, 1e-12);
  EXPECT_NEAR(s.e_n, 9e-6, 1e-12);
}

// Friction turns the deflection towards the travel; along the normal nothing changes.
TEST_F(OnTheWall, TangentialDeflectionIsNoError) {
  const AxisVector q = at(0, 0);
  TelemetryRow row = run.add(q, q, Vec3::Zero());
  row.deflection[1] += 0.1e-3;
  EXPECT_NEAR(evaluator.evaluate(row).e_n, 0, 1e-12);
}

TEST_F(OnTheWall, TrackingErrorSplitsIntoLagAndCross) {
  const AxisVector first = at(0, 0);
  evaluator.evaluate(run.add(first, first, Vec3::Zero()));
  // Travelling along +y, 30 um behind and 4 um into the wall.
  const ErrorSample s =
      evaluator.evaluate(run.add(at(0, 1e-4), at(-4e-6, 1e-4 - 30e-6), Vec3::Zero()));
  EXPECT_NEAR(s.travel, 1e-4, 1e-12);
  EXPECT_NEAR(s.lag, -30e-6, 1e-12);
  EXPECT_NEAR(s.cross, 4e-6, 1e-12);
  EXPECT_NEAR(s.e_servo, -4e-6, 1e-12);
}

// d p_WT / d C of the head at A = 0.3 rad: the tip sits pivot length L off the C axis by L sin A.
TEST_F(OnTheWall, ShareOfARotaryAxisIsLeverTimesAngle) {
  const AxisVector cmd = at(0, 0, 0.3);
  AxisVector act = cmd;
  act[kC] += 1e-5;
  const ErrorSample s = evaluator.evaluate(run.add(cmd, act, Vec3::Zero()));
  const double lever = s.share[kC] / 1e-5;
  EXPECT_NEAR(s.e_servo, s.share[kC], std::abs(lever) * 1e-9);
  EXPECT_GT(std::abs(lever), 0.05);
  EXPECT_EQ(s.share[kX], 0);
}

TEST_F(OnTheWall, FlagsAndStatesDecideWhetherASampleCounts) {
  const AxisVector q = at(0, 0);
  const TelemetryRow good = run.add(q, q, Vec3::Zero());
  const auto contact = [&](auto change) {
    TelemetryRow row = good;
    change(row);
    return evaluator.evaluate(row).contact;
  };
  EXPECT_EQ(contact([](TelemetryRow&) {}), Contact::ok);
  for (const auto flag : {ProbeSample::kSlip, ProbeSample::kSignalFault, ProbeSample::kOvertravel})
    EXPECT_EQ(contact([&](TelemetryRow& r) { r.probe_flags = flag | ProbeSample::kContact; }),
              Contact::invalid);
  EXPECT_EQ(contact([](TelemetryRow& r) { r.probe_flags = ProbeSample::kOutOfRange; }),
            Contact::out_of_range);
  EXPECT_EQ(contact([](TelemetryRow& r) { r.overtravel = 2; }), Contact::invalid);
  EXPECT_EQ(contact([](TelemetryRow& r) { r.state = static_cast<double>(NcState::alarm); }),
            Contact::invalid);
  EXPECT_EQ(contact([](TelemetryRow& r) { r.deflection = {9e-6, 0, 0}; }), Contact::no_contact);
  EXPECT_EQ(contact([](TelemetryRow& r) { r.deflection = {11e-6, 0, 0}; }), Contact::ok);
}

TEST_F(OnTheWall, FarFromThePieceNothingIsEvaluatedAndTheWayBackIsFound) {
  const auto near = [&](double x) {
    const AxisVector q = at(x, 0);
    return evaluator.evaluate(run.add(q, q, Vec3::Zero())).near_piece;
  };
  EXPECT_FALSE(near(0.3));
  for (double x = 0.3; x > 0.01; x -= 1e-3) EXPECT_FALSE(near(x)) << x;
  EXPECT_TRUE(near(4e-3));
  EXPECT_TRUE(near(0));
  EXPECT_FALSE(near(0.1));
  EXPECT_TRUE(near(0));
}

TEST_F(OnTheWall, TrunnionAndHeadAgree) {
  Machine trunnion = synthetic::machine();
  trunnion.kinematics.type = KinematicsParams::Type::trunnion;
  SyntheticRun other(trunnion, wall());
  DynamicError other_evaluator(trunnion, &other.piece());
  for (double a = -0.5; a < 0.5; a += 0.1) {
    const AxisVector h = run.kinematics().inverse(Vec3(scan_x, 0, 0), a, 2 * a);
    const AxisVector t = other.kinematics().inverse(Vec3(scan_x, 0, 0), a, 2 * a);
    const Vec3 off(6e-6, -2e-6, 1e-6);
    EXPECT_NEAR(evaluator.evaluate(run.add(h, h, off)).e_n,
                other_evaluator.evaluate(other.add(t, t, off)).e_n, 1e-12);
  }
}

}  // namespace
}  // namespace vcnc::dynamic_error_test
