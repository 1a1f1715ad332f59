#include "diagnosis/search/controller_lags.hpp"

#include <gtest/gtest.h>

#include "tests/diagnosis/stroke_run.hpp"

namespace vcnc::controller_lags_test {
namespace {

using stroke_run::declared, stroke_run::recorded;

/// Later than declared, and with another friction besides.
Machine later(double position_lag_us, double velocity_lag_us) {
  Machine machine = declared();
  machine.effects.axis[kX].get<Coulomb>().level = 140;
  machine.effects.axis[kX].get<Viscous>().coefficient = 800;
  machine.effects.deviations.push_back({"axes.X.position_lag_us", position_lag_us});
  machine.effects.deviations.push_back({"axes.X.velocity_lag_us", velocity_lag_us});
  return machine;
}

TEST(ControllerLags, AreToldWhateverFrictionIsLike) {
  // With full feed-forward a position loop has next to nothing to be late with.
  for (const auto& [of_position, of_velocity] : {std::pair{0.0, 250.0}, {150, 400}}) {
    const Machine found = with_lags_of(recorded(later(of_position, of_velocity), 1), declared());
    EXPECT_NEAR(1e6 * found.axes[kX].servo.velocity_lag, of_velocity, 15);
    EXPECT_EQ(found.axes[kY].servo.velocity_lag, declared().axes[kY].servo.velocity_lag);
  }
}

TEST(ControllerLags, StayAsDeclaredWhereNothingIsLater) {
  const Machine found = with_lags_of(recorded(later(0, 0), 2), declared());
  EXPECT_EQ(found.axes[kX].servo.position_lag, 0);
  EXPECT_EQ(found.axes[kX].servo.velocity_lag, 0);
}

TEST(ControllerLags, AreNotAskedForWithoutAForceNorOfASampledController) {
  EXPECT_EQ(with_lags_of(recorded(later(0, 300), 3, false), declared()).axes[kX].servo.velocity_lag,
            0);
  Machine sampled = declared();
  sampled.axes[kX].servo.controller = ServoParams::Controller::sampled;
  sampled.axes[kX].servo.velocity_bandwidth = 20;
  EXPECT_EQ(with_lags_of(recorded(later(0, 300), 3), sampled).axes[kX].servo.velocity_lag, 0);
}

}  // namespace
}  // namespace vcnc::controller_lags_test
