#include "diagnosis/replica/readings_check.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "model/input_error.hpp"
#include "model/math.hpp"
#include "model/probe/noise.hpp"

namespace vcnc::readings_check_test {
namespace {

constexpr std::size_t kSamples = 2000;
const char* const kNames[] = {"u", "v", "w"};

/// What is predicted of x, y, z: a turn of the contact about z, and a lift in between.
SeriesOfChannels predicted() {
  SeriesOfChannels all(3);
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double turn = 2 * kPi * static_cast<double>(k) / kSamples;
    all[0].push_back(200e-6 * std::cos(turn));
    all[1].push_back(200e-6 * std::sin(turn));
    all[2].push_back(50e-6 * std::cos(3 * turn));
  }
  return all;
}

/// Reading c is the prediction column[c], times factor[c], with noise of 5 um.
std::string refusal(const std::array<std::size_t, 3>& column,
                    const std::array<double, 3>& factor = {1, 1, 1},
                    SignalKind kind = SignalKind::deflection) {
  const SeriesOfChannels all = predicted();
  Record record;
  record.source = "run.csv";
  std::vector<ComparedChannel> channels;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> value;
    for (std::size_t k = 0; k < kSamples; ++k)
      value.push_back(k % 100 == 7
                          ? kMissing
                          : factor[c] * all[column[c]][k] + 5e-6 * gaussian_noise(1, c, k)[0]);
    record.signals.push_back({kind, c, kNames[column[c]], value, 0});
    channels.push_back({kind, c});
  }
  try {
    check_readings(record, channels, {all.begin(), all.end()});
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(ReadingsCheck, NamesColumnsThatAreAnotherReading) {
  EXPECT_EQ(refusal({0, 1, 2}), "");
  EXPECT_EQ(refusal({1, 0, 2}),
            "run.csv: \"v\" (deflection x) is what \"u\" (deflection y) would be: the columns are "
            "swapped");
  EXPECT_NE(refusal({0, 2, 1}).find("swapped"), std::string::npos);
  EXPECT_NE(refusal({1, 2, 0}).find("swapped"), std::string::npos);
}

TEST(ReadingsCheck, NamesAToolPositionThatIsElsewhereAndNotOneOfAHeldBall) {
  // What a healthy machine does to a ball that is held may well be turned by a fault.
  EXPECT_EQ(refusal({0, 1, 2}, {1, 1, -1}, SignalKind::tool_position), "");
  EXPECT_EQ(refusal({1, 0, 2}, {1, 1, 1}, SignalKind::tool_position), "");
  const std::size_t n = 400;
  std::vector<double> predicted(n), turned(n), shifted(n);
  for (std::size_t k = 0; k < n; ++k) {
    predicted[k] = 0.05 * std::cos(2 * kPi * static_cast<double>(k) / n);
    turned[k] = -predicted[k];
    shifted[k] = predicted[k] + 5e-3;
  }
  const auto refusal_of = [&](const std::vector<double>& value) -> std::string {
    Record record;
    record.source = "grid.csv";
    record.signals.push_back({SignalKind::tool_position, 0, "px", value, 0});
    try {
      check_readings(record, {{SignalKind::tool_position, 0}}, {predicted});
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal_of(predicted), "");
  EXPECT_NE(refusal_of(turned).find("check its sign"), std::string::npos);
  EXPECT_EQ(refusal_of(shifted),
            "grid.csv: \"px\" (tool position x) is 5 mm off what the machine of the model would "
            "read, always the same; check zero_mm");
}

TEST(ReadingsCheck, NamesAReadingThatGoesTheOtherWay) {
  EXPECT_EQ(refusal({0, 1, 2}, {1, 1, -1}),
            "run.csv: \"w\" (deflection z) goes against what the machine does; check its sign");
  EXPECT_EQ(refusal({0, 1, 2}, {-1, 1, 1}, SignalKind::twist),
            "run.csv: \"u\" (twist X) goes against what the machine does; check its sign");
}

TEST(ReadingsCheck, NamesTheMistakeThatMakesAllReadingsTooLarge) {
  EXPECT_EQ(refusal({0, 1, 2}, {2, 2, 2}),
            "run.csv: all readings are 2 times what the machine of the model would "
            "read (a factor of 2: diameter and radius, or periods and half periods); check their "
            "unit, and the sizes of ball and piece");
  EXPECT_NE(refusal({0, 1, 2}, {25.4, 25.4, 25.4}).find("inches and mm"), std::string::npos);
  EXPECT_NE(refusal({0, 1, 2}, {10, 10, 10}).find("a decimal place"), std::string::npos);
  EXPECT_NE(refusal({0, 1, 2}, {100, 100, 100}).find("m and cm"), std::string::npos);
  EXPECT_EQ(refusal({0, 1, 2}, {1.3, 1.3, 1.3}), "");
  EXPECT_EQ(refusal({0, 1, 2}, {2, 2, 1}), "");
}

TEST(ReadingsCheck, NamesTheOneReadingInAnotherUnit) {
  EXPECT_EQ(refusal({0, 1, 2}, {1, 1, 1000}),
            "run.csv: \"w\" (deflection z) is 1e+03 times what the machine of the model would read "
            "(a factor of 1000: m and mm, or s and ms); check its unit and scale");
  EXPECT_NE(refusal({0, 1, 2}, {25.4, 1, 1}).find("\"u\" (deflection x) is 25.4 times"),
            std::string::npos);
  EXPECT_EQ(refusal({0, 1, 2}, {1, 1, 10}), "");
}

TEST(ReadingsCheck, AFaultOfTheProbeIsNoSwap) {
  EXPECT_EQ(refusal({0, 1, 2}, {0.5, 2, 1}), "");
  EXPECT_EQ(refusal({0, 1, 2}, {1, 0, 1}), "");  // dead
  EXPECT_EQ(refusal({0, 0, 2}), "");             // y reads x, and x reads it as well
}

}  // namespace
}  // namespace vcnc::readings_check_test
