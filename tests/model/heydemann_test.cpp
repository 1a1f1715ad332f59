#include "model/probe/heydemann.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/math.hpp"
#include "model/probe/noise.hpp"

namespace vcnc::heydemann_test {
namespace {

double phase_error(const SinCos& s, double phi) {
  return std::remainder(std::atan2(s.w, s.u) - phi, 2 * kPi);
}

Lissajous skewed() { return {0.5, 0.5 / 0.46, 0.013, -0.021, 4 * kDegree}; }

std::vector<SinCos> samples(const Lissajous& truth, int count, double from, double to, double noise,
                            std::uint64_t seed = 3) {
  std::vector<SinCos> result;
  for (int i = 0; i < count; ++i) {
    SinCos s = truth.signals(from + (to - from) * i / count);
    const auto g = gaussian_noise(seed, 1, static_cast<std::uint64_t>(i));
    s.u += noise * g[0];
    s.w += noise * g[1];
    result.push_back(s);
  }
  return result;
}

double worst_corrected(const Lissajous& truth, const Lissajous& fitted) {
  double worst = 0;
  for (int i = 0; i < 720; ++i) {
    const double phi = i * kPi / 360;
    worst = std::max(worst, std::abs(phase_error(fitted.corrected(truth.signals(phi)), phi)));
  }
  return worst;
}

// Uncorrected errors at a period of 20 um: 1 % offset 32 nm, 2 % gain 32 nm, 0.02 rad 64 nm.
TEST(Lissajous, UncorrectedErrorsOfTheTextbook) {
  struct Case {
    Lissajous truth;
    double expected_nm;
  };
  const Case cases[] = {{{0.5, 1, 0.005, 0, 0}, 32},
                        {{0.5, 1, 0, 0.005, 0}, 32},
                        {{0.5, 1 / 1.02, 0, 0, 0}, 32},
                        {{0.5, 1, 0, 0, 0.02}, 64}};
  for (const Case& c : cases) {
    double worst = 0, off_formula = 0;
    for (int i = 0; i < 3600; ++i) {
      const double phi = i * kPi / 1800;
      const double error = phase_error(c.truth.signals(phi), phi);
      const double g = 1 / c.truth.gain - 1;
      const double formula = (c.truth.q * std::cos(phi) - c.truth.p * std::sin(phi)) / 0.5 +
                             g * std::sin(2 * phi) / 2 -
                             c.truth.alpha * std::cos(phi) * std::cos(phi);
      worst = std::max(worst, std::abs(error));
      off_formula = std::max(off_formula, std::abs(error - formula));
    }
    EXPECT_NEAR(worst * 20e3 / (2 * kPi), c.expected_nm, 0.7);
    EXPECT_LT(off_formula, 5e-4);  // second order
  }
}

TEST(Lissajous, CorrectionUndoesTheEllipse) {
  EXPECT_LT(worst_corrected(skewed(), skewed()), 1e-14);
  const SinCos s = skewed().corrected(skewed().signals(1.1));
  EXPECT_NEAR(std::hypot(s.u, s.w), 0.5, 1e-14);
}

TEST(Heydemann, RecoversAnEllipseExactly) {
  const auto fit = fit_lissajous(samples(skewed(), 100, 0, 2 * kPi, 0));
  ASSERT_EQ(fit.verdict, FitVerdict::good);
  EXPECT_NEAR(fit.ellipse.amplitude, 0.5, 1e-10);
  EXPECT_NEAR(fit.ellipse.gain, 0.5 / 0.46, 1e-10);
  EXPECT_NEAR(fit.ellipse.p, 0.013, 1e-10);
  EXPECT_NEAR(fit.ellipse.q, -0.021, 1e-10);
  EXPECT_NEAR(fit.ellipse.alpha, 4 * kDegree, 1e-10);
  EXPECT_LT(fit.residual, 1e-7);
}

// 1 mV of noise: typically 0.4 mrad are left, 1.3 nm at 20 um.
TEST(Heydemann, RecoversThroughNoise) {
  std::vector<double> left;
  for (std::uint64_t seed = 0; seed < 101; ++seed) {
    const auto fit = fit_lissajous(samples(skewed(), 500, 0, 6 * kPi, 1e-3, seed));
    ASSERT_EQ(fit.verdict, FitVerdict::good);
    left.push_back(worst_corrected(skewed(), fit.ellipse));
    ASSERT_LT(left.back(), 1.5e-3);
    ASSERT_NEAR(fit.residual, 1e-3 / 0.48, 0.3e-3);  // radial noise over the radius
  }
  std::sort(left.begin(), left.end());
  EXPECT_NEAR(left[50], 0.4e-3, 0.1e-3);
}

TEST(Heydemann, RefusesWhatItCannotTrust) {
  EXPECT_EQ(fit_lissajous(samples(skewed(), 49, 0, 2 * kPi, 0)).verdict, FitVerdict::too_few);
  EXPECT_EQ(fit_lissajous(samples(skewed(), 100, 0, 1.5 * kPi, 0)).verdict,
            FitVerdict::no_coverage);
  EXPECT_EQ(fit_lissajous(samples(skewed(), 300, 0, 2 * kPi, 0.05)).verdict, FitVerdict::residual);
  Lissajous weak = skewed();
  weak.amplitude = 0.25;
  EXPECT_EQ(fit_lissajous(samples(weak, 100, 0, 2 * kPi, 0)).verdict, FitVerdict::amplitude);
  std::vector<SinCos> hyperbola;
  for (int i = 0; i < 100; ++i) {
    const double t = -1 + 0.02 * i, s = i % 2 == 0 ? 1 : -1;
    hyperbola.push_back({s * 0.3 * std::cosh(t), 0.3 * std::sinh(t)});
  }
  for (int i = 0; i < 24; ++i) {  // covers all sectors, but is no ellipse
    const double phi = i * kPi / 12;
    hyperbola.push_back({1e-3 * std::cos(phi), 1e-3 * std::sin(phi)});
  }
  EXPECT_NE(fit_lissajous(hyperbola).verdict, FitVerdict::good);
}

TEST(OnlineCorrector, WaitsForCoverageThenCorrects) {
  const Lissajous truth = skewed();
  OnlineCorrector corrector;
  // A long rest and half an ellipse do not suffice.
  for (int i = 0; i < 5000; ++i) corrector.correct(truth.signals(0.3));
  for (int i = 0; i < 1000; ++i) corrector.correct(truth.signals(i * kPi / 1000));
  EXPECT_FALSE(corrector.ellipse());
  const SinCos raw = truth.signals(0.5);
  EXPECT_EQ(corrector.correct(raw).u, raw.u);
  for (int i = 0; i < 1000; ++i) corrector.correct(truth.signals(i * 2 * kPi / 500));
  ASSERT_TRUE(corrector.ellipse());
  EXPECT_LT(worst_corrected(truth, *corrector.ellipse()), 1e-6);
  EXPECT_LT(std::abs(phase_error(corrector.correct(truth.signals(2.0)), 2.0)), 1e-6);
  EXPECT_EQ(corrector.refused(), 0);
}

TEST(OnlineCorrector, StartsAnewAfterABadCollection) {
  Lissajous weak = skewed();
  weak.amplitude = 0.2;
  OnlineCorrector corrector;
  for (int i = 0; i < 500; ++i) corrector.correct(weak.signals(i * 2 * kPi / 240));
  EXPECT_FALSE(corrector.ellipse());
  EXPECT_GE(corrector.refused(), 1);
  for (int i = 0; i < 1000; ++i) corrector.correct(skewed().signals(i * 2 * kPi / 240));
  EXPECT_TRUE(corrector.ellipse());
}

}  // namespace
}  // namespace vcnc::heydemann_test
