// The parts of the engine against closed forms: filters, solver, partition, thresholds, intervals.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/evidence/noise_audit.hpp"
#include "diagnosis/evidence/packed_column.hpp"
#include "diagnosis/fit/converge.hpp"
#include "diagnosis/fit/intervals.hpp"
#include "diagnosis/fit/least_squares.hpp"
#include "diagnosis/fit/settling.hpp"
#include "diagnosis/screening/trial_values.hpp"
#include "diagnosis/selection/contest.hpp"
#include "diagnosis/selection/machine_changes.hpp"
#include "diagnosis/selection/selection.hpp"
#include "toy_machine.hpp"

namespace vcnc::engine_parts_test {
namespace {

TEST(NoiseAudit, RecoversAnAutoregressiveProcess) {
  // r_k = 0.8 r_{k-1} - 0.3 r_{k-2} + e: its autocovariances by the Yule-Walker equations.
  const double a1 = 0.8, a2 = -0.3, s2 = 2.5;
  std::vector<double> c(13);
  const double rho1 = a1 / (1 - a2);
  c[0] = s2 / (1 - a1 * rho1 - a2 * (a1 * rho1 + a2));
  c[1] = rho1 * c[0];
  for (std::size_t j = 2; j < c.size(); ++j) c[j] = a1 * c[j - 1] + a2 * c[j - 2];
  const WhiteningFilter f = fit_autoregression(c);
  EXPECT_NEAR(f.a[0], a1, 1e-6);
  EXPECT_NEAR(f.a[1], a2, 1e-6);
  for (std::size_t j = 2; j < f.a.size(); ++j) {
    EXPECT_NEAR(f.a[j], 0, 1e-6);
  }
  EXPECT_NEAR(f.scale, std::sqrt(s2), 1e-6);
}

TEST(NoiseAudit, TellsFrequencyAndAmplitudeOfWhatDoesNotRepeat) {
  Record record = toy::commands(2048, 4);
  toy::measure(record, Machine(), 5);
  // 83.3 Hz does not fit into a lap of 2.048 s.
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 0; k < s.value.size(); ++k)
        s.value[k] += 60e-9 * std::sin(2 * kPi * 83.3 * 1e-3 * static_cast<double>(k));
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  ASSERT_FALSE(evidence.noise().lines.empty());
  const NoiseLine& line = evidence.noise().lines.front();
  EXPECT_EQ(line.channel.kind, SignalKind::deflection);
  EXPECT_NEAR(line.frequency, 83.3, 0.1);
  EXPECT_NEAR(line.amplitude, 60e-9, 15e-9);

  Record quiet = toy::commands(2048, 4);
  toy::measure(quiet, Machine(), 6);
  toy::ToyReplica of_quiet(quiet);
  EXPECT_TRUE(Evidence(quiet, of_quiet, Machine()).noise().lines.empty());
}

// Its spectrum falls by f^4; where it is low its chance stands high over what is a little above.
TEST(NoiseAudit, NoiseThatFallsSteeplyHasNoLines) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Record record = toy::commands(4096, 4);
    toy::measure(record, Machine(), 5);
    std::mt19937 generator(seed);
    std::normal_distribution<double> white;
    for (MeasuredSignal& s : record.signals) {
      if (s.kind != SignalKind::deflection) continue;
      double once = 0, twice = 0;
      for (double& v : s.value) {
        once = 0.98 * once + white(generator);
        twice = 0.98 * twice + once;
        v += 1e-9 * twice;
      }
    }
    toy::ToyReplica replica(record);
    const Evidence evidence(record, replica, Machine());
    EXPECT_TRUE(evidence.noise().lines.empty())
        << seed << ": " << evidence.noise().lines.front().frequency << " Hz";
  }
}

TEST(Selection, TwoWavesOfOneLengthTakeEachOtherBack) {
  // 169.8 N once in a turn and 168.8 N of a pole pitch that is hardly another, in antiphase; say
  // that a newton makes 15 of chi-square.
  const double one = 15 * 169.8 * 169.8, other = 15 * 168.8 * 168.8;
  EXPECT_TRUE(take_each_other_back(one, other, 1650));
  // A stronger friction and a smaller viscous one that takes half of it back.
  EXPECT_FALSE(take_each_other_back(4e4, 1e4, 1e4));
  // One that counts for nothing beside another does not take it back.
  EXPECT_FALSE(take_each_other_back(4e6, 100, 3.9e6));
}

TEST(FreeNumber, IsAtItsMostWithinAThousandthOfItsRange) {
  const FreeNumber lag{"axes.X.position_lag_us", 100, 0, 5000, true};
  EXPECT_TRUE(at_its_most(lag, 5000));
  EXPECT_TRUE(at_its_most(lag, 4996));
  EXPECT_FALSE(at_its_most(lag, 4990));
  EXPECT_FALSE(at_its_most(lag, 0));
  const FreeNumber without_end{"axes.X.load_kg", 1, 0, HUGE_VAL};
  EXPECT_FALSE(at_its_most(without_end, 1e9));
  const FreeNumber phase{"effects.X.cogging.phase_deg", 10, 0, 360};
  EXPECT_FALSE(at_its_most(phase, 360));
}

TEST(PackedColumn, OfALongRecordIsTheColumnToThirtyThousandthsOfWhatIsAround) {
  const std::size_t n = PackedColumn::kLong;
  Column::Channels channels(3);  // noise, nothing, and a spike beside what is small
  for (std::size_t k = 0; k < n; ++k) {
    channels[0].push_back(static_cast<float>(gaussian_noise(3, 0, k)[0]));
    channels[2].push_back(k < 512 ? 1e-12F * static_cast<float>(k % 7) : (k == 900 ? -3e6F : 0));
  }
  const Column column(channels);
  const Column back = PackedColumn(column).unpacked();
  ASSERT_EQ(back.size(), 3U);
  EXPECT_TRUE(back[1].empty());
  double off = 0, squares = 0, farthest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    off += std::pow(back[0][k] - column[0][k], 2);
    squares += std::pow(column[0][k], 2);
    farthest = std::max<double>(farthest, std::abs(back[2][k] - column[2][k]));
  }
  EXPECT_LT(off, 1e-8 * squares);
  EXPECT_GT(off, 0);
  EXPECT_LT(farthest, 1e-15);
  EXPECT_EQ(back[2][900], -3e6F);
  EXPECT_FALSE(PackedColumn(column).zero());
}

TEST(PackedColumn, OfAShortRecordIsTheColumnItself) {
  const Column column(Column::Channels{{1.0F, 1e-9F}, {}});
  EXPECT_TRUE(PackedColumn(column).unpacked().shares(column));
  EXPECT_FALSE(PackedColumn(column).zero());
  EXPECT_TRUE(PackedColumn(Column(Column::Channels(3))).zero());
  EXPECT_TRUE(PackedColumn(Column(Column::Channels(3))).known());
  EXPECT_FALSE(PackedColumn().known());
}

TEST(Evidence, CleanResidualIsChiSquareWithOnePerSample) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, Machine(), 1);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  const Column z = evidence.residual(evidence.predict(Machine()));
  for (const Role role : {Role::fitted, Role::held_out}) {
    const double n = evidence.count(role);
    // Standard deviation of chi-square and of the variance that was estimated from as many samples.
    EXPECT_NEAR(evidence.chi2(z, role), n, 5 * std::sqrt(4 * n));
  }
}

TEST(Partition, HoldsOutEveryOtherLapOfEveryCondition) {
  const Record record = toy::commands(1000, 4);
  const Partition p = partition(record);
  EXPECT_TRUE(p.repeated);
  EXPECT_EQ(p.conditions(), 3U);
  // The second lap of the first condition, the first of the second one, ...
  for (const RecordBlock& b : p.blocks)
    EXPECT_EQ(b.held_out, (p.stretches[b.stretch].repetition + b.condition) % 2 == 1);
}

