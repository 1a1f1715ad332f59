#include "diagnosis/evidence/line_spectrum.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "model/math.hpp"

namespace vcnc::line_spectrum_test {
namespace {

constexpr double kLength = 0.4;  // [m]

/// Of an axis that goes to and fro as a sine does.
Eigen::ArrayXd strokes(Eigen::Index samples) {
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(samples, 0, 7.3);
  return kLength / 2 * (2 * kPi * t).sin() + 0.1;
}

Eigen::ArrayXd wave(const Eigen::ArrayXd& position, double waves, double phase) {
  return (2 * kPi * waves / kLength * position + phase).sin();
}

Eigen::Index highest(const Eigen::ArrayXXd& power, Eigen::Index column) {
  Eigen::Index at = 0;
  power.col(column).maxCoeff(&at);
  return at;
}

/// All of it is explained where the wave is: the mean square of a sine is a half.
TEST(LineSpectrum, TellsHowManyWavesAndHowStrong) {
  const Eigen::ArrayXd x = strokes(40000);
  const Eigen::Index most = 1500;
  Eigen::ArrayXXd z(x.size(), 3);
  const std::array waves{4.0, 240.0, 1420.5};
  for (Eigen::Index i = 0; i < 3; ++i)
    z.col(i) = 2.0 * wave(x, waves[static_cast<std::size_t>(i)], 0.7 * static_cast<double>(i));
  const Eigen::ArrayXXd power = line_spectrum(x, z, kLength, most);
  ASSERT_EQ(power.rows(), even_waves(most).count);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Index at = highest(power, i);
    EXPECT_DOUBLE_EQ(even_waves(most).waves(at), waves[static_cast<std::size_t>(i)]);
    EXPECT_NEAR(power(at, i) / z.col(i).square().sum(), 1, 0.01);
  }
}

/// Against the sums themselves, on noise at uneven places.
TEST(LineSpectrum, IsWhatTheSumsAre) {
  const Eigen::Index most = 300;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> anywhere(-0.3, -0.3 + kLength);
  Eigen::ArrayXd x(20000);
  Eigen::ArrayXXd z(x.size(), 2);
  for (Eigen::Index k = 0; k < x.size(); ++k)
    x[k] = anywhere(random), z(k, 0) = normal(random), z(k, 1) = normal(random);
  z.col(1) += wave(x, 17, 0.4);
  const Eigen::ArrayXXd fast = line_spectrum(x, z, kLength, most),
                        sums = line_powers(x, z, kLength, even_waves(most));
  for (Eigen::Index i = 0; i < z.cols(); ++i)
    for (Eigen::Index row = 0; row < fast.rows(); ++row)
      EXPECT_NEAR(std::sqrt(fast(row, i)), std::sqrt(sums(row, i)),
                  0.25 + 0.01 * std::sqrt(sums(row, i)))
          << even_waves(most).waves(row) << " waves";
}

TEST(LineSpectrum, OfNoWavesIsEmpty) {
  const Eigen::ArrayXd x = strokes(100);
  EXPECT_EQ(line_spectrum(x, Eigen::ArrayXXd::Ones(100, 1), kLength, 0).rows(), 0);
  EXPECT_EQ(line_spectrum(x, Eigen::ArrayXXd::Ones(100, 1), kLength, 1).rows(), 0);
}

}  // namespace
}  // namespace vcnc::line_spectrum_test
