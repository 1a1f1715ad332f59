#include "diagnosis/search/lap_shifts.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/search/contest.hpp"
#include "diagnosis/search/evidence.hpp"
#include "model/probe/noise.hpp"
#include "tests/diagnosis/toy_machine.hpp"

namespace vcnc {
namespace {

/// Two readings of a ring of which the ball goes round once a lap: n n^T s.
std::vector<SeriesOfChannels> ring(std::size_t samples, std::size_t lap) {
  std::vector<SeriesOfChannels> all(3, SeriesOfChannels(2));
  for (std::size_t k = 0; k < samples; ++k) {
    const double a = 2 * kPi * static_cast<double>(k) / static_cast<double>(lap);
    const double n[] = {std::cos(a), std::sin(a), 0};
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t c = 0; c < 2; ++c) all[j][c].push_back(n[c] * n[j]);
  }
  return all;
}

std::vector<Stretch> laps(std::size_t count, std::size_t lap) {
  std::vector<Stretch> all;
  for (std::size_t i = 0; i < count; ++i)
    all.push_back({i * lap, (i + 1) * lap, static_cast<int>(i / 2), static_cast<int>(i % 2), ""});
  return all;
}

TEST(LapShifts, AreFoundBesideShiftsThatGrow) {
  const std::vector<Stretch> of = laps(2, 200);
  const std::vector<SeriesOfChannels> per_shift = ring(400, 200);
  SeriesOfChannels readings(2, std::vector<double>(400));
  for (std::size_t c = 0; c < 2; ++c)
    for (std::size_t k = 0; k < 400; ++k) {
      const double t = static_cast<double>(k % 200) / 200 - 0.5;
      readings[c][k] = k < 200 ? 3e-6 * per_shift[0][c][k] - 1e-6 * per_shift[1][c][k]
                               : (2e-6 + 5e-6 * t) * per_shift[1][c][k];
    }
  readings[0][17] = kMissing;
  const std::vector<Eigen::Vector3d> shifts = lap_shifts(of, per_shift, readings);
  EXPECT_LT((shifts[0] - Eigen::Vector3d(3e-6, -1e-6, 0)).norm(), 1e-11);
  EXPECT_LT((shifts[1] - Eigen::Vector3d(0, 2e-6, 0)).norm(), 1e-11);
  take_out_shifts(of, per_shift, readings);
  for (const std::vector<double>& channel : readings)
    for (const double left : channel) EXPECT_NEAR(std::isfinite(left) ? left : 0, 0, 1e-11);
}

TEST(LapShifts, ScatterIsThatOfLapsOfOneCondition) {
  // Two conditions of two laps: 0 and 2, 10 and 14 apart from their means 1 and 12.
  const std::vector<Eigen::Vector3d> shifts{{0, 0, 0}, {2, 0, 0}, {10, 0, 0}, {14, 0, 0}};
  EXPECT_NEAR(scatter_of(laps(4, 10), shifts).x(), std::sqrt((1 + 1 + 4 + 4) / 2.0), 1e-12);
  EXPECT_NEAR(rms_of(shifts).x(), std::sqrt((4 + 100 + 196) / 4.0), 1e-12);
}

TEST(ShiftWhitening, IsTheInverseRootOfTheCovariance) {
  const std::vector<Stretch> of = laps(2, 6);
  std::vector<ShiftWhitening::Channels> u(3, ShiftWhitening::Channels(2));
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t c = 0; c < 2; ++c)
      for (std::size_t k = 0; k < 12; ++k)
        u[j][c].push_back(static_cast<float>(gaussian_noise(7, c + 2 * j, k)[0]));
  const ShiftWhitening whitening(of, u);
  for (const Stretch& lap : of) {
    Eigen::MatrixXd w(12, 12), covariance = Eigen::MatrixXd::Identity(12, 12);
    for (Eigen::Index i = 0; i < 12; ++i) {
      ShiftWhitening::Channels z(2, std::vector<float>(12, 0.0F));
      if (i >= 6) z[0].clear();  // an empty channel is zero
      z[static_cast<std::size_t>(i / 6)][lap.begin + static_cast<std::size_t>(i % 6)] = 1;
      whitening.apply(z);
      for (Eigen::Index k = 0; k < 12; ++k)
        w(k, i) = z[static_cast<std::size_t>(k / 6)][lap.begin + static_cast<std::size_t>(k % 6)];
    }
    for (std::size_t j = 0; j < 3; ++j) {
      Eigen::VectorXd column(12);
      for (Eigen::Index k = 0; k < 12; ++k)
        column[k] =
            u[j][static_cast<std::size_t>(k / 6)][lap.begin + static_cast<std::size_t>(k % 6)];
      covariance += column * column.transpose();
    }
    EXPECT_LT((w * covariance * w - Eigen::MatrixXd::Identity(12, 12)).norm(), 1e-4);
  }
}

TEST(Evidence, ShiftsAsBetweenLapsOfTheHealthyRunAreNoise) {
  Record shifted = toy::commands(1000, 4);
  toy::measure(shifted, Machine(), 13);
  const double apart[] = {1, -2, 0.5, -1, 2, 1.5, -0.5, -1.5, 1, -1, 0.5, -0.5};  // [um]
  for (MeasuredSignal& s : shifted.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 0; k < s.value.size(); ++k) s.value[k] += 1e-6 * apart[k / 1000];
  toy::ToyReplica replica(shifted);
  const Evidence trusting(shifted, replica, Machine());
  // Standard deviation about the means of the conditions, -0.375, 0.375 and 0.
  EXPECT_NEAR(trusting.lap_scatter().x(), 1.4e-6, 0.1e-6);
  const Evidence knowing(shifted, replica, Machine(), {1, trusting.lap_scatter()});
  const auto above = [](const Evidence& e) {
    return e.chi2(e.residual(e.predict(Machine())), Role::both) - e.count(Role::both);
  };
  EXPECT_GT(above(trusting), 500000);
  EXPECT_LT(std::abs(above(knowing)), 5 * std::sqrt(4 * knowing.count(Role::both)));
}

TEST(Contest, WhatDoesNotStandOutIsNotTold) {
  Record record = toy::commands(400, 4);
  toy::measure(record, Machine(), 1);
  toy::ToyReplica replica(record);
  const Evidence evidence(record, replica, Machine());
  const std::vector<Candidate> none;
  std::vector<TrialColumns> trials;
  const DiagnosisOptions options;
  const ContestRules rules{evidence, none, options, trials, {}, 0, {0, 0, 0}, {}};
  const double n = evidence.count(0, Role::held_out);
  // A gain of 1000 in the first channel: above what laps differ by, at it, and far below.
  EXPECT_TRUE(rules.stands_out({n + 1000, n, n}, {n, n, n}));
  EXPECT_FALSE(rules.stands_out({n, n, n}, {n - 1000, n, n}));
  EXPECT_FALSE(rules.stands_out({n, 3 * n, n}, {n - 1000, 3 * n, n}));
  EXPECT_TRUE(rules.stands_out({n, n, n}, {n - 100, n, n}));  // less than chance makes
}

}  // namespace
}  // namespace vcnc