TEST(Partition, OfOneLongMotionFitsAndHoldsOutInTurns) {
  Record record = toy::commands(24000, 1);
  record.stretches = {{0, 1000, 0, 0, "approach"}, {1000, 24000, 1, 0, "motion"}};
  const Partition p = partition(record);
  EXPECT_FALSE(p.repeated);
  EXPECT_TRUE(p.repetitions().empty());
  EXPECT_EQ(p.conditions(), 6U);
  std::size_t held_out = 0;
  for (const RecordBlock& b : p.blocks) held_out += b.held_out ? b.end - b.begin : 0;
  EXPECT_EQ(held_out, 12000U);
}

TEST(LeastSquares, GoesAlongABoundWithOneLinearisationPerStep) {
  // Linear in three numbers that pull at each other; the first one belongs outside of its bound.
  LeastSquaresProblem problem;
  problem.start = Eigen::Vector3d(0, 0, 0);
  problem.min = Eigen::Vector3d(-1, -10, -std::numeric_limits<double>::infinity());
  problem.max = Eigen::Vector3d(1, 10, std::numeric_limits<double>::infinity());
  Eigen::Matrix3d a;
  a << 1, 0.5, 0, 0.5, 1, 0.5, 0, 0.5, 1;
  const Eigen::Vector3d b(4, 1, 2);
  problem.cost_tolerance = 1e-12;
  int linearisations = 0;
  problem.evaluate = [&](const Eigen::VectorXd& x, bool with_derivatives) {
    linearisations += with_derivatives;
    const Eigen::Vector3d r = a * x - b;
    return Linearisation{r.squaredNorm(), a.transpose() * r, a.transpose() * a};
  };
  const LeastSquaresSolution s = solve(problem);
  const Eigen::Matrix<double, 3, 2> rest = a.rightCols<2>();
  const Eigen::Vector2d others =
      (rest.transpose() * rest).ldlt().solve(rest.transpose() * (b - a.col(0)));
  EXPECT_DOUBLE_EQ(s.x[0], 1);
  EXPECT_NEAR(s.x[1], others[0], 1e-4);
  EXPECT_NEAR(s.x[2], others[1], 1e-4);
  EXPECT_TRUE(s.converged);
  EXPECT_LE(linearisations, 10);
}

TEST(LeastSquares, GivesUpWhereTheSensitivitiesAreWrong) {
  LeastSquaresProblem problem;
  problem.start = Eigen::Vector2d(3, 4);
  problem.min = Eigen::Vector2d(-100, -100);
  problem.max = Eigen::Vector2d(100, 100);
  problem.evaluate = [&](const Eigen::VectorXd& x, bool) {
    const Eigen::Vector2d promised(1, 2);  // but it only gets worse
    return Linearisation{100 + (x - problem.start).norm(), promised, Eigen::Matrix2d::Identity()};
  };
  const LeastSquaresSolution s = solve(problem);
  EXPECT_EQ(s.x, problem.start);
  EXPECT_FALSE(s.converged);
  EXPECT_DOUBLE_EQ(s.cost, 100);
  EXPECT_LE(s.evaluations, 7);  // the start, again for its derivatives, and four steps
}

TEST(LeastSquares, SolvesRosenbrockWithinBounds) {
  LeastSquaresProblem problem;
  problem.start = Eigen::Vector2d(-1.2, 1);
  problem.min = Eigen::Vector2d(-5, -5);
  problem.max = Eigen::Vector2d(5, 5);
  problem.max_iterations = 100;
  problem.cost_tolerance = 1e-14;
  problem.evaluate = [](const Eigen::VectorXd& x, bool) {
    const Eigen::Vector2d r(10 * (x[1] - x[0] * x[0]), 1 - x[0]);
    Eigen::Matrix2d j;
    j << -20 * x[0], 10, -1, 0;
    return Linearisation{r.squaredNorm(), j.transpose() * r, j.transpose() * j};
  };
  LeastSquaresSolution s = solve(problem);
  EXPECT_NEAR(s.x[0], 1, 1e-5);
  EXPECT_NEAR(s.x[1], 1, 1e-5);
  // With x0 <= 0.5 the minimum is at the bound, on the parabola.
  problem.max[0] = 0.5;
  s = solve(problem);
  EXPECT_NEAR(s.x[0], 0.5, 1e-5);
  EXPECT_NEAR(s.x[1], 0.25, 1e-4);
  // From where it is hopeless no search begins; the start costs 24.2.
  problem.hopeless_cost = 25;
  EXPECT_NEAR(solve(problem).x[0], 0.5, 1e-5);
  problem.hopeless_cost = 24;
  s = solve(problem);
  EXPECT_EQ(s.x, problem.start);
  EXPECT_EQ(s.evaluations, 1);
}

TEST(RoleGrams, StepsLeaveWhatTheyLeaveOfTheColumnsThemselves) {
  // Two channels; z, a and b are random, the step goes along a and b.
  const Eigen::Index n = 50;
  RoleGrams a = RoleGrams::none(2, 2, 2), across = RoleGrams::none(2, 1, 2),
            b = RoleGrams::none(1, 1, 2);
  const Eigen::Vector2d step(0.7, -1.3);
  std::vector<double> left;
  for (std::size_t c = 0; c < 2; ++c) {
    Eigen::MatrixXd m(n, 3);  // z, a, b
    for (Eigen::Index k = 0; k < n; ++k)
      for (Eigen::Index j = 0; j < 3; ++j)
        m(k, j) = gaussian_noise(9, c, static_cast<std::size_t>(3 * k + j))[0];
    a.held_out_of[c] = a.fitted_of[c] = m.leftCols(2).transpose() * m.leftCols(2);
    across.held_out_of[c] = (m.transpose() * m).eval().block(0, 2, 2, 1);
    b.held_out_of[c](0, 0) = m.col(2).squaredNorm();
    a.held_out += a.held_out_of[c], across.held_out += across.held_out_of[c];
    b.held_out += b.held_out_of[c];
    left.push_back((m.col(0) - m.rightCols(2) * step).squaredNorm());
  }
  const RoleGrams all = bordered(a, across, b);
  EXPECT_NEAR(left_after(all.held_out, step), left[0] + left[1], 1e-9);
  const std::vector<double> of = left_after(all.held_out_of, step);
  EXPECT_NEAR(of[0], left[0], 1e-9);
  EXPECT_NEAR(of[1], left[1], 1e-9);
  const std::vector<double> weight{0.5, 2};
  EXPECT_NEAR((a.fitted_with(weight) - 0.5 * a.fitted_of[0] - 2 * a.fitted_of[1]).norm(), 0, 1e-9);
}

TEST(LinearStep, TakesNoDeclaredNumberFurtherThanItIsBelievedToBe) {
  // z = 100 c1 + 3 c2 with unit columns at right angles: the declared number would go to 50.
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(3, 3);
  g << 100 * 100 + 9, 100, 3, 100, 1, 0, 3, 0, 1;
  const Eigen::Vector2d precision(1, 0), offset(0, 0);
  const LinearStep s = linear_step(g, g, precision, offset);
  EXPECT_NEAR(s.step[0], kFarthestPull, 1e-6);
  EXPECT_NEAR(s.step[1], 3, 1e-6);
  EXPECT_NEAR(s.fitted, std::pow(100 - kFarthestPull, 2) + kFarthestPull * kFarthestPull, 1e-3);
  // Within its tolerances it goes where it always went.
  g(0, 0) = 16 + 9, g(0, 1) = g(1, 0) = 4;
  EXPECT_NEAR(linear_step(g, g, precision, offset).step[0], 2, 1e-6);
}

