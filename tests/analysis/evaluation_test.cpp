#include "analysis/evaluation.hpp"

#include <gtest/gtest.h>

#include "synthetic.hpp"

namespace vcnc::evaluation_test {
namespace {

using synthetic::no_error;
using synthetic::SyntheticRun;

Summary evaluate(const SyntheticRun& run, const std::vector<TelemetryRow>& rows) {
  Evaluation evaluation(synthetic::begin(run.machine(), run.piece().params()));
  for (const TelemetryRow& row : rows) evaluation.row(row);
  return evaluation.finish(synthetic::end(std::ssize(rows)));
}
Summary evaluate(SyntheticRun& run) { return evaluate(run, run.rows()); }

TEST(Evaluation, PerfectLapOfTheSPieceHasNoErrorAndFullCoverage) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.1e-3, no_error);
  const Summary s = evaluate(run);
  const ErrorGroup& whole = s.groups.front();
  EXPECT_GT(whole.e_n.count, 10000);
  EXPECT_LT(whole.e_n.max_abs(), 1e-9);
  EXPECT_LT(whole.e_plan.max_abs(), 1e-9);
  EXPECT_LT(whole.e_servo.max_abs(), 1e-9);
  EXPECT_LT(whole.e_rest.max_abs(), 1e-9);
  EXPECT_EQ(s.coverage_percent, 100.0);
  EXPECT_EQ(s.verdict, Verdict::pass) << s.verdict_reason;
  EXPECT_TRUE(s.line_closed);
  EXPECT_NEAR(s.line_z, 20e-3, 1e-6);
  ASSERT_TRUE(s.interference);
  EXPECT_NEAR(*s.interference, 0.5e-3, 1e-6);
  EXPECT_TRUE(s.warnings.empty()) << s.warnings.front();
}

TEST(Evaluation, SPieceHasThreeCrossingsOnEachSide) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.2e-3, no_error);
  const Summary s = evaluate(run);
  ASSERT_EQ(s.crossings.size(), 6u);
  // The same ruling is met on both sides: u = 0.1160, 0.5098, 0.8898 (closed form of the piece).
  SurfacePoint foot;
  const auto path = run.piece().scan_path(3e-3, 0.5e-3, 20e-3, 0.2e-3);
  const std::array<double, 6> expected{0.1160, 0.5098, 0.8898, 0.8898, 0.5098, 0.1160};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto near =
        std::min_element(path.begin(), path.end(), [&](const Station& a, const Station& b) {
          return std::abs(a.s - s.crossings[i].s) < std::abs(b.s - s.crossings[i].s);
        });
    foot = run.piece().nearest(near->centre, SurfacePoint());
    EXPECT_NEAR(foot.u, expected[i], 2e-3) << s.crossings[i].name;
  }
  EXPECT_EQ(s.groups.size(), 1u + 4u + 6u);
}

TEST(Evaluation, ShiftOfTheTipAlongTheNormalIsEnWithItsSign) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.2e-3, [](const Station& st) { return Vec3(5e-6 * st.n); });
  const ErrorGroup whole = evaluate(run).groups.front();
  EXPECT_NEAR(whole.e_n.max, 5e-6, 1e-9);
  EXPECT_NEAR(whole.e_n.min, 5e-6, 1e-9);
  EXPECT_NEAR(whole.e_rest.mean(), 5e-6, 1e-9);
  EXPECT_LT(whole.e_plan.max_abs(), 1e-9);
  EXPECT_LT(whole.e_servo.max_abs(), 1e-9);
}

TEST(Evaluation, ToleranceOnARunOfSamplesFails) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.1e-3,
          [](const Station& st) { return Vec3((st.s > 0.2 && st.s < 0.201 ? 60e-6 : 0) * st.n); });
  const Summary s = evaluate(run);
  EXPECT_EQ(s.verdict, Verdict::fail);
  EXPECT_NEAR(s.groups.front().e_n.at_max, 0.2, 1.1e-3);
}

TEST(Evaluation, TheVerdictNamesTheWorstPlaceNotTheFirst) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.1e-3, [](const Station& st) {
    const double e = st.s > 0.1 && st.s < 0.102   ? 60e-6
                     : st.s > 0.2 && st.s < 0.202 ? (st.s > 0.201 ? -95e-6 : -80e-6)
                                                  : 0;
    return Vec3(e * st.n);
  });
  const Summary s = evaluate(run);
  EXPECT_EQ(s.verdict, Verdict::fail);
  EXPECT_NE(s.verdict_reason.find("e_n = -95.0 um at s = 20"), std::string::npos)
      << s.verdict_reason;
}

