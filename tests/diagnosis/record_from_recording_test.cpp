#include "diagnosis/records/record_from_recording.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "configs/config.hpp"

namespace vcnc::record_from_recording_test {
namespace {

RunBegin begin() {
  RunBegin b;
  b.run_id = "run";
  b.declared_toml = to_toml(Machine());
  return b;
}

std::vector<TelemetryRow> rows(std::size_t n) {
  std::vector<TelemetryRow> all(n);
  for (std::size_t k = 0; k < n; ++k) {
    all[k].tick = static_cast<double>(k);
    all[k].state = 1;
    all[k].q_cmd[kX] = 1e-5 * static_cast<double>(k);
    all[k].force[kY] = 0.25;
    all[k].deflection[2] = -1e-6;
    all[k].adc.fill(32768);
  }
  return all;
}

TEST(RecordFromRecording, IsInSiUnits) {
  const Record r = record_from(begin(), rows(10), {});
  ASSERT_EQ(r.samples(), 10u);
  EXPECT_EQ(r.period, 1e-3);
  EXPECT_DOUBLE_EQ(r.find(SignalKind::command, kX)->value[7], 7e-5);
  EXPECT_DOUBLE_EQ(r.find(SignalKind::force, kY)->value[3],
                   0.25 * Machine().axes[kY].mechanics.force_limit);
  EXPECT_EQ(r.find(SignalKind::deflection, 2)->value[9], -1e-6);
  EXPECT_NEAR(r.find(SignalKind::cosine, 0)->value[0], 0, 1e-12);  // the middle of the converter
  EXPECT_TRUE(r.warnings.empty());
}

TEST(RecordFromRecording, LostRowsAreMissing) {
  std::vector<TelemetryRow> all = rows(20);
  all.erase(all.begin() + 5, all.begin() + 8);
  const Record r = record_from(begin(), all, {});
  ASSERT_EQ(r.samples(), 20u);
  for (std::size_t k = 0; k < 20; ++k)
    EXPECT_EQ(std::isnan(r.find(SignalKind::position, kC)->value[k]), k >= 5 && k < 8) << k;
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_EQ(r.warnings[0], "3 rows are missing");
}

TEST(RecordFromRecording, EndsBeforeAnAlarmStopsTheMachine) {
  std::vector<TelemetryRow> all = rows(20);
  for (std::size_t k = 12; k < 20; ++k) all[k].state = static_cast<int>(NcState::alarm);
  const Record r = record_from(begin(), all, {{11, 40, "NC unit", "drive X has failed"}});
  EXPECT_EQ(r.samples(), 9u);
  ASSERT_EQ(r.warnings.size(), 2u);
  EXPECT_NE(r.warnings[0].find("drive X has failed"), std::string::npos);
  EXPECT_NE(r.warnings[1].find("0.009 s"), std::string::npos);
}

}  // namespace
}  // namespace vcnc::record_from_recording_test
