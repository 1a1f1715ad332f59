#include "diagnosis/healthy/differential.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "diagnosis/records/measured_table.hpp"
#include "toy_machine.hpp"

namespace vcnc {
namespace {

constexpr std::size_t kLap = 400;
constexpr int kLaps = 4;
constexpr std::size_t kPosition = 0;  // channel of the toy

Record measured(std::uint64_t seed) {
  Record record = toy::commands(kLap, kLaps);
  toy::measure(record, {}, seed);
  return record;
}

std::vector<double>& position_of(Record& record) {
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::position) return s.value;
  throw std::logic_error("a toy has a position");
}

/// Adds to the position what changes its sign from lap to lap.
void add_turning(Record& record, double size) {
  std::vector<double>& position = position_of(record);
  for (const Stretch& s : record.stretches)
    for (std::size_t k = s.begin; k < s.end; ++k)
      position[k] +=
          (s.repetition % 2 == 0 ? size : -size) * std::sin(static_cast<double>(k - s.begin) / 20);
}

HealthyRun healthy(const Record& record) {
  toy::ToyReplica replica(record);
  return healthy_run(record, replica, {});
}

/// Root of the mean square of a difference from what the machine does as declared.
double left_of(const DifferentialRecord& difference) {
  const std::vector<double> clean = toy::ToyReplica(difference.record).predict({})[kPosition];
  const std::vector<double>& is = difference.record.find(SignalKind::position, 0)->value;
  double sum = 0;
  for (std::size_t k = 0; k < is.size(); ++k) sum += std::pow(is[k] - clean[k], 2);
  return std::sqrt(sum / static_cast<double>(is.size()));
}

double scale_of_position(const DifferentialRecord& difference) {
  return difference.noise_scales({{SignalKind::position, 0}}).front();
}

TEST(LessHealthy, TakesTheMeanOfTheHealthyLapsOff) {
  const DifferentialRecord d = less_healthy(measured(1), healthy(measured(2)));
  EXPECT_NEAR(left_of(d), std::sqrt(1 + 1.0 / kLaps) * toy::kPositionNoise,
              0.05 * toy::kPositionNoise);
  EXPECT_DOUBLE_EQ(scale_of_position(d), std::sqrt(1 + 1.0 / kLaps));
}

TEST(LessHealthy, HoldsALapAgainstTheHealthyOneThatCameAsLateWhereLapsDifferAlike) {
  Record now = measured(1), before = measured(2);
  add_turning(now, 10 * toy::kPositionNoise);
  add_turning(before, 10 * toy::kPositionNoise);
  const DifferentialRecord d = less_healthy(now, healthy(before));
  EXPECT_NEAR(left_of(d), std::sqrt(2.0) * toy::kPositionNoise, 0.05 * toy::kPositionNoise);
  EXPECT_DOUBLE_EQ(scale_of_position(d), 1);  // both noises are in what laps differ by
  EXPECT_GT(d.noise_scales({{SignalKind::force, 0}}).front(), 1);  // whose laps are alike
}

/// What first laps have of what came before them tells no noise, and is in both runs.
TEST(LessHealthy, HoldsAFirstLapAgainstTheFirstOneWhereTheirBeginningsDiffer) {
  const auto add_run_in = [](Record& record) {
    std::vector<double>& position = position_of(record);
    for (const Stretch& s : record.stretches)
      for (std::size_t k = s.begin; k < s.begin + 150 && s.repetition == 0; ++k)
        position[k] += 100 * toy::kPositionNoise * std::exp(-static_cast<double>(k - s.begin) / 40);
  };
  Record now = measured(1), before = measured(2);
  add_run_in(now);
  add_run_in(before);
  const DifferentialRecord d = less_healthy(now, healthy(before));
  EXPECT_NEAR(left_of(d), std::sqrt(2.0) * toy::kPositionNoise, 0.05 * toy::kPositionNoise);
}

TEST(LessHealthy, TakesTheMeanOffWhereOnlyTheHealthyLapsDiffer) {
  Record before = measured(2);
  add_turning(before, 10 * toy::kPositionNoise);
  const DifferentialRecord d = less_healthy(measured(1), healthy(before));
  EXPECT_NEAR(left_of(d), std::sqrt(1 + 1.0 / kLaps) * toy::kPositionNoise,
              0.05 * toy::kPositionNoise);
}

TEST(LessHealthy, TakesTheMeanOffWhereALapHasNoPartnerThatCameAsLate) {
  Record now = measured(1), before = measured(2);
  add_turning(now, 10 * toy::kPositionNoise);
  add_turning(before, 10 * toy::kPositionNoise);
  std::erase_if(before.stretches, [](const Stretch& s) { return s.repetition == kLaps - 1; });
  const DifferentialRecord d = less_healthy(now, healthy(before));
  EXPECT_GT(left_of(d), 5 * toy::kPositionNoise);
  EXPECT_DOUBLE_EQ(scale_of_position(d), std::sqrt(1 + 1.0 / (kLaps - 1)));
}

/// Without laps of one of three motions, each a third of the time.
Record without_motion(Record record, int condition) {
  std::erase_if(record.stretches, [&](const Stretch& s) { return s.condition == condition; });
  return record;
}

TEST(LessHealthy, ForgetsLapsOfAMotionThatTheHealthyRunHasNot) {
  const Record now = measured(1);
  const DifferentialRecord d = less_healthy(now, healthy(without_motion(measured(2), 2)));
  EXPECT_EQ(d.record.stretches.size(), now.stretches.size() - kLaps);
  EXPECT_TRUE(std::none_of(d.record.stretches.begin(), d.record.stretches.end(),
                           [](const Stretch& s) { return s.condition == 2; }));
  ASSERT_EQ(d.record.warnings.size(), 1u);
  EXPECT_NE(d.record.warnings[0].find("33 % of the motions (by time) have no partner"),
            std::string::npos)
      << d.record.warnings[0];
}

TEST(LessHealthy, NamesASignalThatTheHealthyRunHasNot) {
  HealthyRun run = healthy(measured(2));
  std::erase_if(run.record.signals,
                [](const MeasuredSignal& s) { return s.kind == SignalKind::force; });
  const DifferentialRecord d = less_healthy(measured(1), run);
  ASSERT_EQ(d.record.warnings.size(), 1u);
  EXPECT_EQ(d.record.warnings[0], "The reference run has no force X: not compared.");
}

TEST(LessHealthy, IsRefusedWhereTheHealthyRunDoesNextToNothingOfIt) {
  const HealthyRun run = healthy(without_motion(without_motion(measured(2), 0), 1));
  Record now = without_motion(measured(1), 0);
  EXPECT_NO_THROW(less_healthy(now, run));  // a half
  now.stretches.erase(now.stretches.end() - kLaps + 1, now.stretches.end());
  try {
    less_healthy(now, run);
    FAIL() << "a fifth of the motions is the same";
  } catch (const MeasurementError& e) {
    EXPECT_NE(std::string(e.what()).find("does only 20 % (by time) of the motions of toy"),
              std::string::npos)
        << e.what();
  }
}

TEST(LessHealthy, GivesEveryLapTheUnknownForceOfTheOneThatCameAsLate) {
  const Record now = measured(1), before = measured(2);
  HealthyRun run = healthy(before);
  run.unknown[0].resize(before.samples());
  for (const Stretch& s : before.stretches)
    for (std::size_t k = s.begin; k < s.end; ++k) run.unknown[0][k] = s.repetition;
  const DifferentialRecord d = less_healthy(now, run);
  ASSERT_EQ(d.unknown[0].size(), now.samples());
  for (const Stretch& s : now.stretches)
    EXPECT_DOUBLE_EQ(d.unknown[0][(s.begin + s.end) / 2], s.repetition);
}

}  // namespace
}  // namespace vcnc