/// Within bounds the least of a quadratic is where no number would go on downhill that could.
TEST(LinearStep, IsTheBestWithinAllToleranceTogether) {
  std::uint64_t draw = 0;
  const auto normal = [&] { return gaussian_noise(17, 3, draw++)[0]; };
  int at_bounds = 0;
  for (int round = 0; round < 2000; ++round) {
    const Eigen::Index n = 2 + round % 7, samples = 3 * n;
    Eigen::MatrixXd all(samples, n + 1);
    for (Eigen::Index i = 0; i < all.size(); ++i) all.data()[i] = normal();
    // Columns that nearly cancel, as those of a mass and of a friction do.
    const double apart = std::pow(10, -(round % 5));
    for (Eigen::Index j = 2; j <= n; j += 2)
      all.col(j) = (j % 4 == 2 ? -1 : 1) * all.col(1) + apart * all.col(j);
    all.col(0) *= 30;
    Eigen::VectorXd precision(n), offset(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      precision[j] = j % 3 == 2 ? 0 : std::exp(normal());
      offset[j] = precision[j] > 0 ? normal() / std::sqrt(precision[j]) : normal();
    }
    const Eigen::MatrixXd g = all.transpose() * all;
    const LinearStep s = linear_step(g, g, precision, offset);
    const Eigen::VectorXd at = offset + s.step;
    const Eigen::VectorXd slope =
        g.block(1, 1, n, n) * s.step - g.block(1, 0, n, 1) + precision.cwiseProduct(at);
    for (Eigen::Index j = 0; j < n; ++j) {
      const double reach = kFarthestPull / std::sqrt(precision[j]), slack = 1e-9 * (1 + reach);
      const double flat = 1e-4 * (1 + std::abs(g(j + 1, 0)));
      const double farthest = precision[j] > 0 ? reach + slack : HUGE_VAL;
      ASSERT_LE(std::abs(at[j]), farthest) << round;
      const bool low =
          precision[j] > 0 && at[j]<-reach + slack, high = precision[j]> 0 && at[j] > reach - slack;
      at_bounds += low || high;
      EXPECT_LT(low ? -HUGE_VAL : slope[j], flat) << round << " " << j;
      EXPECT_GT(high ? HUGE_VAL : slope[j], -flat) << round << " " << j;
    }
    EXPECT_LE(s.fitted, g(0, 0) + offset.dot(precision.cwiseProduct(offset)) + 1e-6);
  }
  EXPECT_GT(at_bounds, 1000);
}

TEST(NoiseAudit, CountsWhatEncodersRoundOffThoughItRepeats) {
  Record record = toy::commands(2048, 4);
  std::vector<double> noise(record.samples()), rounding(record.samples());
  for (std::size_t k = 0; k < noise.size(); ++k) {
    noise[k] = 30e-9 * gaussian_noise(3, 0, k)[0];
    rounding[k] = 40e-9 * gaussian_noise(4, 0, k % 2048)[0];  // the same in every lap
  }
  const std::vector<ComparedChannel> channels{{SignalKind::position, 0}};
  const auto rms = [&](const std::vector<std::vector<double>>& also) {
    return audit_noise(record, partition(record), channels, {noise}, also).channels[0];
  };
  EXPECT_NEAR(rms({}).rms, 30e-9, 1e-9);
  EXPECT_NEAR(rms({rounding}).rms, 50e-9, 1e-9);
  EXPECT_NEAR(rms({rounding}).filter.scale, 50e-9, 2e-9);
}

/// Of every lap a fifth is missing, seldom the same.
TEST(NoiseAudit, WhatIsMissingInOneLapIsComparedInTheOthers) {
  Record record = toy::commands(2000, 4);
  std::vector<double> noise(record.samples());
  for (std::size_t k = 0; k < noise.size(); ++k)
    noise[k] = gaussian_noise(4, 0, k)[0] < -0.84 ? kMissing : 30e-9 * gaussian_noise(3, 0, k)[0];
  const ChannelNoise of =
      audit_noise(record, partition(record), {{SignalKind::position, 0}}, {noise}).channels[0];
  EXPECT_NEAR(of.rms, 30e-9, 1e-9);
  EXPECT_NEAR(of.filter.scale, 30e-9, 1.5e-9);
}

/// A force that turns over with the axis is no noise, though nothing was repeated.
TEST(NoiseAudit, OfOneMotionIsWhatItsPastDoesNotForetell) {
  Record record = toy::commands(24000, 1);
  record.stretches = {{0, 24000, 0, 0, "motion"}};
  std::vector<double> residual(record.samples());
  for (std::size_t k = 0; k < residual.size(); ++k)
    residual[k] = (k / 1500 % 2 == 0 ? 3e-6 : -3e-6) + 30e-9 * gaussian_noise(3, 0, k)[0];
  const std::vector<ComparedChannel> channels{{SignalKind::position, 0}};
  const NoiseAudit audit = audit_noise(record, partition(record), channels, {residual});
  EXPECT_FALSE(audit.from_repetitions);
  EXPECT_NEAR(audit.channels[0].rms, 30e-9, 2e-9);
}

/// What encoders round off is slow where an axis is: it counts for no more than that, white noise
/// for what it is.
TEST(NoiseAudit, OfOneMotionKnowsTheColourOfWhatEncodersRoundOff) {
  Record record = toy::commands(24000, 1);
  record.stretches = {{0, 24000, 0, 0, "motion"}};
  std::vector<double> noise(record.samples()), rounding(record.samples());
  for (std::size_t k = 0; k < noise.size(); ++k) {
    noise[k] = 30e-9 * gaussian_noise(3, 0, k)[0];
    rounding[k] = (k > 0 ? 0.98 * rounding[k - 1] : 0) + 20e-9 * gaussian_noise(4, 0, k)[0];
  }
  const std::vector<ComparedChannel> channels{{SignalKind::position, 0}};
  const ChannelNoise of =
      audit_noise(record, partition(record), channels, {noise}, {rounding}).channels[0];
  EXPECT_NEAR(of.rms, std::hypot(30e-9, 20e-9 / std::sqrt(1 - 0.98 * 0.98)), 15e-9);
  // Weight of a constant: that of white noise of the same size is 1 / rms.
  const double constant =
      std::abs(1 - std::accumulate(of.filter.a.begin(), of.filter.a.end(), 0.0)) / of.filter.scale;
  EXPECT_LT(std::pow(constant * of.rms, 2), 0.1);
}

