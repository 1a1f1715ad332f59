#include "diagnosis/replica/readings_time.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "model/input_error.hpp"
#include "model/parameters.hpp"
#include "tests/diagnosis/healthy_run.hpp"

namespace vcnc::readings_time_test {
namespace {

/// Both runs are made once.
const RunOfMachine& circles() {
  static const RunOfMachine run = circles_in_a_ring({});
  return run;
}
const RunOfMachine& s_piece() {
  static const RunOfMachine run = lap_of_the_s_piece({});
  return run;
}

/// Reading `axis` comes `samples` later than it was.
void make_late(Record& record, std::size_t axis, long samples) {
  for (MeasuredSignal& s : record.signals) {
    if (s.kind != SignalKind::deflection || s.axis != axis) continue;
    const auto by = static_cast<std::ptrdiff_t>(std::abs(samples));
    if (samples > 0)
      std::rotate(s.value.begin(), s.value.end() - by, s.value.end());
    else
      std::rotate(s.value.begin(), s.value.begin() + by, s.value.end());
  }
}

struct Said {
  std::string refusal;
  std::vector<std::string> warnings;
};

Said said(const RunOfMachine& run, const Record& record) {
  try {
    return {"", check_reading_times(record, run.declared, run.piece)};
  } catch (const InputError& e) {
    return {e.what(), {}};
  }
}

TEST(ReadingsTime, ReadingsThatAreLateOrEarlyAreNamed) {
  Record late = circles().record, one = late, early = s_piece().record;
  for (std::size_t axis = 0; axis < 3; ++axis) make_late(late, axis, 20);
  make_late(one, 0, 50);
  for (std::size_t axis = 0; axis < 3; ++axis) make_late(early, axis, -30);
  const std::string all = said(circles(), late).refusal;
  EXPECT_NE(all.find("(deflection x) is 20 ms late, "), std::string::npos) << all;
  EXPECT_NE(all.find("(deflection y) is 20 ms late"), std::string::npos) << all;
  const std::string x = said(circles(), one).refusal;
  EXPECT_NE(x.find("(deflection x) is 50 ms late; "), std::string::npos) << x;
  const std::string before = said(s_piece(), early).refusal;
  EXPECT_NE(before.find("(deflection x) is 30 ms early"), std::string::npos) << before;
}

TEST(ReadingsTime, WithoutPositionsItIsAWarning) {
  Record record = circles().record;
  for (std::size_t axis = 0; axis < 3; ++axis) make_late(record, axis, 20);
  std::erase_if(record.signals,
                [](const MeasuredSignal& s) { return s.kind == SignalKind::position; });
  const Said s = said(circles(), record);
  EXPECT_EQ(s.refusal, "");
  ASSERT_EQ(s.warnings.size(), 1u);
  EXPECT_NE(s.warnings[0].find("by the commands of the axes"), std::string::npos) << s.warnings[0];
}

/// On a circle play, friction and lags look like a time.
TEST(ReadingsTime, NoFaultIsTakenForATime) {
  struct Fault {
    const char* key;
    double value;
  };
  const std::vector<std::vector<Fault>> faults{
      {},
      {{"effects.probe.sample_latency.latency_us", 5000}},
      {{"effects.probe.clock_drift.slow_ppm", 10000}},
      {{"effects.probe.surface_friction.coefficient", 0.3}},
      {{"effects.probe.dropped_samples.share_percent", 90}},
      {{"effects.X.command_delay.delay_ms", 5}, {"effects.Y.command_delay.delay_ms", 5}},
      {{"effects.X.load_play.width_um", 100}, {"effects.Y.load_play.width_um", 100}},
      {{"effects.X.lost_motion.compliance_nm_per_N", 200},
       {"effects.X.viscous.coefficient_Ns_per_m", 2000}},
      {{"effects.X.kv_error.deviation_percent", -50},
       {"effects.Y.kv_error.deviation_percent", -50}},
  };
  for (const std::vector<Fault>& fault : faults) {
    Machine machine = circles().declared;
    for (const Fault& f : fault) set_parameter(machine, f.key, f.value);
    const RunOfMachine run = circles_in_a_ring(machine.effects);
    const Said s = said(run, run.record);
    EXPECT_EQ(s.refusal, "") << (fault.empty() ? "healthy" : fault[0].key);
    EXPECT_TRUE(s.warnings.empty());
  }
  const Said healthy = said(s_piece(), s_piece().record);
  EXPECT_EQ(healthy.refusal, "");
}

}  // namespace
}  // namespace vcnc::readings_time_test
