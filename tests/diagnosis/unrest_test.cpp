#include "diagnosis/search/unrest.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "toy_machine.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kMoves = 1000, kStands = 1000, kLaps = 6;

/// X to and fro in a second, and then a second at rest.
Record to_and_fro() {
  Record record;
  record.source = "toy";
  std::vector<double> x;
  for (std::size_t lap = 0; lap < kLaps; ++lap) {
    const std::size_t begin = x.size();
    for (std::size_t k = 0; k < kMoves + kStands; ++k)
      x.push_back(k < kMoves ? 0.01 * (1 - std::cos(2 * kPi * static_cast<double>(k) / kMoves))
                             : 0);
    record.stretches.push_back({begin, x.size(), 0, static_cast<int>(lap), ""});
  }
  record.signals.push_back({SignalKind::command, 0, "qx", x, 0});
  record.signals.push_back({SignalKind::command, 1, "qy", std::vector<double>(x.size()), 0});
  return record;
}

/// Of the force of X, where `more` is added to the noise at every sample of a lap.
template <class F>
std::pair<double, double> in_motion_and_at_rest(F&& more) {
  Record record = to_and_fro();
  toy::measure(record, {}, 21);
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::force)
      for (std::size_t k = 0; k < s.value.size(); ++k)
        s.value[k] += more(k, k % (kMoves + kStands) >= kMoves);
  toy::ToyReplica replica(record);
  const Evidence evidence(record, replica, {});
  std::pair<double, double> rms;
  for (const Unrest& u : unrest_of(evidence))
    if (u.channel.kind == SignalKind::force) (u.at_rest ? rms.second : rms.first) = u.rms;
  return rms;
}

double wave(std::size_t k, double hertz) {
  return std::sin(2 * kPi * hertz * 1e-3 * static_cast<double>(k));
}

TEST(Unrest, IsTheNoiseOfAQuietDrive) {
  const auto [motion, rest] = in_motion_and_at_rest([](std::size_t, bool) { return 0.0; });
  EXPECT_NEAR(motion, toy::kForceNoise, 0.05 * toy::kForceNoise);
  // The mean of 21 samples takes 1/21 of the variance.
  EXPECT_NEAR(rest, toy::kForceNoise * std::sqrt(20.0 / 21), 0.05 * toy::kForceNoise);
}

TEST(Unrest, TellsTremblingAtRestFromThatInMotion) {
  const double strong = 50 * toy::kForceNoise;
  for (const bool stands : {false, true}) {
    const auto [motion, rest] = in_motion_and_at_rest([&](std::size_t k, bool at_rest) {
      return at_rest == stands ? strong * wave(k, 171.37) : 0.0;
    });
    EXPECT_NEAR(stands ? rest : motion, strong / std::sqrt(2.0), 0.1 * strong);
    EXPECT_LT(stands ? motion : rest, 2 * toy::kForceNoise);
  }
}

TEST(Unrest, IsNotWhatChangesSlowly) {
  const auto [motion, rest] = in_motion_and_at_rest([](std::size_t k, bool at_rest) {
    return at_rest ? 20 * toy::kForceNoise * wave(k, 0.5) : 0.0;
  });
  EXPECT_LT(motion, 1.1 * toy::kForceNoise);
  EXPECT_LT(rest, 1.1 * toy::kForceNoise);
}

TEST(Unrest, OfAHealthyRunIsNoLessThanAReplicaIsExact) {
  // A virtual drive without noise: what it does otherwise is rounding.
  Record record = to_and_fro();
  toy::measure(record, {}, 22);
  toy::ToyReplica replica(record);
  const Prediction exact = replica.predict({});
  for (std::size_t c = 0; c < exact.size(); ++c) {
    const ComparedChannel& channel = replica.channels()[c];
    for (MeasuredSignal& s : record.signals)
      if (s.kind == channel.kind)
        for (std::size_t k = 0; k < s.value.size(); ++k)
          s.value[k] = exact[c][k] * (1 + 1e-12 * gaussian_noise(23, c, k)[0]) +
                       1e-15 * gaussian_noise(24, c, k)[0];
  }
  const Evidence evidence(record, replica, {});
  std::size_t known = 0;
  for (const Unrest& u : healthy_noise(evidence).unrest) {
    known += u.rms > 0;
    if (u.rms > 0) {
      EXPECT_GE(u.rms, u.channel.kind == SignalKind::force ? 1e-6 : 1e-9);
    }
  }
  EXPECT_EQ(known, 4U);  // position and force, in motion and at rest
}

}  // namespace
}  // namespace vcnc