TEST(Evaluation, SingleSamplesOverToleranceNeitherPassNorFail) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.1e-3, [](const Station& st) {
    return Vec3((st.s > 0.2 && st.s < 0.20015 ? 60e-6 : 0) * st.n);
  });
  const Summary s = evaluate(run);
  EXPECT_EQ(s.coverage_percent, 100.0);
  EXPECT_EQ(s.verdict, Verdict::incomplete);
}

// All axes lag by the same time: large tracking error, but the tip stays on the path.
TEST(Evaluation, CommonLagIsTrackingErrorNotContourError) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  const auto path = run.piece().scan_path(3e-3, 0.5e-3, 20e-3, 0.05e-3);
  std::vector<AxisVector> q;
  for (const Station& st : path) q.push_back(run.axes(st.centre, st.tool_axis));
  constexpr std::size_t kDelay = 20;  // 1 mm behind
  for (std::size_t k = kDelay; k < q.size(); ++k) run.add(q[k], q[k - kDelay], Vec3::Zero());
  const Summary s = evaluate(run);
  EXPECT_NEAR(s.lag.mean(), -1e-3, 0.05e-3);
  EXPECT_LT(s.groups.front().e_servo.max_abs(), 2e-9);
  EXPECT_LT(s.groups.front().e_n.max_abs(), 2e-9);
  EXPECT_GT(s.following[kX].max_abs(), 0.5e-3);
}

// One axis stands off its command: servo part, attributed to that axis.
TEST(Evaluation, OffsetOfOneAxisIsServoErrorAndIsAttributed) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  for (const Station& st : run.piece().scan_path(3e-3, 0.5e-3, 20e-3, 0.1e-3)) {
    const AxisVector q = run.axes(st.centre, st.tool_axis);
    AxisVector actual = q;
    actual[kY] += 4e-6;
    run.add(q, actual, Vec3::Zero());
  }
  const Summary s = evaluate(run);
  const ErrorGroup& whole = s.groups.front();
  EXPECT_NEAR(whole.e_servo.max, 4e-6, 0.1e-6);  // where n = +y
  EXPECT_NEAR(whole.e_servo.min, -4e-6, 0.1e-6);
  EXPECT_LT(whole.e_rest.max_abs(), 1e-9);
  EXPECT_NEAR(s.share[kY].max_abs(), 4e-6, 0.1e-6);
  EXPECT_EQ(s.share[kX].max_abs(), 0.0);
}

TEST(Evaluation, OtherInterferenceThanDeclaredIsTrackedAndWarned) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.1e-3, no_error, 3e-3, 0.4e-3);
  const Summary s = evaluate(run);
  EXPECT_EQ(s.coverage_percent, 100.0);
  EXPECT_NEAR(*s.interference, 0.4e-3, 1e-6);
  EXPECT_NEAR(s.groups.front().e_plan.mean(), 0.1e-3, 1e-9);
  ASSERT_EQ(s.warnings.size(), 1u);
  EXPECT_NE(s.warnings[0].find("0.400"), std::string::npos);
  EXPECT_NE(s.warnings[0].find("0.500"), std::string::npos);
}

TEST(Evaluation, LostContactAndBadSignalsShowInTheCoverage) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.1e-3, [](const Station& st) {
    return Vec3((st.s > 0.1 && st.s < 0.105 ? 1e-3 : 0) * st.n);  // lifted off
  });
  std::vector<TelemetryRow> rows = run.rows();
  for (std::size_t k = 3000; k < 3050; ++k) rows[k].probe_flags = ProbeSample::kSlip;
  for (std::size_t k = 5000; k < 5030; ++k) rows[k].probe_flags = ProbeSample::kOutOfRange;
  const Summary s = evaluate(run, rows);
  EXPECT_NEAR(static_cast<double>(s.count(Coverage::Bin::no_contact)), 5, 1.1);
  EXPECT_NEAR(static_cast<double>(s.count(Coverage::Bin::invalid)), 5, 1.1);
  EXPECT_NEAR(static_cast<double>(s.count(Coverage::Bin::out_of_range)), 3, 1.1);
  EXPECT_LT(s.groups.front().e_n.max_abs(), 1e-9);
  EXPECT_EQ(s.verdict, Verdict::incomplete);
}