/// Nobody knows what repeats of it, so all that its own past foretells counts as noise.
TEST(NoiseAudit, TakesWhatWasRunOnceForNoiseWhereItIsLouderThanTheLaps) {
  Record record = toy::commands(2048, 4);
  record.stretches.back().condition = 99;  // run once
  const Stretch once = record.stretches.back();
  std::vector<double> noise(record.samples()), drifting = noise, louder = noise;
  for (std::size_t k = 0; k < noise.size(); ++k) {
    const auto at = static_cast<double>(k);
    const bool alone = k >= once.begin && k < once.end;
    louder[k] = drifting[k] = noise[k] = 30e-9 * gaussian_noise(3, 0, k)[0];
    if (alone) drifting[k] += 300e-9 * std::sin(2 * kPi * at / 700);
    if (alone) louder[k] *= 3;
  }
  const std::vector<ComparedChannel> channels{{SignalKind::position, 0}};
  const auto audited = [&](const std::vector<double>& residual) {
    return audit_noise(record, partition(record), channels, {residual}).channels[0];
  };
  const ChannelNoise quiet = audited(noise), of_drift = audited(drifting), loud = audited(louder);
  EXPECT_NEAR(quiet.filter.scale, 30e-9, 2e-9);
  EXPECT_NEAR(quiet.once.scale, 30e-9, 2e-9);
  EXPECT_NEAR(loud.filter.scale, 30e-9, 2e-9);
  EXPECT_NEAR(loud.once.scale, 90e-9, 6e-9);
  // A constant that stays off by 300 nm counts for less than 3 % of what it would beside the laps.
  const auto of_constant = [](const WhiteningFilter& f) {
    return std::abs(1 - std::accumulate(f.a.begin(), f.a.end(), 0.0)) / f.scale;
  };
  EXPECT_LT(std::pow(of_constant(of_drift.once) / of_constant(of_drift.filter), 2), 0.03);
  for (const RecordBlock& block : partition(record).blocks)
    EXPECT_EQ(block.once, block.begin >= once.begin && block.end <= once.end);
}

/// Its encoder rounds by 5 nm; at one place of every lap that decides where it comes to rest.
class RoundingReplica : public toy::ToyReplica {
 public:
  using ToyReplica::ToyReplica;
  std::vector<std::vector<double>> rounding(const Machine& m) const override {
    const std::size_t samples = predict(m)[0].size();
    std::vector<std::vector<double>> all(3, std::vector<double>(samples, 0.0));
    for (std::size_t k = 0; k < samples; ++k)
      all[0][k] = k % 2048 >= 500 && k % 2048 < 530 ? 2e-6 : 5e-9 * gaussian_noise(9, 0, k)[0];
    return all;
  }
};

TEST(Intervals, OfAllAmplitudesMustHoldWhatIsDeclaredForAnEffectToBeUncertain) {
  const FreedNumber height{{"effects.X.pitch_periodic.amplitude_um", 2, 0, 1000}, 3.0, 0},
      period{{"effects.X.pitch_periodic.period_mm", 10, 0.001, 1e4}, 12.0, 0, 0, true};
  const AddedEffect wave{.candidate = 0, .numbers = {height, period}};
  const auto uncertain = [&](const AddedEffect& effect, double half_width) {
    return may_be_as_declared(effect, Machine(), {{height.number.key, {100, half_width}}});
  };
  EXPECT_TRUE(uncertain(wave, 3.1));
  EXPECT_FALSE(uncertain(wave, 2.9));  // however uncertain the period is
  EXPECT_FALSE(uncertain({.candidate = 0, .numbers = {period}}, 3.1));  // no amplitude at all
}

TEST(Evidence, LeavesOutWhatRoundingDecides) {
  Record record = toy::commands(2048, 4);
  toy::measure(record, Machine(), 5);
  toy::ToyReplica exact(record);
  RoundingReplica rounding(record);
  const Evidence all(record, exact, Machine()), some(record, rounding, Machine());
  const double laps = 12, each = 30 + 2 * 20;  // ms: before and after, too
  const double gone = all.count(0, Role::both) - some.count(0, Role::both);
  EXPECT_GE(gone, laps * each);
  EXPECT_LE(gone, laps * (each + kWhiteningOrder));
  EXPECT_EQ(all.count(1, Role::both), some.count(1, Role::both));
  // What is left of it counts as noise.
  EXPECT_NEAR(some.noise().channels[0].rms, std::hypot(all.noise().channels[0].rms, 5e-9), 1e-9);
}

/// Its forces change with any number a little as by chance, as those of an axis that is held by
/// friction here or there.
class RoughReplica : public toy::ToyReplica {
 public:
  using ToyReplica::ToyReplica;
  Prediction predict(const Machine& m) const override {
    Prediction all = ToyReplica::predict(m);
    std::vector<double> force(all[1].begin(), all[1].end());
    const auto seed = static_cast<std::uint64_t>(1e6 * number_of(m, "axes.X.load_kg"));
    for (std::size_t k = 0; k < force.size(); ++k) force[k] += 1.5 * gaussian_noise(seed, 0, k)[0];
    all[1] = std::move(force);
    return all;
  }
};

TEST(FittedMachine, GoesFartherWhereRoughSensitivitiesMakeStepsShort) {
  Record record = toy::commands(2048, 4);
  Machine truth;
  move_number(truth, "axes.X.load_kg", 515);  // three tolerances
  toy::measure(record, truth, 5);
  RoughReplica replica(record);
  Evidence evidence(record, replica, Machine());
  const FittedMachine m = fit_declared(evidence, Machine());
  EXPECT_NEAR(number_of(m.machine, "axes.X.load_kg"), 515, 1);
}

/// A force of +-10 N is rounded to zero in steps of 40 N, and told by any of its samples; one of
/// +-70 N is rounded to +-80 N.
TEST(StepsOfASignal, MakeWhatIsWithinHalfOfOneAndNoMore) {
  const Machine declared = toy::machine({{"effects.X.coulomb.level_N", 10}});
  Record record = toy::commands(1000, 4);
  const auto recorded = [&](const Machine& truth) {
    const Prediction exact = toy::ToyReplica(record).predict(truth);
    std::erase_if(record.signals, [](const auto& s) { return s.kind != SignalKind::command; });
    const std::vector<ComparedChannel> channels = toy::ToyReplica(record).channels();
    for (std::size_t c = 0; c < channels.size(); ++c)
      record.signals.push_back({channels[c].kind, channels[c].axis, "", exact[c], 0});
    MeasuredSignal& force = record.signals[record.signals.size() - 2];
    force.resolution = 40;
    for (double& v : force.value) v = 40 * std::round(v / 40);
    toy::ToyReplica replica(record);
    return Evidence(record, replica, declared).made_by_steps(replica.predict(declared));
  };
  const std::vector<double> alike = recorded(declared);
  EXPECT_EQ(alike[0], 0);
  EXPECT_GT(alike[1], 1000);
  EXPECT_EQ(alike[2], 0);
  EXPECT_EQ(recorded(toy::machine({{"effects.X.coulomb.level_N", 70}}))[1], 0);
}

