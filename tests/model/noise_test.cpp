#include "model/probe/noise.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace vcnc::noise_test {
namespace {

// Known answers published with the Random123 library.
TEST(Noise, PhiloxKnownAnswers) {
  using Block = std::array<std::uint32_t, 4>;
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Noise, UniformMomentsAndRange) {
  constexpr int kCount = 200000;
  double sum = 0, sum2 = 0;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const double x = uniform_noise(1, 2, i);
    ASSERT_GT(x, 0);
    ASSERT_LT(x, 1);
    sum += x;
    sum2 += x * x;
  }
  EXPECT_NEAR(sum / kCount, 0.5, 5 * std::sqrt(1 / 12.0 / kCount));
  EXPECT_NEAR(sum2 / kCount, 1 / 3.0, 5 * std::sqrt(4 / 45.0 / kCount));
}

TEST(Noise, GaussianMoments) {
  constexpr int kPairs = 200000;
  double m1 = 0, m2 = 0, m3 = 0, m4 = 0, cross = 0, beyond = 0;
  for (std::uint64_t i = 0; i < kPairs; ++i) {
    const auto pair = gaussian_noise(7, 3, i);
    cross += pair[0] * pair[1];
    for (const double x : pair) {
      m1 += x;
      m2 += x * x;
      m3 += x * x * x;
      m4 += x * x * x * x;
      beyond += std::abs(x) > 1.959964;
    }
  }
  const double n = 2.0 * kPairs;
  EXPECT_NEAR(m1 / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(m2 / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(m3 / n, 0, 5 * std::sqrt(15 / n));
  EXPECT_NEAR(m4 / n, 3, 5 * std::sqrt(96 / n));
  EXPECT_NEAR(cross / kPairs, 0, 5 / std::sqrt(kPairs));
  EXPECT_NEAR(beyond / n, 0.05, 5 * std::sqrt(0.05 * 0.95 / n));
}

TEST(Noise, StreamsSeedsAndCountersAreIndependent) {
  double by_stream = 0, by_seed = 0, by_counter = 0;
  constexpr int kCount = 100000;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const double x = gaussian_noise(1, 1, i)[0];
    by_stream += x * gaussian_noise(1, 2, i)[0];
    by_seed += x * gaussian_noise(2, 1, i)[0];
    by_counter += x * gaussian_noise(1, 1, i + 1)[0];
  }
  for (const double sum : {by_stream, by_seed, by_counter})
    EXPECT_NEAR(sum / kCount, 0, 5 / std::sqrt(kCount));
}

TEST(Noise, IsAPureFunction) {
  const double first = gaussian_noise(11, 22, 33)[1];
  gaussian_noise(1, 1, 1);
  EXPECT_EQ(gaussian_noise(11, 22, 33)[1], first);
  EXPECT_NE(gaussian_noise(11, 22, 33 + (1ull << 32))[1], first);
  EXPECT_NE(gaussian_noise(11 + (1ull << 32), 22, 33)[1], first);
}

}  // namespace
}  // namespace vcnc::noise_test
