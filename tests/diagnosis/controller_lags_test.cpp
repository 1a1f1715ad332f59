#include "diagnosis/healthy/controller_lags.hpp"

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

/// A feed-forward of differences of set-points comes late: what is late beyond the measured
/// velocity is what moves the axis.
TEST(ControllerLags, TellALateFeedForward) {
  for (const double of_velocity : {0.0, 200.0}) {
    Machine machine = later(0, of_velocity);
    machine.effects.deviations.push_back({"axes.X.feedforward_lag_us", 500});
    const ServoParams found = with_lags_of(recorded(machine, 4), declared()).axes[kX].servo;
    EXPECT_NEAR(1e6 * (found.feedforward_lag - found.velocity_lag), 500 - of_velocity, 25);
  }
}

/// A balancing filter makes the set-point wait for the feed-forward; in one run a feed-forward that
/// is less does the same, and is not believed.
TEST(ControllerLags, TellASetPointThatWaits) {
  Machine machine = later(0, 100);
  machine.effects.deviations.push_back({"axes.X.setpoint_lag_us", 900});
  machine.effects.deviations.push_back({"axes.X.feedforward_lag_us", 400});
  const ServoParams found = with_lags_of(recorded(machine, 5), declared()).axes[kX].servo;
  EXPECT_NEAR(1e6 * found.setpoint_lag, 900, 25);
  EXPECT_NEAR(1e6 * (found.feedforward_lag - found.velocity_lag), 300, 25);
  EXPECT_EQ(found.position_lag, 0);
  Machine without = declared();
  without.axes[kX].servo.velocity_ff = 0;
  EXPECT_EQ(with_lags_of(recorded(machine, 5), without).axes[kX].servo.setpoint_lag, 0);
}

TEST(ControllerLags, TellACommandThatIsDelayed) {
  Machine machine = later(0, 100);
  machine.effects.axis[kX].get<CommandDelay>().delay = 0.6e-3;
  const Machine found = with_lags_of(recorded(machine, 6), declared());
  EXPECT_NEAR(1e3 * found.effects.axis[kX].get<CommandDelay>().delay, 0.6, 0.01);
  EXPECT_EQ(found.axes[kX].servo.setpoint_lag, 0);
  EXPECT_EQ(told_lags(declared(), found, kX).find("the set-point"), std::string::npos);
  EXPECT_NE(told_lags(declared(), found, kX).find("the command 0 -> "), std::string::npos)
      << told_lags(declared(), found, kX);
}

TEST(ControllerLags, StayAsDeclaredWhereNothingIsLater) {
  const Machine found = with_lags_of(recorded(later(0, 0), 2), declared());
  for (const LoopLag& lag : kLoopLags) EXPECT_EQ(found.axes[kX].servo.*lag.value, 0) << lag.key;
}

TEST(ControllerLags, AreToldWhereTheyAreOthers) {
  Machine was, is;
  EXPECT_EQ(told_lags(was, is, kX), "");
  is.axes[kX].servo.velocity_lag = 0.25e-3;
  is.axes[kX].servo.feedforward_lag = 4e-3;
  EXPECT_EQ(
      told_lags(was, is, kX),
      "the measured velocity 0 -> 250 us, the feed-forward 0 -> 4000 us (none longer is sought)");
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