/// Nine of two families gain most in a signal that does not count; one of them does little else.
TEST(Contest, FitsWhatCountsMostHoweverMuchOthersGain) {
  std::vector<Screened> screened;
  for (std::size_t i = 0; i < 9; ++i) screened.push_back({i, 90'000.0, i < 6 ? 900.0 : 5.0, {}});
  screened.push_back({9, 20'000, 19'000, {}});
  const auto trials_of = [](const std::vector<Screened>& list) {
    std::vector<std::size_t> trials;
    for (const Screened& s : list) trials.push_back(s.trial);
    return trials;
  };
  DiagnosisOptions options;
  options.refits = 3;
  options.per_family = 2;
  const std::vector<Screened> list = worth_a_refit(
      by_what_counts(screened), options,
      [](const Screened& s) { return s.trial % 2 == 0 ? Family::servo : Family::geometry; });
  // Of the others two come along as the first ones; more are less than a tenth of the best.
  EXPECT_EQ(trials_of(list), (std::vector<std::size_t>{9, 0, 1}));
}

TEST(CountedGain, LeavesOutWhatTheFormOfTheModelMayMake) {
  DiagnosisOptions options;
  options.share_of_found = 0.01;
  EXPECT_TRUE(doubt_of(options).empty());
  options.rounding_of_channel = {0, 400};
  EXPECT_EQ(doubt_of(options), (Doubt{0, 20}));
  options.rounding_of_channel.clear();
  // What was brought into the second channel counts for nobody who takes it out.
  EXPECT_EQ(doubt_of(options, {{2000, -100}}, {2500, 500}, {500, 600}), (Doubt{20, 100}));
  options.form_of_channel = {100, 0};
  options.taken_of_form = 0.5;
  EXPECT_EQ(doubt_of(options), (Doubt{50, 0}));
  EXPECT_EQ(doubt_of(options, {3, 4}), (Doubt{53, 4}));
  const Doubt doubt = doubt_of(options, {{2000, -100}}, {2500, 500}, {500, 600});
  EXPECT_EQ(doubt, (Doubt{70, 100}));
  EXPECT_EQ(doubt_of(options, {{2000, -100}}, {2500, 500}, {500, 600}, {3, 4}), (Doubt{73, 104}));
  // 300 of 500 come from the first channel; a loss takes nothing away, a small gain all of itself.
  EXPECT_DOUBLE_EQ(counted(500, {500, 600}, {200, 400}, doubt), 330);
  EXPECT_DOUBLE_EQ(counted(160, {500, 600}, {540, 400}, doubt), 60);
  EXPECT_DOUBLE_EQ(counted(110, {500, 600}, {490, 500}, doubt), 0);
}

TEST(CountedGain, DoubtsNothingThatIsGainedWhileNoFoundEffectActs) {
  const Doubt doubt{70, 100}, anywhere{50};
  const std::vector<double> before{500, 600}, after{200, 400};
  const auto of = [&](const std::vector<double>& at_rest) {
    return counted(500, before, after, doubt, anywhere, at_rest);
  };
  EXPECT_DOUBLE_EQ(of({0, 0}), counted(500, before, after, doubt));
  EXPECT_DOUBLE_EQ(of({295, 150}), 500 - 55 - 50);
  // What is lost while it acts is lost; more than all cannot be gained at rest.
  EXPECT_DOUBLE_EQ(of({400, 300}), 500 - 50);
}

TEST(CountedGain, DoubtsAnEffectLessThatWasSeenToBeRight) {
  DiagnosisOptions options;
  options.share_of_found = 0.01;
  // It leaves 1e-5 of what it explains where it explains most: four times that much is doubted.
  const std::vector<double> before{1e7 + 100, 1e6 + 500}, left{100, 500};
  const Doubt doubt = doubt_of(options, {{1e7, 1e6}}, before, left);
  EXPECT_NEAR(doubt[0], 400, 1e-6);
  EXPECT_NEAR(doubt[1], 40, 1e-6);
  // Which says nothing about another one, that explains most elsewhere.
  const Doubt both = doubt_of(options, {{1e7, 0}, {0, 1e6}}, before, left);
  EXPECT_NEAR(both[0], 400, 1e-6);
  EXPECT_NEAR(both[1], 2000, 1e-6);
}

/// Rules of a contest about a machine of which nothing is off.
struct QuietContest {
  Record record = measured_record();
  toy::ToyReplica replica{record};
  Evidence evidence{record, replica, Machine()};
  std::vector<Candidate> none;
  std::vector<TrialColumns> trials;
  DiagnosisOptions options;

  static Record measured_record() {
    Record record = toy::commands(400, 4);
    toy::measure(record, Machine(), 1);
    return record;
  }
  ContestRules rules(double floor, std::vector<double> floor_of) {
    return {evidence, none, options, trials, {}, floor, std::move(floor_of), {}};
  }
};

TEST(ActingSlices, AreThoseInWhichTheResidualChangesAndTheirNeighbours) {
  const QuietContest contest;
  const std::size_t n = contest.record.samples(), slice = 50;  // of a millisecond each
  std::vector<float> with(n, 1.0F), without = with;
  for (std::size_t k = 3 * slice + 7; k < 3 * slice + 9; ++k) without[k] = 30.0F;
  without[10 * slice] = 1.01F;  // next to nothing
  const Column a({with, with, {}}), b({without, with, {}});
  const ActingSlices acts = acting_slices(contest.record, a, b);
  ASSERT_EQ(acts.size(), 3u);
  for (std::size_t i = 0; i < n / slice; ++i) {
    EXPECT_EQ(static_cast<bool>(acts[0][i]), i >= 2 && i <= 4) << i;
    EXPECT_FALSE(acts[1][i] || acts[2][i]) << i;
  }
  // Of held-out samples, those of the other slices are left.
  double rest = 0;
  for (const RecordBlock& block : contest.evidence.partition().blocks)
    for (std::size_t k = block.begin; block.held_out && k < block.end; ++k)
      rest += k < 2 * slice || k >= 5 * slice;
  EXPECT_GT(rest, 0);
  EXPECT_EQ(chi2_at_rest(contest.evidence, a, {acts})[0], rest);
  EXPECT_EQ(chi2_at_rest(contest.evidence, a, {acts, {}})[0], 0);  // of one nobody knows when
}

TEST(Threshold, CountsWhatIsLeftInTheChannelsThatGain) {
  QuietContest contest;
  contest.options.least_gain = 25;
  contest.options.least_share = 0.02;
  const ContestRules rules = contest.rules(2000, {1000, 1000});
  // 100000 are left in the other channel, which gains nothing.
  EXPECT_DOUBLE_EQ(rules.threshold({101000, 3000}, {101000, 1500}), 0.02 * 2000);
  EXPECT_DOUBLE_EQ(rules.threshold({101000, 3000}, {91000, 1500}), 0.02 * 102000);
  EXPECT_DOUBLE_EQ(rules.threshold({101000, 1100}, {101000, 1000}), 25);
}

TEST(Threshold, WhatDoesNotStandOutOfTheLapsIsNotTold) {
  QuietContest contest;
  const ContestRules rules = contest.rules(0, {0, 0, 0});
  const double n = contest.evidence.count(0, Role::held_out);
  // A gain of 1000 in the first channel: above what laps differ by, at it, and far below.
  EXPECT_TRUE(rules.stands_out({n + 1000, n, n}, {n, n, n}));
  EXPECT_FALSE(rules.stands_out({n, n, n}, {n - 1000, n, n}));
  EXPECT_FALSE(rules.stands_out({n, 3 * n, n}, {n - 1000, 3 * n, n}));
  EXPECT_TRUE(rules.stands_out({n, n, n}, {n - 100, n, n}));  // less than chance makes
}

TEST(TrialValues, FrequenciesAreThoseTheReadingsRingWith) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, Machine(), 8);
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 0; k < s.value.size(); ++k) {
        const double t = 1e-3 * static_cast<double>(k % 500);  // begins anew twice a lap
        s.value[k] += 200e-9 * std::exp(-t / 0.1) * std::sin(2 * kPi * 47 * t);
      }
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  const Candidate mode{"structural_mode",
                       "X",
                       {{"effects.X.structural_mode.participation", 1, -100, 100},
                        {"effects.X.structural_mode.frequency_Hz", 35, 1, 500}},
                       {1},
                       Family::mechanics};
  const TrialValuesOf values(evidence, Machine(), evidence.residual(evidence.predict(Machine())),
                             0);
  const std::vector<double> tried = values(mode, 1);
  EXPECT_TRUE(
      std::any_of(tried.begin(), tried.end(), [](double f) { return std::abs(f - 47) < 1.5; }));
}

