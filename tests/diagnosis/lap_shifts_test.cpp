#include "diagnosis/evidence/lap_shifts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "diagnosis/evidence/evidence.hpp"
#include "model/probe/noise.hpp"
#include "tests/diagnosis/toy_machine.hpp"

namespace vcnc::lap_shifts_test {
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
  const Eigen::Vector3d rms(3e-6 / std::sqrt(2.0), std::sqrt((1 + 4) / 2.0) * 1e-6, 0);
  EXPECT_LT((rms_shift(of, per_shift, readings) - rms).norm(), 1e-8);  // one sample is missing
  take_out_shifts(of, per_shift, readings);
  for (const std::vector<double>& channel : readings)
    for (const double left : channel) EXPECT_NEAR(std::isfinite(left) ? left : 0, 0, 1e-11);
}

TEST(LapShifts, WhatIsNoShiftIsTheSameInAllLapsThoughOneHasNoBeginning) {
  const std::vector<Stretch> of = laps(2, 200);
  const std::vector<SeriesOfChannels> per_shift = ring(400, 200);
  SeriesOfChannels readings(2, std::vector<double>(400));
  for (std::size_t c = 0; c < 2; ++c)
    for (std::size_t k = 0; k < 400; ++k)
      readings[c][k] = (k % 200 < 100 ? 3e-6 : -3e-6) + (k < 200 ? 2e-6 : 0) * per_shift[0][c][k];
  for (std::size_t k = 0; k < 30; ++k) readings[0][k] = readings[1][k] = kMissing;
  take_out_shifts(of, per_shift, readings);
  for (const std::vector<double>& channel : readings)
    for (std::size_t k = 30; k < 200; ++k) EXPECT_NEAR(channel[k], channel[k + 200], 1e-12) << k;
}

TEST(LapShifts, ALapThatTellsLittleCountsLittle) {
  const std::vector<Stretch> of = laps(2, 200);
  std::vector<SeriesOfChannels> per_shift = ring(400, 200);
  for (std::size_t k = 200; k < 400; ++k)
    for (double& d : {std::ref(per_shift[1][0][k]), std::ref(per_shift[1][1][k])}) d *= 0.1;
  SeriesOfChannels readings(2, std::vector<double>(400));
  for (std::size_t c = 0; c < 2; ++c)
    for (std::size_t k = 0; k < 400; ++k)
      readings[c][k] = (k < 200 ? 1e-6 : 5e-6) * per_shift[1][c][k];
  EXPECT_NEAR(rms_shift(of, per_shift, readings).y(), std::sqrt((1 + 0.01 * 25) / 1.01) * 1e-6,
              1e-10);
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

/// The toy machine with an encoder that lets the piece lie elsewhere in every lap.
class RoundingReplica : public toy::ToyReplica {
 public:
  using toy::ToyReplica::ToyReplica;
  std::vector<std::vector<double>> rounding(const Machine&) const override {
    std::vector<std::vector<double>> all(3, std::vector<double>(12000, 0.0));
    for (std::size_t k = 0; k < 12000; ++k) all[2][k] = k / 1000 % 2 == 0 ? 1e-6 : -1e-6;
    return all;
  }
};

/// The toy machine with readings that are late.
class LateReplica : public toy::ToyReplica {
 public:
  using toy::ToyReplica::ToyReplica;
  Prediction predict(const Machine& m) const override {
    Prediction all = toy::ToyReplica::predict(m);
    const std::vector<double>& on_time = all[2];
    std::vector<double> late = on_time;
    for (std::size_t k = 1; k < late.size(); ++k)
      late[k] -= m.effects.get<SampleLatency>().latency * (on_time[k] - on_time[k - 1]) / 1e-3;
    all[2] = late;
    return all;
  }
};

TEST(Evidence, AClockThatDriftsIsNoNoise) {
  const Machine declared = toy::machine({{"effects.geometry.squareness.xy_urad", 2000}});
  Record record = toy::commands(1000, 4);
  const Prediction on_time = toy::ToyReplica(record).predict(declared);
  toy::measure(record, declared, 21);
  std::vector<double>& reading = record.signals.back().value;
  for (std::size_t k = 1; k < reading.size(); ++k)  // 5 ms later at the end, of 0.4 um per ms
    reading[k] -= 5 * static_cast<double>(k) / 12000 * (on_time[2][k] - on_time[2][k - 1]);
  LateReplica replica(record);
  const Evidence e(record, replica, declared);
  EXPECT_NEAR(e.noise().channels[2].rms, toy::kProbeNoise, 0.1 * toy::kProbeNoise);
}

TEST(Evidence, ShiftsThatRoundingMakesAreNoise) {
  Record shifted = toy::commands(1000, 4);
  toy::measure(shifted, Machine(), 13);
  const double apart[] = {1, -2, 0.5, -1, 1, 1.5, -0.5, -0.5, 1, -1, 0.5, -0.5};  // [um]
  for (MeasuredSignal& s : shifted.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 0; k < s.value.size(); ++k) s.value[k] += 1e-6 * apart[k / 1000];
  toy::ToyReplica trusting(shifted);
  RoundingReplica knowing(shifted);
  const auto above = [&](toy::ToyReplica& replica) {
    const Evidence e(shifted, replica, Machine());
    return e.chi2(e.residual(e.predict(Machine())), Role::both) / e.count(Role::both) - 1;
  };
  EXPECT_GT(above(trusting), 10);
  EXPECT_LT(std::abs(above(knowing)), 0.05);
}

/// The toy machine whose encoder lets the piece lie elsewhere only where the axes are not square.
class RoundingWhereSkewReplica : public RoundingReplica {
 public:
  using RoundingReplica::RoundingReplica;
  std::vector<std::vector<double>> rounding(const Machine& m) const override {
    std::vector<std::vector<double>> all = RoundingReplica::rounding(m);
    const double share = m.effects.get<Squareness>().xy == 0 ? 1e-3 : 1;
    for (double& r : all[2]) r *= share;
    return all;
  }
};

TEST(Evidence, RoundingIsReckonedWithAsInWhatWasFound) {
  const Machine declared, found = toy::machine({{"effects.geometry.squareness.xy_urad", 2000}});
  Record record = toy::commands(1000, 4);
  toy::measure(record, found, 17);
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::deflection)
      for (std::size_t k = 0; k < s.value.size(); ++k)
        s.value[k] += k / 1000 % 3 == 0 ? 1e-6 : -0.5e-6;
  RoundingWhereSkewReplica replica(record);
  Evidence e(record, replica, declared);
  const auto above = [&] {
    return e.chi2(e.residual(e.predict(found)), Role::both) / e.count(Role::both) - 1;
  };
  EXPECT_FALSE(e.underrates_rounding(declared));
  EXPECT_TRUE(e.underrates_rounding(found));
  EXPECT_GT(above(), 1);
  EXPECT_EQ(e.rounding_beyond_reckoned(declared), (std::vector<double>{0, 0, 0}));
  EXPECT_GT(e.rounding_beyond_reckoned(found)[2], 1000);
  e.reckon_with_rounding(found);
  EXPECT_FALSE(e.underrates_rounding(found));
  EXPECT_EQ(e.rounding_beyond_reckoned(found)[2], 0);
  EXPECT_LT(std::abs(above()), 0.1);
}

}  // namespace
}  // namespace vcnc::lap_shifts_test
