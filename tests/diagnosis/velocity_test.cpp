// The speed of a motor as a signal of its own.
#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/diagnose.hpp"
#include "diagnosis/records/late_velocity.hpp"
#include "diagnosis/replica/machine_replica.hpp"
#include "tests/diagnosis/stroke_run.hpp"

namespace vcnc::velocity_test {
namespace {

using stroke_run::signal_of_x;

constexpr double kLength = 0.05, kRate = 2 * kPi * 0.4;  // of a sine [m], [rad/s]

/// X goes to and fro at 500 Hz, with a speed that is told `late` [s] and is `more` at the turns.
Record to_and_fro(double late, double more) {
  Record record;
  record.period = 2e-3;
  std::vector<double> x, v;
  for (int k = 0; k < 5000; ++k) {
    const double t = k * record.period;
    x.push_back(kLength * std::sin(kRate * t));
    const double turn = std::cos(kRate * (t - late));
    v.push_back(kLength * kRate * turn + (std::abs(turn) < 0.05 ? more * std::sin(kRate * t) : 0));
  }
  record.signals = {signal_of_x(SignalKind::position, x), signal_of_x(SignalKind::velocity, v)};
  return record;
}

TEST(LateVelocity, IsWhatAnAccelerationIsMissing) {
  for (const double late : {-2e-3, 0.0, 0.3e-3, 4e-3}) {
    const auto found = lateness_of_velocity(to_and_fro(late, 0), kX);
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, late, 0.02e-3);
  }
}

TEST(LateVelocity, IsNotWhatATransmissionDoesAtTheTurns) {
  const auto found = lateness_of_velocity(to_and_fro(1e-3, 2e-3), kX);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, 1e-3, 0.02e-3);
}

TEST(LateVelocity, IsUnknownWithoutAPositionOrAnAcceleration) {
  Record record = to_and_fro(1e-3, 0);
  record.signals.erase(record.signals.begin());
  EXPECT_FALSE(lateness_of_velocity(record, kX));
  std::vector<double> x, v;
  for (int k = 0; k < 5000; ++k) {
    x.push_back(1e-4 * k);
    v.push_back(1e-4 / record.period);
  }
  record.signals = {signal_of_x(SignalKind::position, x), signal_of_x(SignalKind::velocity, v)};
  EXPECT_FALSE(lateness_of_velocity(record, kX));
}

/// A screw that gives way, closed with the scale of its table.
Machine declared() {
  Machine machine = stroke_run::declared();
  machine.axes[kX].servo.feedback = ServoParams::Feedback::load;
  machine.axes[kX].mechanics.travel_per_turn = 0.01;
  machine.effects.axis[kX].get<Windup>().compliance = 6e-9;
  return machine;
}

bool compares(const MachineReplica& replica, SignalKind kind) {
  const std::vector<ComparedChannel>& all = replica.channels();
  return std::find(all.begin(), all.end(), ComparedChannel{kind, kX}) != all.end();
}

/// With `kinds` of X beside its command, as a machine would make them, one of them late.
Record recorded(const Machine& machine, const std::vector<SignalKind>& kinds, double late = 0) {
  Record record = stroke_run::recorded(machine, 3);
  const MeasuredSignal position = *record.find(SignalKind::position, kX);
  const std::vector<double> nothing(record.samples(), 0.0);
  std::erase_if(record.signals, [](const auto& s) { return s.kind != SignalKind::command; });
  for (const SignalKind kind : kinds) record.signals.push_back(signal_of_x(kind, nothing));
  Record both = record;
  both.signals = {*record.find(SignalKind::command, kX), signal_of_x(SignalKind::position, nothing),
                  signal_of_x(SignalKind::twist, nothing)};
  const Prediction of = MachineReplica(both, machine, std::nullopt).predict(machine);
  for (MeasuredSignal& s : record.signals) {
    if (s.kind == SignalKind::position) s.value = of[0];
    if (s.kind == SignalKind::twist) s.value = of[1];
    if (s.kind != SignalKind::velocity) continue;
    for (std::size_t k = 1; k + 1 < s.value.size(); ++k) {
      const auto from = static_cast<std::size_t>(
          std::max(1.0, static_cast<double>(k) - std::round(late / record.period)));
      s.value[k] = ((of[0][from + 1] - of[1][from + 1]) - (of[0][from - 1] - of[1][from - 1])) /
                   (2 * record.period);
    }
  }
  return record;
}

TEST(MotorVelocity, IsComparedWhereNothingElseTellsOfTheMotor) {
  const auto asked = [&](const Machine& machine, std::vector<SignalKind> kinds) {
    const Record record = recorded(machine, kinds);
    return compares(MachineReplica(record, machine, std::nullopt), SignalKind::velocity);
  };
  Machine of_motor = declared();
  of_motor.axes[kX].servo.feedback = ServoParams::Feedback::motor;
  using enum SignalKind;
  EXPECT_TRUE(asked(declared(), {position, velocity}));
  EXPECT_TRUE(asked(of_motor, {velocity}));
  EXPECT_FALSE(asked(of_motor, {position, velocity}));
  EXPECT_FALSE(asked(declared(), {position, twist, velocity}));
}

TEST(MotorVelocity, IsTheSlopeOfTheMotorsPositionAsLateAsItWasRecorded) {
  for (const double late : {0.0, 3e-3}) {
    const Record record = recorded(declared(), {SignalKind::position, SignalKind::velocity}, late);
    const MachineReplica replica(record, declared(), std::nullopt);
    const Prediction predicted = replica.predict(declared());
    ASSERT_EQ(replica.channels()[1].kind, SignalKind::velocity);
    const std::vector<double>& v = record.find(SignalKind::velocity, kX)->value;
    double off = 0, size = 0;
    for (std::size_t k = 20; k + 20 < v.size(); ++k) {
      off = std::max(off, std::abs(predicted[1][k] - v[k]));
      size = std::max(size, std::abs(v[k]));
    }
    EXPECT_LT(off, 0.01 * size) << late;
  }
}

TEST(MotorVelocity, TellsOfAGapThatTheScaleOfTheTableHides) {
  Machine now = declared();
  now.effects.axis[kX].get<Backlash>().gap = 10e-6;
  std::vector<double> share;
  for (const bool with : {false, true}) {
    std::vector<SignalKind> kinds{SignalKind::position};
    if (with) kinds.push_back(SignalKind::velocity);
    const Record record = recorded(now, kinds);
    const MachineReplica replica(record, declared(), std::nullopt);
    const Prediction a = replica.predict(declared()), b = replica.predict(now);
    for (std::size_t c = 0; c < a.size(); ++c) {
      double sum = 0;
      for (std::size_t k = 0; k < a[c].size(); ++k)
        if (std::isfinite(a[c][k])) sum += std::pow(a[c][k] - b[c][k], 2);
      share.push_back(std::sqrt(sum / static_cast<double>(a[c].size())));
    }
  }
  ASSERT_EQ(share.size(), 3U);
  EXPECT_GT(share[2], 20e-6);  // [m/s] rms: the motor crosses 10 um within some milliseconds
}

}  // namespace
}  // namespace vcnc::velocity_test