/// A wave of which the travel holds one: a pinion, an encoder off its centre.
TEST(TrialValues, WavelengthsAreAsLongAsTheTravel) {
  Record record = toy::commands(1000, 4);
  const std::vector<double>& x = record.find(SignalKind::command, 0)->value;
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  const double period_mm = 1.1e3 * (*high - *low);
  toy::measure(record,
               toy::machine({{"effects.X.pitch_periodic.amplitude_um", 5},
                             {"effects.X.pitch_periodic.period_mm", period_mm}}),
               3);
  toy::ToyReplica replica(record);
  const Evidence evidence(record, replica, Machine());
  const std::vector<Candidate> all = toy::candidates();
  const Candidate& pitch = *std::find_if(
      all.begin(), all.end(), [](const Candidate& c) { return c.effect == "pitch_periodic"; });
  const TrialValuesOf values(evidence, Machine(), evidence.residual(evidence.predict(Machine())),
                             0);
  const std::vector<double> tried = values(pitch, 1);
  EXPECT_TRUE(std::any_of(tried.begin(), tried.end(), [&](double p) {
    return std::abs(p / period_mm - 1) < 0.2;
  })) << ::testing::PrintToString(tried);
}

TEST(Evidence, APieceThatShiftsBetweenLapsIsNoNoise) {
  Record still = toy::commands(1000, 4), shifting = still;
  toy::measure(still, Machine(), 12);
  toy::measure(shifting, Machine(), 12);
  for (MeasuredSignal& s : shifting.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 0; k < s.value.size(); ++k)
        s.value[k] += 2e-6 * std::sin(static_cast<double>(k) / 3000);
  toy::ToyReplica of_still(still), of_shifting(shifting);
  const double quiet = Evidence(still, of_still, Machine()).noise().channels[2].rms,
               moved = Evidence(shifting, of_shifting, Machine()).noise().channels[2].rms;
  EXPECT_NEAR(moved, quiet, 0.15 * quiet);
}

TEST(Trials, ALimitIsTriedWholeAtEveryValue) {
  const Candidate clip{
      "range_clip", "probe", {{"effects.probe.range_clip.limit_mm", 0.4, 0, 50, true}}, {}};
  const std::vector<Trial> all = trials(Machine(), {clip}, [](const Candidate&, std::size_t) {
    return std::vector<double>{0.3, 0.49};
  });
  ASSERT_EQ(all.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const double value = i == 0 ? 0.3 : 0.49;
    ASSERT_EQ(all[i].directions.size(), 1U);
    const Machine tried = machine_of(Machine(), clip, all[i], all[i].directions[0]);
    EXPECT_DOUBLE_EQ(number_of(tried, "effects.probe.range_clip.limit_mm"), value);
    // However much of it the residual holds: half a limit is no smaller effect.
    EXPECT_DOUBLE_EQ(
        start_of(clip, all[i], Eigen::VectorXd::Constant(1, 0.02), Eigen::VectorXd::Ones(1))[0]
            .value,
        value);
  }
}

/// A ripple of a direct drive has waves per turn that no linear axis has.
TEST(Trials, WholeNumbersAreTriedAndStay) {
  const Candidate ripple{"torque_ripple",
                         "A",
                         {{"effects.A.torque_ripple.amplitude_Nm", 1, 0, 1e5, true},
                          {"effects.A.torque_ripple.order", 24, 1, 1000, false, true},
                          {"effects.A.torque_ripple.phase_deg", 0, -360, 360}},
                         {1, 2}};
  const std::vector<Trial> all = trials(Machine(), {ripple}, [](const Candidate&, std::size_t) {
    return std::vector<double>{12, 24};
  });
  ASSERT_EQ(all.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    Machine tried = machine_of(Machine(), ripple, all[i], all[i].directions[0]);
    EXPECT_EQ(tried.effects.axis[kA].get<TorqueRipple>().order, i == 0 ? 12 : 24);
    const std::vector<FreedNumber> start =
        start_of(ripple, all[i], Eigen::Vector2d(0, 2), Eigen::Vector2d(1, 1));
    ASSERT_EQ(start.size(), 2U);  // amplitude and phase
    EXPECT_NEAR(start[0].value, 2, 1e-12);
    EXPECT_NEAR(start[1].value, 90, 1e-12);
    Machine fresh;
    set_whole_numbers(fresh, ripple, all[i]);
    EXPECT_EQ(fresh.effects.axis[kA].get<TorqueRipple>().order, i == 0 ? 12 : 24);
  }
}

/// Of two amplitudes with one phase, the phase is that of the one which does most.
TEST(Trials, ThePhaseIsThatOfTheAmplitudeThatDoesMost) {
  const Candidate ripple{"torque_ripple",
                         "X",
                         {{"effects.X.torque_ripple.amplitude_N", 40, 0, 1e5, true},
                          {"effects.X.torque_ripple.share_percent", 2, 0, 50, true},
                          {"effects.X.torque_ripple.phase_deg", 0, -360, 360}},
                         {2}};
  const Trial trial = trials(
      Machine(), {ripple}, [](const Candidate&, std::size_t) { return std::vector<double>{}; })[0];
  ASSERT_EQ(trial.directions.size(), 4U);
  // Half a typical amplitude at 90 deg, a typical share at 0 deg that does next to nothing.
  const std::vector<FreedNumber> start =
      start_of(ripple, trial, Eigen::Vector4d(0, 0.5, 1, 0), Eigen::Vector4d(100, 100, 1, 1));
  EXPECT_NEAR(start[0].value, 20, 1e-9);
  EXPECT_NEAR(start[2].value, 90, 1e-9);
}

/// What a wave of the base machine becomes by another one of the same period is another amplitude
/// and another phase, and both are seen by sensitivities.
TEST(Trials, AWaveThatIsThereIsTurned) {
  const std::string key = "effects.X.torque_ripple.";
  const Candidate ripple{
      "torque_ripple",
      "X",
      {{key + "amplitude_N", 40, 0, 1e5, true}, {key + "phase_deg", 0, -360, 360}},
      {1}};
  const auto wave = [&](const Machine& m) {
    Eigen::VectorXd f(100);
    for (Eigen::Index i = 0; i < f.size(); ++i)
      f[i] = number_of(m, key + "amplitude_N") *
             std::sin(0.3 * static_cast<double>(i) + number_of(m, key + "phase_deg") * kDegree);
    return f;
  };
  const auto machine = [&](double amplitude, double phase) {
    return toy::machine({{key + "amplitude_N", amplitude}, {key + "phase_deg", phase}});
  };
  const Machine base = machine(7, -62);
  const Trial trial = trials(
      base, {ripple}, [](const Candidate&, std::size_t) { return std::vector<double>{}; })[0];
  ASSERT_EQ(trial.directions.size(), 2U);
  Eigen::MatrixXd columns(100, 2);
  for (Eigen::Index d = 0; d < 2; ++d)
    columns.col(d) =
        wave(machine_of(base, ripple, trial, trial.directions[static_cast<std::size_t>(d)])) -
        wave(base);
  EXPECT_NEAR(columns.col(1).norm(), columns.col(0).norm(), 0.1 * columns.col(0).norm());
  const Eigen::VectorXd off = wave(machine(9, 40)),  // besides, so that the sum is 10.2 at -2 deg
      size = columns.colPivHouseholderQr().solve(off);
  const std::vector<FreedNumber> start = start_of(ripple, trial, size, Eigen::Vector2d(1, 1));
  ASSERT_EQ(start.size(), 2U);
  EXPECT_NEAR(start[0].value, 10.18, 0.2);
  EXPECT_NEAR(start[1].value, -2.2, 1.5);
}

TEST(Trials, TheAngleOfAWeightIsAPhase) {
  EXPECT_TRUE(is_phase({"effects.A.weight_imbalance.angle_deg"}));
  EXPECT_FALSE(is_phase({"effects.probe.signal_phase.angle_deg.x"}));
}

