#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/effects/axis_bench.hpp"

namespace vcnc::displacement_effects_test {
namespace {

using namespace axis_bench;

constexpr double kUm = 1e-6;
// Differences of positions up to 0.2 m in double precision.
constexpr double kRounding = 2e-16;

/// Largest difference between what an effect does on a swinging axis and its closed form.
template <class... Effect>
double worst(std::size_t axis, const std::function<double(double t, double q)>& expected,
             const Effect&... effect) {
  double error = 0;
  for (const auto& [t, q, displacement] : swing(axis, 0.15, 0.5, 2, effect...))
    error = std::max(error, std::abs(displacement - expected(t, q)));
  return error;
}

/// The displacement at one position or after some time at rest.
template <class... Effect>
double at_rest(std::size_t axis, double position, double time, const Effect&... effect) {
  Machine machine = machine_with(axis, effect...);
  machine.axes[axis].limits.start = position;
  return AxisBench(machine, axis).at_speed(0, time).position - position;
}

TEST(DisplacementEffects, ScaleErrorGrowsWithTheDistanceFromTheReference) {
  const ScaleError effect{.error = 50e-6, .reference = 0.1};
  EXPECT_NEAR(at_rest(kX, 0.3, 0.01, effect), 10 * kUm, kRounding);
  EXPECT_NEAR(at_rest(kX, 0.1, 0.01, effect), 0, kRounding);
  EXPECT_LT(worst(
                kY, [](double, double q) { return 50e-6 * (q - 0.1); }, effect),
            kRounding);
}

TEST(DisplacementEffects, PitchPeriodicIsASineOverThePosition) {
  const PitchPeriodic effect{.amplitude = 2 * kUm, .period = 10e-3, .phase = 30 * kDegree};
  EXPECT_NEAR(at_rest(kX, 0, 0.01, effect), 1 * kUm, kRounding);               // sin 30
  EXPECT_NEAR(at_rest(kX, 0.1 + 1e-2 / 6, 0.01, effect), 2 * kUm, kRounding);  // sin 90
  EXPECT_LT(
      worst(
          kX,
          [](double, double q) { return 2 * kUm * std::sin(2 * kPi * q / 10e-3 + 30 * kDegree); },
          effect),
      kRounding);
  const double arcsec = kDegree / 3600;
  const PitchPeriodic worm{.amplitude = 5 * arcsec, .period = 5 * kDegree};
  EXPECT_NEAR(at_rest(kC, 91.25 * kDegree, 0.01, worm), 5 * arcsec, 1e-15);
}

TEST(DisplacementEffects, PitchProgressiveIsGivenAtItsTravel) {
  // By keys, as a machine file gives it: 5 um and 2 um at 100 mm, 10 arcsec at 90 deg.
  PitchProgressive linear{
      .quadratic = 5 * kUm / 0.01, .cubic = -2 * kUm / 0.001, .reference = 0.05};
  EXPECT_NEAR(at_rest(kX, 0.15, 0.01, linear), 3 * kUm, kRounding);
  EXPECT_NEAR(at_rest(kX, -0.05, 0.01, linear), 7 * kUm, kRounding);
  EXPECT_NEAR(at_rest(kX, 0.25, 0.01, linear), 4 * 5 * kUm - 8 * 2 * kUm, kRounding);
  EXPECT_LT(worst(
                kZ,
                [](double, double q) {
                  const double u = (q - 0.05) / 0.1;
                  return 5 * kUm * std::pow(u, 2) - 2 * kUm * std::pow(u, 3);
                },
                linear),
            kRounding);
}

/// Reads the units of the keys of an effect.
struct Units {
  std::vector<std::pair<std::string_view, double>> seen;
  void operator()(std::string_view key, double&, Unit unit, Range, const char*) {
    seen.emplace_back(key, unit.to_si);
  }
};

TEST(DisplacementEffects, PitchProgressiveKeysMeanWhatTheySay) {
  for (const bool rotary : {false, true}) {
    PitchProgressive effect;
    Units units;
    PitchProgressive::fields(effect, units, rotary);
    effect.quadratic = units.seen[0].second;  // 1 in the key's unit
    const std::size_t axis = rotary ? kA : kX;
    const double x = rotary ? 90 * kDegree : 0.1, one = rotary ? kDegree / 3600 : kUm;
    EXPECT_NEAR(at_rest(axis, x, 0.01, effect), one, 3e-16);
    effect.quadratic = 0;
    effect.cubic = units.seen[1].second;
    EXPECT_NEAR(at_rest(axis, -x, 0.01, effect), -one, 3e-16);
  }
}

TEST(DisplacementEffects, ThermalExpansionGrowsWithTimeAndTravel) {
  // 600 um per m and minute: at 100 mm from the fixed point 1 um per second.
  const ThermalExpansion effect{.rate = 600e-6 / 60, .reference = 0.05};
  EXPECT_NEAR(at_rest(kX, 0.15, 2, effect), 2 * kUm, kRounding);
  EXPECT_NEAR(at_rest(kX, -0.05, 2, effect), -2 * kUm, kRounding);
  EXPECT_NEAR(at_rest(kX, 0.05, 2, effect), 0, kRounding);
  EXPECT_LT(worst(
                kX, [](double t, double q) { return 10e-6 * t * (q - 0.05); }, effect),
            kRounding);
}

TEST(DisplacementEffects, ThermalWarmUpEndsAtAlphaDeltaT) {
  const ThermalWarmUp effect{.rise = 4, .time_constant = 0.5, .reference = 0};
  // Steel, 4 K, 100 mm: 4.6 um in the end, 1 - 1/e of it after one time constant.
  EXPECT_NEAR(at_rest(kX, 0.1, 0.5, effect), 4.6 * kUm * 0.6321205588285577, kRounding);
  EXPECT_NEAR(at_rest(kX, 0.1, 20, effect), 4.6 * kUm, kRounding);
  EXPECT_LT(
      worst(
          kX, [](double t, double q) { return 46e-6 * (1 - std::exp(-t / 0.5)) * q; }, effect),
      kRounding);
}

TEST(DisplacementEffects, ThermalDriftIsAnExponentialOffset) {
  const ThermalDrift effect{.offset = -20 * kUm, .time_constant = 0.5};
  EXPECT_NEAR(at_rest(kX, 0.1, 0.5, effect), -20 * kUm * 0.6321205588285577, kRounding);
  EXPECT_NEAR(at_rest(kA, 0.1, 20, effect), -20 * kUm, kRounding);
  EXPECT_LT(worst(
                kX, [](double t, double) { return -20 * kUm * (1 - std::exp(-t / 0.5)); }, effect),
            kRounding);
}

TEST(DisplacementEffects, AmbientCycleReturns) {
  const AmbientCycle effect{.amplitude = 4 * kUm, .period = 1.2};
  EXPECT_NEAR(at_rest(kX, 0.1, 0.3, effect), 4 * kUm, kRounding);
  EXPECT_NEAR(at_rest(kX, 0.1, 1.2, effect), 0, kRounding);
  EXPECT_NEAR(at_rest(kC, 0.1, 1.3, effect), 2 * kUm, kRounding);  // sin 30
  EXPECT_LT(worst(
                kY, [](double t, double) { return 4 * kUm * std::sin(2 * kPi * t / 1.2); }, effect),
            kRounding);
}

}  // namespace
}  // namespace vcnc::displacement_effects_test
