#include "diagnosis/evidence/comparable.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/records/commanded_motion.hpp"
#include "model/probe/noise.hpp"

namespace vcnc::comparable_test {
namespace {

constexpr std::size_t kSamples = 2000;
const std::vector<ComparedChannel> kChannels{
    {SignalKind::position, 0}, {SignalKind::force, 0}, {SignalKind::deflection, 0}};

/// X commanded so, Y and Z at rest; measured as predicted with noise of 100 nm in the reading.
struct RecordedRamp {
  Record record;
  SeriesOfChannels measured, predicted;
  double slipped = 0;  ///< of all readings [m]

  explicit RecordedRamp(const std::vector<double>& x) {
    const std::vector<double> rest(x.size(), 0.0);
    for (std::size_t axis = 0; axis < 3; ++axis)
      record.signals.push_back({SignalKind::command, axis, "", axis == 0 ? x : rest, 0});
    predicted = measured = SeriesOfChannels(3, rest);
    predicted[2].assign(x.size(), 100e-6);
    for (std::size_t k = 0; k < x.size(); ++k)
      measured[2][k] = 100e-6 + 100e-9 * gaussian_noise(3, 0, k)[0];
  }
  std::vector<std::vector<char>> comparable() const {
    SeriesOfChannels read = measured, told = predicted;
    for (SeriesOfChannels* all : {&read, &told})
      for (double& reading : (*all)[2]) reading += slipped;
    return comparable_samples(record, kChannels, read, Prediction(told.begin(), told.end()),
                              Prediction(predicted.begin(), predicted.end()));
  }
};

std::vector<double> ramp(double speed) {
  std::vector<double> x;
  for (std::size_t k = 0; k < kSamples; ++k) x.push_back(speed * 1e-3 * static_cast<double>(k));
  return x;
}

std::size_t left_out(const std::vector<char>& flags) {
  return static_cast<std::size_t>(std::count(flags.begin(), flags.end(), 0));
}

TEST(Comparable, AllOfASmoothMotion) {
  const auto flags = RecordedRamp(ramp(0.05)).comparable();
  EXPECT_EQ(left_out(flags[0]), 0U);
  EXPECT_EQ(left_out(flags[1]), 2U);  // before the first and after the last sample X may stand
  EXPECT_EQ(left_out(flags[2]), 0U);
}

TEST(Comparable, NotWhatIsMissingInEither) {
  RecordedRamp run(ramp(0.05));
  run.measured[0][7] = kMissing;
  run.predicted[0][9] = kMissing;
  const auto flags = run.comparable();
  EXPECT_EQ(left_out(flags[0]), 2U);
  EXPECT_FALSE(flags[0][7] || flags[0][9]);
}

TEST(Comparable, NotTheForceOfAnAxisThatStands) {
  std::vector<double> x = ramp(0.05);
  for (std::size_t k = 1000; k < kSamples; ++k) x[k] = x[1000];
  const auto flags = RecordedRamp(x).comparable();
  EXPECT_TRUE(flags[0][1490]);  // its position can be until it has settled
  EXPECT_FALSE(flags[0][1510] || flags[0][1999]);
  EXPECT_TRUE(flags[1][970]);
  EXPECT_FALSE(flags[1][1010] || flags[1][1999]);
}

TEST(Comparable, NotReadingsOfABallThatRestsUntilItsDragHasTurnedOver) {
  std::vector<double> x = ramp(0.05);
  for (std::size_t k = kSamples; k-- > 1000;) x[k] = k < 1500 ? x[1000] : x[k - 500];
  RecordedRamp run(x);
  run.predicted[2].assign(x.size(), 0.5e-3);  // 0.2 mm to turn over: four samples
  const auto flags = run.comparable();
  EXPECT_TRUE(flags[2][1000]);
  EXPECT_FALSE(flags[2][1001] || flags[2][1500] || flags[2][1503]);
  EXPECT_TRUE(flags[2][1506]);
  EXPECT_TRUE(flags[0][1001]);
}

TEST(Comparable, ReadingsOfASlowScan) {
  const auto flags = RecordedRamp(ramp(0.5e-3)).comparable();
  EXPECT_EQ(left_out(flags[2]), 80U);  // until 40 um are done
}

TEST(Comparable, ACommandThatIsMissingTakesNoReadingsAlong) {
  RecordedRamp run(ramp(0.05));
  for (const std::size_t missing : {700U, 701U, 1400U})
    run.record.signals[0].value[missing] = kMissing;
  run.record = with_bridged_commands(run.record);
  EXPECT_DOUBLE_EQ(run.record.signals[0].value[700], 0.05 * 0.7);
  EXPECT_EQ(left_out(run.comparable()[2]), 0U);
}

TEST(Comparable, NotReadingsAboutTheMomentOfReleaseHoweverLongTheBallSwings) {
  RecordedRamp run(ramp(0.05));
  for (std::size_t k = 1000; k < kSamples; ++k) {  // released at 1000, 25 Hz, still from 1290 on
    const double t = 1e-3 * static_cast<double>(k - 1000);
    run.measured[2][k] = run.predicted[2][k] =
        100e-6 * std::exp(-t / 0.05) * std::cos(2 * 3.14159265 * 25 * t);
  }
  const auto flags = run.comparable();
  EXPECT_TRUE(flags[2][930]);
  EXPECT_FALSE(flags[2][970] || flags[2][1000] || flags[2][1030]);
  EXPECT_TRUE(flags[2][1100]);
  EXPECT_FALSE(flags[2][1270]);
  EXPECT_TRUE(flags[2][1400]);
}

TEST(Comparable, NotReadingsAboutTheMomentOfTouching) {
  RecordedRamp run(ramp(0.05));
  for (std::size_t k = 0; k < 800; ++k) run.measured[2][k] = run.predicted[2][k] = 0;
  for (const double slipped : {0.0, 20e-6}) {
    run.slipped = slipped;
    const auto flags = run.comparable();
    EXPECT_EQ(left_out(flags[2]), 100U);
    EXPECT_TRUE(flags[2][749] && flags[2][850]);
    EXPECT_FALSE(flags[2][750] || flags[2][849]);
    EXPECT_EQ(left_out(flags[0]), 0U);
  }
}

TEST(Comparable, AReadingThatGoesThroughZeroIsNoTouch) {
  RecordedRamp run(ramp(0.05));
  for (std::size_t k = 0; k < kSamples; ++k)
    run.measured[2][k] = run.predicted[2][k] = 100e-6 * std::cos(static_cast<double>(k) / 100);
  EXPECT_EQ(left_out(run.comparable()[2]), 0U);
}

TEST(Comparable, NotReadingsThatJumpWhileTheBallSlidesSlowly) {
  for (const double speed : {0.005, 0.05}) {
    RecordedRamp run(ramp(speed));
    for (std::size_t k = 1000; k < 1020; ++k) run.measured[2][k] += k % 2 == 0 ? 5e-6 : -5e-6;
    const auto flags = run.comparable();
    EXPECT_EQ(flags[2][1010], speed > 0.02) << speed;
    EXPECT_TRUE(flags[2][900] && flags[2][1100]);
    EXPECT_EQ(left_out(flags[0]), 0U);
  }
}

}  // namespace
}  // namespace vcnc::comparable_test