/// What a lobed ball adds to its radius, by the direction of the surface normal.
Eigen::VectorXd lobes_over_a_turn(const Machine& machine) {
  Eigen::VectorXd radius(90);
  for (Eigen::Index i = 0; i < radius.size(); ++i) {
    const double theta = 2 * kPi * static_cast<double>(i) / static_cast<double>(radius.size());
    TouchPort::Signal<double> ball;
    TouchPort::Context<double> context;
    context.normal_T = Vec3(std::cos(theta), std::sin(theta), 0);
    machine.effects.get<TipLobing>().step(ball, context);
    radius[i] = ball.radius;
  }
  return radius;
}

/// The phase of lobes is the direction of one: a quarter of a period is no quarter of a turn.
TEST(Trials, LobesStartWhereTheyPointTo) {
  const Candidate lobing{"tip_lobing",
                         "probe",
                         {{"effects.probe.tip_lobing.amplitude_um", 1, -300, 300, true},
                          {"effects.probe.tip_lobing.lobes", 3, 2, 12, false, true},
                          {"effects.probe.tip_lobing.phase_deg", 0, -360, 360}},
                         {1, 2}};
  for (const Trial& trial : trials(Machine(), {lobing}, [](const Candidate&, std::size_t) {
         return std::vector<double>{2, 3, 4, 5};
       })) {
    Machine truth;
    set_whole_numbers(truth, lobing, trial);
    move_number(truth, "effects.probe.tip_lobing.amplitude_um", 1.6);
    move_number(truth, "effects.probe.tip_lobing.phase_deg", -70);
    const Eigen::VectorXd wanted = lobes_over_a_turn(truth);
    ASSERT_EQ(trial.directions.size(), 2U);
    Eigen::MatrixXd columns(wanted.size(), 2);
    for (Eigen::Index d = 0; d < 2; ++d)
      columns.col(d) = lobes_over_a_turn(
          machine_of(Machine(), lobing, trial, trial.directions[static_cast<std::size_t>(d)]));
    const Eigen::VectorXd size = columns.colPivHouseholderQr().solve(wanted);
    Machine started;
    set_whole_numbers(started, lobing, trial);
    for (const FreedNumber& n : start_of(lobing, trial, size, Eigen::Vector2d(1, 1)))
      move_number(started, n.number.key, n.value);
    EXPECT_LT((lobes_over_a_turn(started) - wanted).norm(), 1e-9 * wanted.norm());
  }
}

TEST(Intervals, KnowThatALawIsKnownToTwoPercentOnly) {
  Record record = toy::commands(400, 4);
  const Machine truth = toy::machine({{"effects.X.load_play.width_um", 5}});
  toy::measure(record, truth, 3);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  const Candidate play = toy::candidates()[4];
  FittedMachine m = fit_declared(evidence, Machine());
  m.added.push_back({.candidate = 4,
                     .numbers = {{.number = play.numbers[0], .value = 5}},
                     .gain = 0,
                     .class_with = {}});
  converge(evidence, m);
  const std::string& key = play.numbers[0].key;
  const double exact = intervals_of(evidence, m).at(key).half_width,
               inexact = intervals_of(evidence, m, true).at(key).half_width;
  EXPECT_LT(exact, 0.02);
  EXPECT_NEAR(inexact, 1.96 * 0.02 * 5, 0.05);
}

TEST(Intervals, WhatALawGetsWrongAboutOneAmplitudeShowsInTheOthers) {
  Record record = toy::commands(400, 4);
  Machine truth;
  toy::measure(record, truth, 3);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  FittedMachine m = fit_declared(evidence, Machine());
  // Numbers that the toy knows, told as if of one effect: 50 urad beside 1 urad.
  const FreedNumber large{.number = {"effects.geometry.squareness.xy_urad", 50, -5000, 5000},
                          .value = 50};
  FreedNumber small = large;
  small.number.key = "effects.geometry.squareness.xz_urad";
  small.value = 1;
  m.added.push_back({.candidate = 5, .numbers = {large, small}});
  m.columns = columns_of(evidence, m.machine, m.prediction, m.numbers());
  const auto intervals = intervals_of(evidence, m, true);
  EXPECT_GT(intervals.at(small.number.key).half_width, 1.9 * 0.02 * 50);
}

TEST(Intervals, AShapeThatDoesTheSameLeavesAnAmplitudeKnownWithIt) {
  Record record = toy::commands(400, 4);
  toy::measure(record, Machine(), 3);
  toy::ToyReplica replica(record);
  Evidence evidence(record, replica, Machine());
  FittedMachine m = fit_declared(evidence, Machine());
  const FreedNumber height{.number = {"effects.geometry.squareness.xy_urad", 50, -5000, 5000},
                           .value = 50};
  FreedNumber slowness = height;
  slowness.number.key = "effects.geometry.squareness.xz_urad";
  slowness.shape = true;
  const AddedEffect drift{.candidate = 5, .numbers = {height, slowness}};
  m.added.push_back(drift);
  const Column column = columns_of(evidence, m.machine, m.prediction, {height}).front();
  m.columns = {column, column};
  const auto intervals = intervals_of(evidence, m);
  const Interval of = intervals.at(height.number.key);
  EXPECT_GT(of.half_width, 50);
  EXPECT_LT(of.shapes_known, 1);
  EXPECT_FALSE(may_be_as_declared(drift, Machine(), intervals));
  FreedNumber& none = m.added.back().numbers.back();  // a time constant of nought: a straight line
  none.value = none.number.min = 0;
  EXPECT_NEAR(intervals_of(evidence, m).at(height.number.key).half_width, of.shapes_known, 1e-9);
  EXPECT_EQ(intervals_of(evidence, m).count(none.number.key), 0U);
  none = slowness;
  m.columns = {column, evidence.sensitivity(m.prediction, m.prediction, 1)};  // it does nothing
  EXPECT_NEAR(intervals_of(evidence, m).at(height.number.key).half_width, of.shapes_known, 1e-6);
}

/// Right where it was anchored; elsewhere only seven tenths of a change are seen.
class Askew : public Replica {
 public:
  explicit Askew(const Record& commands) : toy_(commands) {}
  const std::vector<ComparedChannel>& channels() const override { return toy_.channels(); }
  Prediction predict(const Machine& m) const override {
    Prediction there = toy_.predict(anchor_), here = toy_.predict(m), all;
    for (std::size_t c = 0; c < here.size(); ++c) {
      std::vector<double> seen = here[c];
      for (std::size_t k = 0; k < seen.size(); ++k) seen[k] -= 0.3 * (here[c][k] - there[c][k]);
      all.emplace_back(std::move(seen));
    }
    return all;
  }
  bool anchor(const Machine& m) override {
    anchor_ = m;
    return true;
  }

 private:
  toy::ToyReplica toy_;
  Machine anchor_;
};

TEST(FittedMachine, IsJudgedWhereTheReplicaIsExact) {
  Record record = toy::commands(400, 4);
  const Machine truth = toy::machine({{"axes.X.load_kg", 515}});
  toy::measure(record, truth, 3);
  const std::string key = "axes.X.load_kg";
  const auto fitted = [&](Replica& replica) {
    Evidence evidence(record, replica, Machine());
    const FittedMachine m = fit_declared(evidence, Machine());
    const Column exact = evidence.residual(toy::ToyReplica(record).predict(m.machine));
    EXPECT_NEAR(evidence.chi2(m.residual, Role::held_out), evidence.chi2(exact, Role::held_out),
                1e-6);
    return number_of(m.machine, key);
  };
  toy::ToyReplica straight(record);
  Askew askew(record);
  EXPECT_NEAR(fitted(askew), fitted(straight), 0.02);
}

