#include "diagnosis/records/frozen_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "model/parameters.hpp"
#include "tests/diagnosis/healthy_run.hpp"

namespace vcnc::frozen_check_test {
namespace {

struct Setting {
  const char* key;
  double value;
};

RunOfMachine run_with(RunOfMachine (*run)(const Effects&), const std::vector<Setting>& faults) {
  Machine machine;
  for (const Setting& f : faults) set_parameter(machine, f.key, f.value);
  return run(machine.effects);
}

/// Simulated records have no noise; what is constant in them is so for a reason.
TEST(FrozenCheck, NoFaultOfTheLibraryIsAChannelThatHangs) {
  const std::vector<std::vector<Setting>> faults{
      {},
      {{"effects.probe.dropped_samples.share_percent", 95}},
      {{"effects.probe.contact_loss.start_s", 3}, {"effects.probe.contact_loss.duration_ms", 500}},
      {{"effects.probe.range_clip.limit_mm", 0.2}},
      {{"effects.probe.return_to_zero.half_width_um", 20}},
      {{"effects.X.torque_limit.missing_percent", 95}},
      {{"effects.X.coulomb.level_N", 200}},
  };
  for (const std::vector<Setting>& fault : faults)
    for (const auto run : {circles_in_a_ring, reversals_in_the_air}) {
      Record record = run_with(run, fault).record;
      record.warnings.clear();
      take_out_frozen(record);
      EXPECT_TRUE(record.warnings.empty())
          << (fault.empty() ? "healthy" : fault[0].key) << ": " << record.warnings.front();
    }
}

TEST(FrozenCheck, AReadingThatHangsIsMissing) {
  Record record = circles_in_a_ring({}).record;
  for (MeasuredSignal& s : record.signals)
    if (s.kind == SignalKind::deflection && s.axis == 0) {
      // Where it changes: from the largest reading on.
      const auto from = std::max_element(s.value.begin(), s.value.end()) - s.value.begin() + 200;
      std::fill(s.value.begin() + from, s.value.begin() + from + 300,
                s.value[static_cast<std::size_t>(from)]);
    }
  record.warnings.clear();
  take_out_frozen(record);
  ASSERT_EQ(record.warnings.size(), 1u);
  EXPECT_NE(record.warnings[0].find("deflection x"), std::string::npos);
}

}  // namespace
}  // namespace vcnc::frozen_check_test
