#include "diagnosis/beforehand/unrest.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "toy_machine.hpp"

namespace vcnc::unrest_test {
namespace {

constexpr std::size_t kMoves = 8000, kStands = 1000, kLaps = 6;

/// X to and fro in 8 s, and then a second at rest.
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

constexpr double kUnknown = -1;

/// Of one signal of X, in motion and at rest.
std::pair<double, double> of_signal(const std::vector<Unrest>& all, SignalKind kind) {
  std::pair<double, double> rms{kUnknown, kUnknown};
  for (const Unrest& u : all)
    if (u.channel.kind == kind) (u.at_rest ? rms.second : rms.first) = u.rms.value_or(kUnknown);
  return rms;
}

/// Of a run where `more` is added to the noise of the force of X at every sample of a lap.
template <class F>
std::vector<Unrest> unrest_with(F&& more) {
  Record record = to_and_fro();
  toy::measure(record, {}, 21);
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::force)
      for (std::size_t k = 0; k < s.value.size(); ++k)
        s.value[k] += more(k, k % (kMoves + kStands) >= kMoves);
  toy::ToyReplica replica(record);
  const Evidence evidence(record, replica, {});
  return unrest_of(evidence);
}

/// Of the force of X.
template <class F>
std::pair<double, double> in_motion_and_at_rest(F&& more) {
  return of_signal(unrest_with(more), SignalKind::force);
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

TEST(Unrest, OfLapsThatBeginWithinASampleIsPartOfWhatIsOff) {
  constexpr std::size_t kLap = kMoves + kStands;
  const double large = 1e5 * toy::kForceNoise;
  const auto later = [&](std::size_t k, bool at_rest) {
    const double within = static_cast<double>(k % kLap) + (k / kLap % 2 == 0 ? 0 : 0.5);
    return at_rest ? 0 : large * std::sin(2 * kPi * within / kMoves);
  };
  const auto trembling = [&](std::size_t k, bool) {
    return 50 * toy::kForceNoise * wave(k, 171.37);
  };
  for (const bool trembles : {false, true}) {
    const std::vector<Unrest> all = trembles ? unrest_with(trembling) : unrest_with(later);
    for (const Unrest& u : all) {
      if (u.channel.kind != SignalKind::force || u.at_rest) continue;
      EXPECT_GT(*u.rms, 10 * toy::kForceNoise);
      EXPECT_EQ(is_part_of_what_is_off(*u.rms, u.off), !trembles) << *u.rms << " of " << u.off;
    }
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
          s.value[k] = exact[c][k] * (1 + 1e-12 * gaussian_noise(23, c, k)[0]);
  }
  const Evidence evidence(record, replica, {});
  for (const SignalKind kind : {SignalKind::position, SignalKind::force}) {
    const double least = kind == SignalKind::force ? 1e-6 : 1e-9;
    // At rest, where nothing moves at all, too.
    const auto [motion, rest] = of_signal(healthy_noise(evidence).unrest, kind);
    EXPECT_GE(motion, least);
    EXPECT_GE(rest, least);
    EXPECT_LT(of_signal(unrest_of(evidence), kind).second, least);
  }
}

TEST(Unrest, IsNotKnownOfAnAxisThatNeverStands) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, {}, 25);
  toy::ToyReplica replica(record);
  const Evidence evidence(record, replica, {});
  const auto [motion, rest] = of_signal(unrest_of(evidence), SignalKind::force);
  EXPECT_NEAR(motion, toy::kForceNoise, 0.05 * toy::kForceNoise);
  EXPECT_EQ(rest, kUnknown);
}

TEST(Unrest, LapsMayBeginAnywhereWithinASample) {
  // Laps of 999.6 samples: the same position is 17 um off at most from one to the next.
  Record record;
  record.source = "toy";
  constexpr double kLap = 999.6;
  const auto samples = static_cast<std::size_t>(kLaps * kLap);
  std::vector<double> x, y(samples, 0.0);
  for (std::size_t k = 0; k < samples; ++k)
    x.push_back(0.01 * std::cos(2 * kPi * static_cast<double>(k) / kLap));
  for (std::size_t lap = 0; lap < kLaps; ++lap) {
    const auto at = static_cast<std::size_t>(std::round(static_cast<double>(lap) * kLap));
    record.stretches.push_back({at, std::min(at + 999, samples), 0, static_cast<int>(lap), ""});
  }
  record.signals.push_back({SignalKind::command, 0, "qx", x, 0});
  record.signals.push_back({SignalKind::command, 1, "qy", y, 0});
  toy::measure(record, {}, 26);
  toy::ToyReplica replica(record);
  const Evidence evidence(record, replica, {});
  EXPECT_NEAR(of_signal(unrest_of(evidence), SignalKind::position).first, toy::kPositionNoise,
              0.05 * toy::kPositionNoise);
}

TEST(Unrest, IsNotAMomentThatOtherLapsDoNotShare) {
  // An axis that breaks away once more in its third lap.
  const auto [motion, rest] = in_motion_and_at_rest([](std::size_t k, bool at_rest) {
    const std::size_t in_lap = k % (kMoves + kStands);
    return k / (kMoves + kStands) == 2 && !at_rest && in_lap > 480 && in_lap < 520
               ? 1000 * toy::kForceNoise
               : 0.0;
  });
  EXPECT_LT(motion, 1.5 * toy::kForceNoise);
  EXPECT_LT(rest, 1.5 * toy::kForceNoise);
}

}  // namespace
}  // namespace vcnc::unrest_test