TEST(Intervals, CoverTheTruthAsOftenAsTheySay) {
  const std::vector<Candidate> all = toy::candidates();
  int inside = 0, numbers = 0;
  for (std::uint64_t seed = 1000; seed < 1050; ++seed) {
    Record record = toy::commands(400, 4);
    const Machine truth =
        toy::machine({{"effects.X.scale_error.error_ppm", 20},
                      {"effects.X.load_play.width_um", 1},
                      {"axes.X.load_kg", 500 * (1 + 0.01 * gaussian_noise(seed, 77, 0)[0])}});
    toy::measure(record, truth, seed);
    toy::ToyReplica replica(record);
    Evidence evidence(record, replica, Machine());
    FittedMachine m = fit_declared(evidence, Machine());
    for (const std::size_t c : {3U, 4U}) {
      FreedNumber n{.number = all[c].numbers[0], .value = 5};
      m.added.push_back({.candidate = c, .numbers = {n}});
    }
    converge(evidence, m);
    const auto intervals = intervals_of(evidence, m);
    for (const FreedNumber& n : m.numbers()) {
      const double error = n.value - number_of(truth, n.number.key);
      inside += std::abs(error) <= intervals.at(n.number.key).half_width;
      ++numbers;
    }
  }
  // Binomial, 100 trials of 95 %: within about three standard deviations, the safe side above.
  EXPECT_GE(inside, 0.88 * numbers);
  EXPECT_LE(inside, 0.999 * numbers);
}

TEST(Intervals, KnowThatLapsAreNotAlike) {
  int inside = 0, numbers = 0;
  double widths = 0;
  for (std::uint64_t seed = 2000; seed < 2040; ++seed) {
    Record record = toy::commands(400, 4);
    toy::measure(record, Machine(), seed);
    const std::vector<double> x = record.find(SignalKind::command, 0)->value;
    for (std::size_t lap = 0; lap < record.stretches.size(); ++lap)
      for (std::size_t k = record.stretches[lap].begin; k < record.stretches[lap].end; ++k)
        record.signals.back().value[k] += 0.5e-6 * gaussian_noise(seed, 88, lap)[0] * x[k];
    toy::ToyReplica replica(record);
    Evidence evidence(record, replica, Machine());
    FittedMachine m = fit_declared(evidence, Machine());
    m.added.push_back({.candidate = 3, .numbers = {{.number = toy::candidates()[3].numbers[0]}}});
    m.nuisances = without(m.nuisances, m.numbers());
    converge(evidence, m);
    const FreedNumber scale = m.numbers()[0];
    const double half = intervals_of(evidence, m).at(scale.number.key).half_width;
    inside += std::abs(scale.value) <= half;
    widths += half;
    ++numbers;
  }
  EXPECT_GE(inside, 0.85 * numbers);
  // Six fitted laps of 0.5 ppm each, 2.2 standard deviations; white noise alone would make 0.2.
  EXPECT_NEAR(widths / numbers, 2.2 * 0.5 / std::sqrt(6), 0.15);
}

const FreedNumber* number_among(const std::vector<FreedNumber>& all, const std::string& key) {
  for (const FreedNumber& n : all)
    if (n.number.key == key) return &n;
  return nullptr;
}

TEST(Nuisances, AreAsUncertainAsTheMachineSays) {
  Machine machine;
  machine.axes[kX].servo.kv_per_s = 40;
  machine.uncertainties = {{"axes.X.load_kg", 0, {}},
                           {"axes.X.kv_per_s", 0, {20, 60}},
                           {"axes.Y.load_kg", 12, {300, 900}},
                           {"effects.X.backlash.gap_um", 0, {0, 30}}};
  const std::vector<FreedNumber> all = nuisances(machine);
  EXPECT_EQ(number_among(all, "axes.X.load_kg"), nullptr);  // known exactly
  const FreedNumber *kv = number_among(all, "axes.X.kv_per_s"),
                    *mass = number_among(all, "axes.Y.load_kg"),
                    *gap = number_among(all, "effects.X.backlash.gap_um");
  ASSERT_TRUE(kv && mass && gap);
  EXPECT_EQ(kv->precision(), 0);
  EXPECT_EQ(kv->number.min, 20);
  EXPECT_EQ(kv->number.max, 60);
  EXPECT_NEAR(kv->number.typical, 2, 1e-12);  // the least of a tenth of 40 and a twentieth of 40
  EXPECT_EQ(mass->tolerance, 12);
  EXPECT_EQ(mass->number.max, 900);
  EXPECT_DOUBLE_EQ(gap->number.typical, 1.5);
  // Of a change between two runs that says nothing.
  const std::vector<FreedNumber> change = nuisances(machine, Against::healthy_run);
  EXPECT_NE(number_among(change, "axes.X.load_kg"), nullptr);
  EXPECT_EQ(number_among(change, "axes.X.kv_per_s"), nullptr);
}

TEST(Nuisances, ARotorIsTheSameInBothRuns) {
  const std::string rotor = "axes.X.motor_inertia_kgm2", load = "axes.X.load_kg";
  EXPECT_NE(number_among(nuisances({}), rotor), nullptr);
  EXPECT_EQ(number_among(nuisances({}, Against::healthy_run), rotor), nullptr);
  EXPECT_NE(number_among(nuisances({}, Against::healthy_run), load), nullptr);
}

TEST(FreedNumber, WhatWasFittedHoldsInAMachineThatSaysNothingElse) {
  Machine declared;
  declared.axes[kX].servo.position_lag = 250e-6;
  Machine fitted = declared, other = declared;
  fitted.axes[kX].servo.position_lag = 80e-6;
  fitted.axes[kY].servo.feedforward_lag = 460e-6;
  move_number(fitted, "effects.setup.piece_offset.shift_um.x", 12);
  other.axes[kY].servo.feedforward_lag = 100e-6;  // said otherwise
  const Machine with = with_fitted(other, declared, fitted);
  EXPECT_NEAR(with.axes[kX].servo.position_lag, 80e-6, 1e-15);
  EXPECT_EQ(with.axes[kY].servo.feedforward_lag, 100e-6);
  EXPECT_NEAR(number_of(with, "effects.setup.piece_offset.shift_um.x"), 12, 1e-9);
}

/// Neither ball nor ring is another one, but either may be warmer.
TEST(Nuisances, BallAndGaugeAreAsUncertainBetweenTwoRuns) {
  const std::string key = "effects.probe.tip_radius.larger_um";
  EXPECT_EQ(number_among(nuisances({}), key)->tolerance, 1);
  EXPECT_EQ(number_among(nuisances({}, Against::healthy_run), key)->tolerance, 1);
}

TEST(FreedNumber, OfWhatDeviatesIsTheTrueValue) {
  Machine machine;
  const std::string key = "axes.X.load_kg";
  const double declared = machine.axes[kX].mechanics.load;
  machine.effects.deviations = {{key, 480}};
  EXPECT_EQ(number_of(machine, key), 480);
  for (const FreedNumber& n : nuisances(machine)) {
    if (n.number.key != key) continue;
    EXPECT_EQ(n.centre, 480);
    EXPECT_DOUBLE_EQ(n.tolerance, 4.8);
  }
  Machine moved = machine;
  move_number(moved, key, 470);
  EXPECT_EQ(number_of(moved, key), 470);
  std::vector<FreedNumber> numbers{{.number = {.key = key}, .value = 460}};
  moved = with(moved, numbers);
  EXPECT_EQ(number_of(moved, key), 460);
  numbers[0].value = 0;
  take_values(numbers, moved);
  EXPECT_EQ(numbers[0].value, 460);
  EXPECT_EQ(moved.axes[kX].mechanics.load, declared);  // what the controller knows
  ASSERT_EQ(moved.effects.deviations.size(), 1U);
}

}  // namespace
}  // namespace vcnc::engine_parts_test
