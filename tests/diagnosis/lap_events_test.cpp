#include "diagnosis/evidence/lap_events.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "model/probe/noise.hpp"

namespace vcnc::lap_events_test {
namespace {

constexpr std::size_t kLap = 5000;
const std::vector<ComparedChannel> kChannels{
    {SignalKind::position, 0}, {SignalKind::force, 0}, {SignalKind::deflection, 0}};

/// Of two conditions, twice each unless told.
struct Laps {
  Partition partition;
  SeriesOfChannels difference;

  explicit Laps(std::uint64_t seed = 1, std::size_t times = 2) {
    const std::size_t laps = 2 * times;
    partition.repeated = true;
    for (std::size_t i = 0; i < laps; ++i)
      partition.stretches.push_back({i * kLap, (i + 1) * kLap, static_cast<int>(i % 2), 0, ""});
    for (std::uint64_t c = 0; c < kChannels.size(); ++c) {
      difference.emplace_back();
      for (std::size_t k = 0; k < laps * kLap; ++k)
        difference.back().push_back(gaussian_noise(seed, c, k)[0]);
    }
  }
  std::vector<LapEvent> events() const {
    return lap_events(partition, 1e-3, kChannels, difference);
  }
  /// A push at a sample that fades within some tens of samples, or as told.
  void push(std::size_t channel, std::size_t at, double size, double fades = 20) {
    for (std::size_t k = 0; static_cast<double>(k) < 5 * fades; ++k)
      difference[channel][at + k] += size * std::exp(-static_cast<double>(k) / fades);
  }
};

TEST(LapEvents, NoneInNoise) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) EXPECT_TRUE(Laps(seed).events().empty()) << seed;
}

TEST(LapEvents, OfOneLapInAllThatShareItsCondition) {
  Laps laps;
  laps.push(0, kLap + 2000, 200);
  const std::vector<LapEvent> events = laps.events();
  ASSERT_EQ(events.size(), 2U);
  for (const LapEvent& e : events) EXPECT_EQ(e.axis, 0U);
  // 50 ms before it begins; until 50 ms after it has faded to some times the noise: 200 / e^(k/20).
  EXPECT_EQ(events[0].begin, kLap + 1950);
  EXPECT_NEAR(static_cast<double>(events[0].end),
              static_cast<double>(kLap + 2050) + 20 * std::log(200 / 5.6), 15);
  EXPECT_EQ(events[1].begin, events[0].begin + 2 * kLap);
  EXPECT_EQ(events[1].end, events[0].end + 2 * kLap);
}

TEST(LapEvents, NotWhatAllLapsShare) {
  Laps laps;
  laps.push(0, 2000, 200);
  laps.push(0, 2 * kLap + 2000, 200);
  EXPECT_TRUE(laps.events().empty());
}

TEST(LapEvents, NotWhatIsLittle) {
  Laps laps;
  laps.push(0, 2000, 50);  // of two laps each is half of it off their mean: 35 times its noise
  EXPECT_TRUE(laps.events().empty());
}

TEST(LapEvents, OneOfSeveralSignalsOfAnAxis) {
  Laps laps;
  laps.push(0, 2000, 200);
  laps.push(1, 2030, 500);
  const std::vector<LapEvent> events = laps.events();
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].begin, 1950U);
  EXPECT_GT(events[0].end, 2130U);
}

TEST(LapEvents, NotOfReadings) {
  Laps laps;
  laps.push(2, 2000, 200);
  EXPECT_TRUE(laps.events().empty());
}

TEST(LapEvents, NotWhatLapsAreLike) {
  Laps laps;
  for (std::size_t k = 200; k < kLap; k += 900) laps.push(0, k, 200);  // more than 2 % of the laps
  EXPECT_TRUE(laps.events().empty());
}

TEST(LapEvents, WhatIsMissingIsNone) {
  Laps laps;
  for (std::size_t k = 1000; k < 3000; ++k) laps.difference[0][k] = kMissing;
  laps.push(0, 2000, 200);
  EXPECT_TRUE(laps.events().empty());
}

/// The first lap has still what came before it, for longer than an event may take.
TEST(LapEvents, OfTheOneLapThatIsOffWhereTheOthersAgree) {
  Laps laps(1, 3);
  laps.push(0, 0, 2000, 200);
  const std::vector<LapEvent> events = laps.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].begin, 0U);
  EXPECT_EQ(events[0].end, 1050U);  // the push takes 1000 samples, and 50 ms more
}

TEST(LapEvents, NotOfALapThatIsOffAlmostThroughout) {
  Laps laps(1, 3);
  laps.push(0, 0, 2000, 1500);
  EXPECT_TRUE(laps.events().empty());
}

TEST(LapEvents, NotWhereEveryLapIsAnotherOne) {
  Laps laps(1, 3);
  for (const std::size_t lap : {0U, 2U, 4U})
    laps.push(0, lap * kLap, 1000 * static_cast<double>(lap), 200);
  EXPECT_TRUE(laps.events().empty());
}

}  // namespace
}  // namespace vcnc::lap_events_test