TEST(Evaluation, MissingRowsAreCountedAndNotCovered) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("s_eq1"));
  run.lap(20e-3, 0.1e-3, no_error);
  std::vector<TelemetryRow> rows = run.rows();
  rows.erase(rows.begin() + 4000, rows.begin() + 4100);
  const Summary s = evaluate(run, rows);
  EXPECT_EQ(s.missing_rows, 100u);
  EXPECT_EQ(s.gaps(), 100u);
  EXPECT_NEAR(static_cast<double>(s.count(Coverage::Bin::not_visited)), 10, 1.1);
}

TEST(Evaluation, RunWithoutPieceStillEvaluatesTheAxes) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("ring"));
  for (int k = 0; k < 100; ++k) {
    AxisVector q{}, actual{};
    actual[kA] = 1e-5;
    run.add(q, actual, Vec3::Zero());
  }
  RunBegin begin = synthetic::begin(run.machine(), run.piece().params());
  begin.piece_toml.clear();
  Evaluation evaluation(begin);
  for (const TelemetryRow& row : run.rows()) evaluation.row(row);
  const Summary s = evaluation.finish(synthetic::end(100));
  EXPECT_EQ(s.following[kA].max, 1e-5);
  EXPECT_EQ(s.groups.front().e_n.count, 0);
  EXPECT_EQ(s.verdict, Verdict::incomplete);
}

// Half circles from and to the centre touch the lap tangentially, 45 deg before and after it: they
// come as near to the scan distance as one likes, but do not count.
TEST(Evaluation, TangentialEntryAndExitAreNoError) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("ring"));
  constexpr double kR = 100e-3, kStep = 0.05e-3;
  const auto move = [&](const Vec3& p) {
    const AxisVector q = run.axes(p, Vec3::UnitZ());
    run.add(q, q, Vec3::Zero());
  };
  const auto arc = [&](const Vec3& centre, double radius, double from, double to) {
    const int n = static_cast<int>((to - from) * radius / kStep);
    for (int i = 1; i <= n; ++i) {
      const double phi = from + (to - from) * i / n;
      move(centre + radius * Vec3(std::cos(phi), std::sin(phi), 0));
    }
  };
  const double in = -kPi / 4, out = 2 * kPi + kPi / 4;
  move(Vec3::Zero());
  arc(kR / 2 * Vec3(std::cos(in), std::sin(in), 0), kR / 2, in - kPi, in);
  arc(Vec3::Zero(), kR, in, out);
  arc(kR / 2 * Vec3(std::cos(out), std::sin(out), 0), kR / 2, out, out + kPi);
  const Summary s = evaluate(run);
  EXPECT_EQ(s.coverage_percent, 100.0);
  EXPECT_EQ(s.verdict, Verdict::pass) << s.verdict_reason;
  EXPECT_LT(s.groups.front().e_plan.max_abs(), 3.1e-6);
  EXPECT_LT(s.groups.front().e_plan.rms(), 0.1e-6);
  EXPECT_LT(s.groups.front().e_rest.max_abs(), 1e-9);
  ASSERT_EQ(s.circles.size(), 1u);
  EXPECT_LT(s.circles[0].result.G, 3.2e-6);
}

// A ring that is found 3 um too small in radius everywhere, both senses.
TEST(Evaluation, RingRadiusErrorIsFoundInBothSenses) {
  SyntheticRun run(synthetic::machine(), synthetic::piece_params("ring"));
  const auto path = run.piece().scan_path(3e-3, 0.5e-3, 0, 0.1e-3);
  const auto shrink = [](const Station& st) {
    return Vec3(3e-6 * st.n);
  };  // n points to the centre
  for (const Station& st : path) run.normal_offset(st, 0, shrink);
  for (auto st = path.rbegin(); st != path.rend(); ++st) run.normal_offset(*st, 0, shrink);
  const Summary s = evaluate(run);
  EXPECT_NEAR(s.groups.front().e_n.mean(), 3e-6, 1e-9);
  ASSERT_EQ(s.circles.size(), 2u);
  for (const CircularSummary& c : s.circles) {
    EXPECT_NEAR(c.result.mean, -3e-6, 1e-9);
    EXPECT_LT(c.result.G, 1e-9);
  }
  EXPECT_EQ(s.coverage_percent, 100.0);
}

}  // namespace
}  // namespace vcnc::evaluation_test
